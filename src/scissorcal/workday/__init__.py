"""The day's work in one workspace: what is there, what comes next, and every step of it."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
