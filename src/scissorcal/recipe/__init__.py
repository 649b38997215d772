"""The recipe: a scene, its materials, blades, device and how to fit them, checked as it is read."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
