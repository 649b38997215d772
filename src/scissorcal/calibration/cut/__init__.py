"""Cuts and presses: response, fracture and ripple, over the path."""

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from scissorcal.calibration.cut.fit import cut_experiment, fit_cut
    from scissorcal.calibration.cut.model import CutExperiment
    from scissorcal.calibration.cut.structure import cutting_from, edge_of

__all__ = [
    "CutExperiment",
    "cut_experiment",
    "cutting_from",
    "edge_of",
    "fit_cut",
]

_HOMES = {
    "fit": ("cut_experiment", "fit_cut"),
    "model": ("CutExperiment",),
    "structure": ("cutting_from", "edge_of"),
}


def __getattr__(name: str) -> Any:
    for home, names in _HOMES.items():
        if name in names:
            return getattr(importlib.import_module(f"{__name__}.{home}"), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
