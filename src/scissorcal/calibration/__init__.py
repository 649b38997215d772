"""One file per thing that is fitted: recording + model + inference -> result."""

from scissorcal.calibration.cut import fit_cut
from scissorcal.calibration.cut_data import cutting_from
from scissorcal.calibration.friction import fit_friction, friction_law
from scissorcal.calibration.hashing import fit_inputs_hash
from scissorcal.calibration.result import FitResult, FitSeries, FittedParameter, StrokeError
from scissorcal.calibration.storage import load_fit, save_fit

__all__ = [
    "FitResult",
    "FitSeries",
    "FittedParameter",
    "StrokeError",
    "cutting_from",
    "fit_cut",
    "fit_friction",
    "fit_inputs_hash",
    "friction_law",
    "load_fit",
    "save_fit",
]
