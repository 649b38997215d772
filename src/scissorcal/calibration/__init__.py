"""From recordings and photographs to fits: recording + model + inference -> result."""

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from scissorcal.calibration.cut.fit import cut_experiment, fit_cut
    from scissorcal.calibration.cut.model import CutExperiment
    from scissorcal.calibration.cut.structure import cutting_from
    from scissorcal.calibration.fit_model import CutRun, Experiment, FrictionRun
    from scissorcal.calibration.friction.fit import fit_friction, friction_experiment
    from scissorcal.calibration.friction.model import FrictionExperiment
    from scissorcal.calibration.parameters import FittedParameter
    from scissorcal.calibration.result import FitResult, FitSeries, StrokeError
    from scissorcal.calibration.store import load, load_fit, read_header, save

__all__ = [
    "CutExperiment",
    "CutRun",
    "Experiment",
    "FitResult",
    "FitSeries",
    "FittedParameter",
    "FrictionExperiment",
    "FrictionRun",
    "StrokeError",
    "cut_experiment",
    "cutting_from",
    "fit_cut",
    "fit_friction",
    "friction_experiment",
    "load",
    "load_fit",
    "read_header",
    "save",
]

_HOMES = {
    "cut.fit": ("cut_experiment", "fit_cut"),
    "cut.model": ("CutExperiment",),
    "cut.structure": ("cutting_from",),
    "fit_model": ("CutRun", "Experiment", "FrictionRun"),
    "friction.fit": ("fit_friction", "friction_experiment"),
    "friction.model": ("FrictionExperiment",),
    "parameters": ("FittedParameter",),
    "result": ("FitResult", "FitSeries", "StrokeError"),
    "store": ("load", "load_fit", "read_header", "save"),
}


def __getattr__(name: str) -> Any:
    for home, names in _HOMES.items():
        if name in names:
            return getattr(importlib.import_module(f"{__name__}.{home}"), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
