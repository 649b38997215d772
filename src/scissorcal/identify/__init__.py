"""Identify one joint, turning or sliding, from logs alone: law, intervals, gaps, exports.

`read_log` finds columns and units and gives a recording; `identify` fits it, and says what the log
does not tell; `compare` predicts another log; `export_text` writes what was found for a simulator.
The fit itself is that of :mod:`scissorcal.calibration`.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
