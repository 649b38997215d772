"""The physics: edge, response, fracture, torque and friction, as pure functions of arrays.

Names are imported when they are first used: the table of friction terms, which the recipe reads,
needs no numpy.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
