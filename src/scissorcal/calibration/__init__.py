"""One file per thing that is fitted: recording + model + inference -> result."""

from scissorcal.calibration.cut import CutExperiment, cut_experiment, cutting_from, fit_cut
from scissorcal.calibration.fit_model import Experiment
from scissorcal.calibration.friction.fit import fit_friction, friction_experiment
from scissorcal.calibration.friction.model import FrictionExperiment
from scissorcal.calibration.hashing import fit_inputs_hash
from scissorcal.calibration.result import FitResult, FitSeries, FittedParameter, StrokeError
from scissorcal.calibration.store import load_fit, save_fit

__all__ = [
    "CutExperiment",
    "Experiment",
    "FitResult",
    "FitSeries",
    "FittedParameter",
    "FrictionExperiment",
    "StrokeError",
    "cut_experiment",
    "cutting_from",
    "fit_cut",
    "fit_friction",
    "fit_inputs_hash",
    "friction_experiment",
    "load_fit",
    "save_fit",
]
