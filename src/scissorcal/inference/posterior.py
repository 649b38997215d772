"""What inference takes beside the problem, and what it returns, whatever the effort."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from scissorcal.aliases import Array, Progress
from scissorcal.inference.optimise import Optimum
from scissorcal.inference.problem import SamplingStatus, Stop

Effort = Literal["draft", "standard", "thorough"]
"""How a posterior is drawn: around its optimum; the same, corrected by importance or by nested
sampling where that is curved; ensembles of walkers. docs/how-to-choose.md compares them."""


@dataclass(frozen=True)
class InferOptions:
    """How far an inference goes, and who follows it.

    ``budget`` is the number of evaluations that sampling may take; None leaves it to the effort.
    Standard effort goes on with other samplers where it does not do well, unless ``escalate`` is
    false. ``checkpoint`` is the file that ensembles resume from. ``stop`` is asked before every
    evaluation of search and sampling whether the time allowed is used up.
    """

    budget: int | None = None
    escalate: bool = True
    checkpoint: Path | None = None
    stop: Stop | None = None
    progress: Progress | None = None


@dataclass(frozen=True)
class Posterior:
    """Equally weighted draws (n, p) and how they came about.

    ``effort`` is what was asked for, ``effort_reached`` what it became; ``status`` says how far
    the draws may be trusted and ``sentence`` the same in full: what was tried, and where it
    stopped. ``null`` names, for each direction the data leave to the prior, its parameters with
    their weights. ``inflation`` (p,) is the factor by which autocorrelation widens each standard
    deviation; ``noise_orders`` are those of the autoregressions that the data chose,
    ``dispersion`` what strokes vary beyond them. ``effective`` counts independent draws,
    ``evaluations`` calls of the log-likelihood, those of the search included.
    ``log_posterior`` gives the logarithm of what was sampled, up to a constant, at any point (p,).

    ``k_hat`` is NaN at draft effort, where nothing is sampled against the posterior. ``r_hat``
    (p,), ``tau`` (p,) in steps and ``acceptance`` are NaN, and ``ensembles`` is zero, unless
    ensembles were run.
    """

    names: tuple[str, ...]
    optimum: Optimum
    draws: Array
    covariance: Array
    k_hat: float
    effective: float
    inflation: Array
    null: tuple[str, ...]
    effort: Effort
    effort_reached: Effort
    status: SamplingStatus
    sentence: str
    evaluations: int
    r_hat: Array
    tau: Array
    ensembles: int
    acceptance: float
    log_posterior: Callable[[Array], float]
    noise_orders: tuple[int, ...] = ()
    dispersion: float = 1.0
