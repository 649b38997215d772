"""A linear law over made-up motion: an experiment whose posterior is known."""

from dataclasses import dataclass, field, replace
from types import SimpleNamespace
from typing import Any, Literal, cast

import numpy as np
from numpy.typing import NDArray

from scissorcal.aliases import Array
from scissorcal.calibration.fit_candidate import Candidate, Likelihood
from scissorcal.calibration.parameters import Layout, Parameter, StatedPrior
from scissorcal.calibration.result import Effort, FitResult, StrokeError
from scissorcal.inference import ArNoise, Posterior, Problem, infer
from scissorcal.model import IDENTITY, LOG

BINS = 600
STROKES = 12


def columns() -> Array:
    time = np.linspace(0, 1, BINS)
    return np.stack([np.ones(BINS), np.sin(40 * time), np.sign(np.sin(40 * time))], axis=1)


LAYOUT = Layout(
    (
        Parameter("offset", "N m", IDENTITY, 0.0, 3.0, ""),
        Parameter("slope", "N m", IDENTITY, 0.0, 3.0, ""),
        Parameter("level", "N m", LOG, 0.0, 1.0, ""),
        Parameter("noise", "N m", LOG, -1.0, 2.0, ""),
    )
)


class Naive(Candidate):
    """A candidate whose fit takes every bin for independent, whatever the noise."""

    def problem(self, *given: Any, **named: Any) -> Problem:
        return replace(super().problem(*given, **named), independent=True)


@dataclass(frozen=True)
class Linear:
    """Picklable, as :class:`scissorcal.calibration.fit_model.Experiment` asks."""

    observed: Array
    naive: bool = False
    what: Literal["friction", "cut"] = "friction"
    layout: Layout = LAYOUT
    nuisance: tuple[str, ...] = ("noise",)
    design: Array = field(default_factory=columns)
    series: NDArray[np.int64] = field(default_factory=lambda: np.zeros(BINS, dtype=np.int64))
    strokes: NDArray[np.int64] = field(default_factory=lambda: np.arange(BINS) * STROKES // BINS)

    def mean(self, u: Array) -> Array:
        return np.asarray(self.design @ np.array([u[0], u[1], np.exp(u[2])]))

    def candidate(self, measured: Array) -> Candidate:
        def residuals(u: Array) -> Array:
            return measured - self.mean(u)

        def normal(u: Array) -> tuple[Array, Array]:
            return residuals(u) / np.exp(u[3]), np.full(BINS, u[3])

        return (Naive if self.naive else Candidate)(
            name="linear",
            key={},
            layout=LAYOUT,
            likelihood=Likelihood(residuals, normal),
            starts=np.array([[0.0, 0.0, 0.0, -1.0]]),
            prior_mean=LAYOUT.mean,
            prior_precision=np.diag(1 / LAYOUT.sd**2),
        )


@dataclass(frozen=True)
class LinearSimulator:
    """Linear data with autoregressive noise that grows with its parameter, fitted as a whole."""

    experiment: Linear
    ar: ArNoise
    reference: float
    noise: str = "AR(1)"

    def simulate(self, truth: Array, rng: np.random.Generator) -> Array:
        if not np.all(np.isfinite(truth)):
            raise ArithmeticError("the truth is not finite")
        grown = float(np.exp(truth[3] - self.reference))
        return self.experiment.mean(truth) + grown * self.ar.draw(self.experiment.series, rng)

    def refit(
        self, data: Array, prior: StatedPrior, effort: Effort, rng: np.random.Generator
    ) -> FitResult:
        experiment = replace(self.experiment, observed=data)
        candidate = experiment.candidate(data)
        candidate = replace(
            candidate,
            prior_mean=prior.layout(LAYOUT).mean,
            prior_precision=prior.precision(LAYOUT, candidate.prior_precision),
        )
        return as_fit(
            experiment, infer(candidate.problem(experiment.series), effort, rng, count=600)
        )


class StandIn(SimpleNamespace):
    """A result with the fields that it is given, and draws by name as a fit has them."""

    columns = FitResult.columns


def as_fit(experiment: Linear, posterior: Posterior) -> FitResult:
    """What the check reads of a fit: draws, parameters, strokes."""
    natural = LAYOUT.columns(posterior.draws)
    fitted = LAYOUT.fitted(posterior.draws)
    held_out = tuple(
        StrokeError(i, "", ("closing", "opening")[i % 2], 0.1 * (1 + i // 2), 0.1, 0.1)
        for i in range(STROKES)
    )
    facts: dict[str, Any] = {
        "what": "friction",
        "words": "friction",
        "effort": "standard",
        "candidate": "linear",
        "structure": {},
        "verdicts": (),
        "parameters": fitted[:3],
        "draws": natural[:, :3],
        "nuisance": fitted[3:],
        "nuisance_draws": natural[:, 3:],
        "held_out": held_out,
        "inputs_hash": "0" * 64,
        "effort_unit": "N m",
        "diagnostics": {
            "effective_samples": posterior.effective,
            "k_hat": posterior.k_hat,
            "effort_reached": posterior.effort_reached,
        },
        "series": SimpleNamespace(
            stroke=experiment.strokes, recording=np.zeros(len(experiment.strokes), dtype=int)
        ),
        "parameter": lambda name: next(p for p in fitted if p.name == name),
        "column": lambda name: natural[:, LAYOUT.names.index(name)],
    }
    return cast(FitResult, StandIn(**facts))
