"""From fits to a package for a 1 kHz loop: tables with an error bound, checked and hashed."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
