"""Calibrate, identify and render a haptic scissors rig, with intervals tested against known truth.

>>> import scissorcal
>>> scissorcal.open_package("package/paper-80gsm.zip")
Traceback (most recent call last):
scissorcal.errors.MissingError: There is no file package/paper-80gsm.zip. Make it with \
'scissorcal package build'.
"""

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from scissorcal.library import open_fit, open_package, open_recording, open_workspace
    from scissorcal.package import OutsideCoverageWarning

__all__ = [
    "OutsideCoverageWarning",
    "__version__",
    "open_fit",
    "open_package",
    "open_recording",
    "open_workspace",
]

__version__ = "0.1.0"

_HOMES = {"OutsideCoverageWarning": "scissorcal.package"}


def __getattr__(name: str) -> Any:
    if name not in __all__:
        raise AttributeError(f"module 'scissorcal' has no attribute {name!r}")
    return getattr(importlib.import_module(_HOMES.get(name, "scissorcal.library")), name)


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
