"""Pressing on a surface and moving along it: gains of the hybrid law from its sampled loop."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
