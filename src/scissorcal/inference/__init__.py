"""Posteriors of any model: optimum, curvature, autocorrelation, importance sampling."""

from scissorcal.inference.ar_noise import ArNoise, fit_ar
from scissorcal.inference.autocorrelation import ljung_box, robust_covariance_of_scores
from scissorcal.inference.curvature import gradient, hessian, natural_step
from scissorcal.inference.infer import Posterior, infer
from scissorcal.inference.information import likelihood_information
from scissorcal.inference.optimise import Optimum, find_optimum
from scissorcal.inference.problem import Problem
from scissorcal.inference.tails import log_density, tails_of

__all__ = [
    "ArNoise",
    "Optimum",
    "Posterior",
    "Problem",
    "find_optimum",
    "fit_ar",
    "gradient",
    "hessian",
    "infer",
    "likelihood_information",
    "ljung_box",
    "log_density",
    "natural_step",
    "robust_covariance_of_scores",
    "tails_of",
]
