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

    __version__: str

__all__ = [
    "OutsideCoverageWarning",
    "__version__",
    "open_fit",
    "open_package",
    "open_recording",
    "open_workspace",
]


_HOMES = {"OutsideCoverageWarning": "scissorcal.package", "__version__": "scissorcal.identity"}


def __getattr__(name: str) -> Any:
    if name not in __all__:
        raise AttributeError(f"module 'scissorcal' has no attribute {name!r}")
    module = importlib.import_module(_HOMES.get(name, "scissorcal.library"))
    return getattr(module, "VERSION" if name == "__version__" else name)


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
