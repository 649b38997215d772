from .autocorrelation import ljung_box as ljung_box
from .autocorrelation import robust_covariance_of_scores as robust_covariance_of_scores
from .checkpoint import Walk as Walk
from .checkpoint import load_walks as load_walks
from .checkpoint import save_walks as save_walks
from .curvature import gradient as gradient
from .curvature import hessian as hessian
from .curvature import likelihood_information as likelihood_information
from .effective import bulk_ess as bulk_ess
from .importance import smooth_weights as smooth_weights
from .infer import infer as infer
from .noise import ArNoise as ArNoise
from .noise import fit_ar as fit_ar
from .noise import log_density as log_density
from .noise import tails_of as tails_of
from .optimise import Cluster as Cluster
from .optimise import Optimum as Optimum
from .optimise import find_optimum as find_optimum
from .posterior import Effort as Effort
from .posterior import InferOptions as InferOptions
from .posterior import Posterior as Posterior
from .problem import Counter as Counter
from .problem import NotFiniteError as NotFiniteError
from .problem import Problem as Problem
from .problem import SamplingStatus as SamplingStatus
from .problem import SearchStatus as SearchStatus
from .problem import Stop as Stop
from .thorough import rank_r_hat as rank_r_hat

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
