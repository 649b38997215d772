"""Calibrate, identify and render a haptic scissors rig, with intervals tested against known truth.

Fits tell what they do to the logger ``scissorcal`` (level INFO) as well as to a ``progress``.

>>> import scissorcal
>>> scissorcal.open_package("package/paper-80gsm.zip")
Traceback (most recent call last):
scissorcal.errors.MissingError: There is no file package/paper-80gsm.zip. Make it with \
'scissorcal package build'.
"""

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from scissorcal import examples
    from scissorcal.aliases import Progress
    from scissorcal.library import (
        create_workspace,
        fit_cut,
        fit_friction,
        open_fit,
        open_package,
        open_recording,
        open_workspace,
        verify_fit,
    )
    from scissorcal.model import ResponseLaw
    from scissorcal.package import OutsideCoverageWarning
    from scissorcal.recording import Recording
    from scissorcal.stated import Blades, Friction, Material, build_package

    __version__: str

__all__ = [
    "Blades",
    "Friction",
    "Material",
    "OutsideCoverageWarning",
    "Progress",
    "Recording",
    "ResponseLaw",
    "__version__",
    "build_package",
    "create_workspace",
    "examples",
    "fit_cut",
    "fit_friction",
    "open_fit",
    "open_package",
    "open_recording",
    "open_workspace",
    "verify_fit",
]


_HOMES = {
    "OutsideCoverageWarning": "scissorcal.package",
    "Progress": "scissorcal.aliases",
    "Recording": "scissorcal.recording",
    "ResponseLaw": "scissorcal.model",
    "__version__": "scissorcal.identity",
    **dict.fromkeys(("Blades", "Friction", "Material", "build_package"), "scissorcal.stated"),
}


def __getattr__(name: str) -> Any:
    if name not in __all__:
        raise AttributeError(f"module 'scissorcal' has no attribute {name!r}")
    if name == "examples":
        return importlib.import_module("scissorcal.examples")
    module = importlib.import_module(_HOMES.get(name, "scissorcal.library"))
    return getattr(module, "VERSION" if name == "__version__" else name)


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
