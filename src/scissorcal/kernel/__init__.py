"""The C core and its thin binding: wire frames, tables, the model's step, the servo loop."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
