"""A package in a browser: what the page is told, the page itself, the local server."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
