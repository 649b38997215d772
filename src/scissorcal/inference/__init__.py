"""Posteriors of any model: optima, curvature, autocorrelation, sampling by effort."""

from scissorcal.inference.autocorrelation import ljung_box, robust_covariance_of_scores
from scissorcal.inference.curvature import gradient, hessian
from scissorcal.inference.importance import smooth_weights
from scissorcal.inference.infer import infer
from scissorcal.inference.noise import ArNoise, fit_ar, log_density, tails_of
from scissorcal.inference.optimise import Cluster, Optimum, find_optimum
from scissorcal.inference.posterior import Effort, InferOptions, Posterior
from scissorcal.inference.problem import (
    Counter,
    NotFiniteError,
    Problem,
    SamplingStatus,
    SearchStatus,
    Stop,
)

__all__ = [
    "ArNoise",
    "Cluster",
    "Counter",
    "Effort",
    "InferOptions",
    "NotFiniteError",
    "Optimum",
    "Posterior",
    "Problem",
    "SamplingStatus",
    "SearchStatus",
    "Stop",
    "find_optimum",
    "fit_ar",
    "gradient",
    "hessian",
    "infer",
    "ljung_box",
    "log_density",
    "robust_covariance_of_scores",
    "smooth_weights",
    "tails_of",
]
