"""From stated numbers to a package: a material, blades and friction that nobody measured here."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
