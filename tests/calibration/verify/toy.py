"""A linear law over made-up motion: an experiment whose posterior is known."""

from dataclasses import dataclass, field, replace
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from scissorcal.calibration.ladder import Likelihood, Rung
from scissorcal.calibration.layout import Layout, Parameter
from scissorcal.inference import Problem

Array = NDArray[np.float64]

BINS = 600
STROKES = 12


def columns() -> Array:
    time = np.linspace(0, 1, BINS)
    return np.stack([np.ones(BINS), np.sin(40 * time), np.sign(np.sin(40 * time))], axis=1)


LAYOUT = Layout(
    (
        Parameter("offset", "N m", "identity", 0.0, 3.0, ""),
        Parameter("slope", "N m", "identity", 0.0, 3.0, ""),
        Parameter("level", "N m", "log", 0.0, 1.0, ""),
        Parameter("noise", "N m", "log", -1.0, 2.0, ""),
    )
)


class Naive(Rung):
    """A rung whose fit takes every bin for independent, whatever the noise."""

    def problem(self, *given: Any, **named: Any) -> Problem:
        return replace(super().problem(*given, **named), independent=True)


@dataclass(frozen=True)
class Linear:
    """Picklable, as :class:`scissorcal.calibration.experiment.Experiment` asks."""

    observed: Array
    naive: bool = False
    ripple: float = 0.0
    what: Literal["friction", "cut"] = "friction"
    layout: Layout = LAYOUT
    nuisance: tuple[str, ...] = ("noise",)
    design: Array = field(default_factory=columns)
    series: NDArray[np.int64] = field(default_factory=lambda: np.zeros(BINS, dtype=np.int64))
    strokes: NDArray[np.int64] = field(default_factory=lambda: np.arange(BINS) * STROKES // BINS)

    def mean(self, u: Array) -> Array:
        return np.asarray(self.design @ np.array([u[0], u[1], np.exp(u[2])]))

    def simulate(self, u: Array, rng: np.random.Generator) -> Array:
        irregular = np.arange(BINS) < BINS // 2
        return self.mean(u) + self.ripple * irregular * rng.uniform(-1, 1, BINS)

    def rung(self, measured: Array) -> Rung:
        def residuals(u: Array) -> Array:
            return measured - self.mean(u)

        def normal(u: Array) -> tuple[Array, Array]:
            return residuals(u) / np.exp(u[3]), np.full(BINS, u[3])

        return (Naive if self.naive else Rung)(
            name="linear",
            key={},
            layout=LAYOUT,
            likelihood=Likelihood(residuals, normal),
            starts=np.array([[0.0, 0.0, 0.0, -1.0]]),
            prior_mean=LAYOUT.mean,
            prior_precision=np.diag(1 / LAYOUT.sd**2),
        )
