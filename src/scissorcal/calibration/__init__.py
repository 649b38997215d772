"""Recordings and photographs to fits; each name is imported from its module when it is used."""

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from scissorcal.calibration.cut.fit import cut_experiment, fit_cut
    from scissorcal.calibration.cut.structure import cutting_from
    from scissorcal.calibration.friction.fit import fit_friction, friction_experiment
    from scissorcal.calibration.friction.model import friction_law
    from scissorcal.calibration.hashing import fit_inputs_hash
    from scissorcal.calibration.result import FitResult, FitSeries, FittedParameter
    from scissorcal.calibration.store import load_fit, save_fit

__all__ = [
    "FitResult",
    "FitSeries",
    "FittedParameter",
    "cut_experiment",
    "cutting_from",
    "fit_cut",
    "fit_friction",
    "fit_inputs_hash",
    "friction_experiment",
    "friction_law",
    "load_fit",
    "save_fit",
]

_HOMES = {
    "cut_experiment": "cut.fit",
    "fit_cut": "cut.fit",
    "cutting_from": "cut.structure",
    "fit_friction": "friction.fit",
    "friction_experiment": "friction.fit",
    "friction_law": "friction.model",
    "fit_inputs_hash": "hashing",
    "FitResult": "result",
    "FitSeries": "result",
    "FittedParameter": "result",
    "load_fit": "store",
    "save_fit": "store",
}


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(importlib.import_module(f"{__name__}.{_HOMES[name]}"), name)
