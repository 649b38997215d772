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
    from scissorcal.model import ResponseLaw
    from scissorcal.package import OutsideCoverageWarning
    from scissorcal.stated import Blades, Friction, Material, build_package

    __version__: str

__all__ = [
    "Blades",
    "Friction",
    "Material",
    "OutsideCoverageWarning",
    "ResponseLaw",
    "__version__",
    "build_package",
    "open_fit",
    "open_package",
    "open_recording",
    "open_workspace",
]


_HOMES = {
    "OutsideCoverageWarning": "scissorcal.package",
    "ResponseLaw": "scissorcal.model",
    "__version__": "scissorcal.identity",
    **dict.fromkeys(("Blades", "Friction", "Material", "build_package"), "scissorcal.stated"),
}


def __getattr__(name: str) -> Any:
    if name not in __all__:
        raise AttributeError(f"module 'scissorcal' has no attribute {name!r}")
    module = importlib.import_module(_HOMES.get(name, "scissorcal.library"))
    return getattr(module, "VERSION" if name == "__version__" else name)


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
