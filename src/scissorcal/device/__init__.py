"""The link to a rig, what it is made to do, and what it says: ports, motions, captures."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
