"""Reports: what was fitted and whether to trust it, as one offline page and its JSON twin."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
