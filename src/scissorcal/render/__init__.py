"""The rendering loop on a rig: limits, ramp, watchdog, telemetry, and verdicts at the end."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
