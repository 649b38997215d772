"""Cuts and presses: response, fracture and ripple, over the path."""

from scissorcal.calibration.cut.fit import cut_experiment, fit_cut, settings_of
from scissorcal.calibration.cut.model import CutExperiment
from scissorcal.calibration.cut.structure import cutting_from, edge_of

__all__ = [
    "CutExperiment",
    "cut_experiment",
    "cutting_from",
    "edge_of",
    "fit_cut",
    "settings_of",
]
