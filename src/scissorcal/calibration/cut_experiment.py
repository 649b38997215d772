"""The design of a cut's fit: motion, friction, law and priors, over which efforts are measured."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from scissorcal.calibration.cut_data import FrictionPrior, cutting_from, edge_layout
from scissorcal.calibration.cut_expected import Expected, Spread
from scissorcal.calibration.cut_layout import NUISANCE, CutLaw, starts_over
from scissorcal.calibration.cut_likelihood import Blocks, best_rests, make_blocks, normal_terms
from scissorcal.calibration.cut_motion import CutMotion
from scissorcal.calibration.cut_simulation import draw_torque
from scissorcal.calibration.ladder import Likelihood, Rung
from scissorcal.calibration.layout import Layout
from scissorcal.model import Cutting, EdgeBelief, Stance, take_stance

Array = NDArray[np.float64]
Integers = NDArray[np.int64]


@dataclass(frozen=True)
class CutExperiment:
    """One law of a cut over one set of motions (see :class:`~.experiment.Experiment`).

    ``structure`` holds the law's discrete choices and the geometry, ``material`` its parameters
    with those of the noise, ``belief`` what is known of the edge. ``begin`` is where a search
    starts, if that is known.
    """

    motion: CutMotion
    friction: FrictionPrior
    structure: Mapping[str, Any]
    material: Layout
    belief: EdgeBelief
    begin: tuple[float, ...] = ()
    what: Literal["friction", "cut"] = "cut"

    @property
    def observed(self) -> Array:
        """Drive that was measured at each bin (n,)."""
        return self.motion.bins.drive

    @property
    def series(self) -> Integers:
        """Pieces without a gap (n,)."""
        return self.motion.bins.series

    @property
    def strokes(self) -> Integers:
        """Stroke of each bin (n,)."""
        return self.motion.bins.stroke

    @cached_property
    def layout(self) -> Layout:
        """Parameters: the material's and its noise's, the edge's, friction's."""
        edge = edge_layout(self.belief).parameters
        return Layout(self.material.parameters + edge + self.friction.layout.parameters)

    @property
    def nuisance(self) -> tuple[str, ...]:
        """Parameters that are inferred and not reported."""
        return (*NUISANCE, *self.friction.layout.names)

    @property
    def name(self) -> str:
        """The law in words."""
        return CutLaw.of(self.structure).name

    def mean(self, u: Array) -> Array:
        """Drive that is expected (n,) at ``u`` (p,), with cracks resting where they should."""
        return self.empty_drive(u) - self.expected(u).mean

    def simulate(self, u: Array, rng: np.random.Generator) -> Array:
        """Drive (n,) with a ripple, an uneven material and cracks that rest anywhere.

        Drawn from what the likelihood says of them, ``noise`` and ``slow_noise`` excepted.
        """
        return self.empty_drive(u) - draw_torque(self.expected(u), rng)

    def rung(self, measured: Array) -> Rung:
        """Give the law over ``measured`` (n,), ready to be fitted."""
        posed = _Posed(self, np.asarray(measured, dtype=np.float64))
        key = CutLaw.of(self.structure).key
        likelihood = Likelihood(posed.residuals, posed.normal)
        material = len(self.material.names)
        starts = np.array([self.begin])
        if not self.begin:
            base = np.concatenate([self.material.mean, self.belief.mean, self.friction.mean])
            starts = starts_over(self.material, base, posed.misfit, likelihood)
        precision = np.zeros((len(self.layout.names),) * 2)
        after = material + len(self.belief.names)
        precision[:material, :material] = np.diag(1 / self.material.sd**2)
        if self.belief.names:
            precision[material:after, material:after] = np.linalg.inv(self.belief.covariance)
        precision[after:, after:] = self.friction.precision
        return Rung(
            name=self.name,
            key=key,
            layout=self.layout,
            likelihood=likelihood,
            starts=starts,
            prior_mean=np.concatenate([self.material.mean, self.belief.mean, self.friction.mean]),
            prior_precision=precision,
            blocks=self.strokes,
            populations=(self.blocks.place > 0).astype(np.int64),
        )

    def empty_drive(self, u: Array) -> Array:
        """Drive that the motion would ask for in air (n,)."""
        own = u[len(u) - len(self.friction.layout.parameters) :]
        return self.friction.empty_drive(own, self.motion.bins)

    def cutting(self, u: Array) -> Cutting:
        """The law at ``u`` (p,)."""
        return cutting_from(self.structure, self.layout.natural(u))

    def expected(self, u: Array) -> Expected:
        """What the law expects of the material's torque at ``u`` (p,)."""
        values = self.layout.natural(u)

        def value(name: str, default: float) -> float:
            return float(values[name]) if name in values else default

        spread = Spread(
            noise_Nm=value("noise", 0.0),
            slow_noise_Nm=value("slow_noise", 0.0),
            variation=value("variation", 0.0),
            visibility=value("ripple_visibility", 0.0),
            period=value("ripple_period", 1.0),
            rest_phase=value("rest_phase", 0.0),
            rest_spread=value("rest_spread", 0.0),
        )
        stance = None if self.belief.names else self.stance
        return Expected(self.motion, cutting_from(self.structure, values), spread, stance)

    @cached_property
    def stance(self) -> Stance:
        """The edge that is most likely, on the motion's openings."""
        return take_stance(self.belief.edge, self.motion.nodes.turned)

    @cached_property
    def blocks(self) -> Blocks:
        """Blocks of neighbouring bins."""
        return make_blocks(self.motion.runs)


class _Posed:
    """The law against one outcome, remembering the last material it was asked for.

    Differences by friction's parameters leave the material unchanged, and the material is what
    costs time.
    """

    def __init__(self, experiment: CutExperiment, measured: Array) -> None:
        self.experiment, self.measured = experiment, measured
        self._last: tuple[bytes, Expected] | None = None

    def torque(self, u: Array) -> Array:
        """Torque that friction's parameters leave for the material (n,)."""
        return self.experiment.empty_drive(u) - self.measured

    def normal(self, u: Array) -> tuple[Array, Array]:
        return normal_terms(self.torque(u), self._expected(u), self.experiment.blocks)

    def residuals(self, u: Array) -> Array:
        """What is left of the torque, with cracks resting where it says that they did."""
        expected, torque = self._expected(u), self.torque(u)
        if len(expected.resting.place) == 0:
            return torque - expected.mean
        return torque - expected.mean_with(best_rests(torque, expected))

    def misfit(self, u: Array) -> Array:
        """What is left of the torque, with cracks resting where they should."""
        return self.torque(u) - self._expected(u).mean

    def _expected(self, u: Array) -> Expected:
        own = len(u) - len(self.experiment.friction.layout.parameters)
        key = u[:own].tobytes()
        if self._last is None or self._last[0] != key:
            self._last = (key, self.experiment.expected(u))
        return self._last[1]
