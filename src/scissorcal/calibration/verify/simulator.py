"""Simulators: raw recordings of known parameters, and the whole fit of them."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, Protocol

import numpy as np

from scissorcal.aliases import Array
from scissorcal.calibration.comparison import names_of_contenders
from scissorcal.calibration.cut.fit import fit_cut
from scissorcal.calibration.cut.known import KnownFriction
from scissorcal.calibration.cut.own_law import as_law_fit
from scissorcal.calibration.cut.path_work import torque_noise_of
from scissorcal.calibration.fit_model import CutRun, FrictionRun
from scissorcal.calibration.friction.fit import fit_friction
from scissorcal.calibration.parameters import Layout, StatedPrior
from scissorcal.calibration.result import Effort, FitResult
from scissorcal.calibration.signals.torque_noise import TorqueNoise
from scissorcal.calibration.verify.simulated_motion import Motion, motion_of
from scissorcal.calibration.verify.simulated_recordings import (
    cut_truth,
    friction_truth,
    simulate_cut,
    simulate_friction,
)
from scissorcal.model import EdgeDistribution
from scissorcal.recipe.priors import CutPriors
from scissorcal.recipe.schema import FitFriction, Recipe
from scissorcal.recording.recording import Recording

UNSEEN = 0.1
"""Part of the torque's noise that accelerations may be which no encoder shows, in a simulated
sweep: all simulations repeat it."""


class Simulator(Protocol):
    """Data of known parameters, and the whole fit of them. Picklable, for worker processes.

    ``noise`` describes the noise that is added to the samples. ``simulate`` takes unconstrained
    parameters (p,) of the fit's own layout; ``refit`` fits its result, with the distribution
    of truths as prior.
    """

    @property
    def noise(self) -> str: ...

    def simulate(self, truth: Array, rng: np.random.Generator) -> Any: ...

    def refit(
        self, data: Any, prior: StatedPrior, effort: Effort, rng: np.random.Generator
    ) -> FitResult: ...


@dataclass(frozen=True)
class FrictionSimulator:
    """Empty sweeps of a rig with other friction (see :class:`Simulator`).

    ``contenders`` are the laws that a refit compares.
    """

    motions: tuple[Motion, ...]
    settings: FitFriction
    layout: Layout
    structure: Mapping[str, Any]
    candidate: str
    torque_noise: TorqueNoise
    stroke_sd: float
    contenders: tuple[str, ...]

    @property
    def noise(self) -> str:
        """Description of the noise of the samples."""
        return _noise_in_words(self.torque_noise, self.stroke_sd, self._unit)

    def simulate(self, truth: Array, rng: np.random.Generator) -> tuple[Recording, ...]:
        """Recordings of the same motion with the truth's friction."""
        return self.recordings_of(_plain(self.layout, truth), rng)

    def recordings_of(
        self, values: Mapping[str, float], rng: np.random.Generator
    ) -> tuple[Recording, ...]:
        """The same for a truth by the names of its parameters, in their units."""
        rig = friction_truth(values, self.structure, self.torque_noise, self.stroke_sd)
        return simulate_friction(self.motions, rig, rng)

    def refit(
        self,
        data: tuple[Recording, ...],
        prior: StatedPrior,
        effort: Effort,
        rng: np.random.Generator,
    ) -> FitResult:
        """The fit: sensors, windows, cogging, comparison of the contenders, posterior."""
        return fit_friction(
            data,
            self.settings,
            effort=effort,
            rng=rng,
            run=FrictionRun(last_chosen=self.candidate, prior=replace(prior, laws=self.contenders)),
        )

    @property
    def _unit(self) -> str:
        return self.motions[0].recording.joint.effort_unit


@dataclass(frozen=True)
class CutSimulator:
    """Cuts through other material along the same motion (see :class:`Simulator`).

    ``contenders`` are the laws that a refit compares.
    """

    motions: tuple[Motion, ...]
    recipe: Recipe
    friction: FitResult
    edge: EdgeDistribution | None
    layout: Layout
    structure: Mapping[str, Any]
    candidate: str
    contenders: tuple[str, ...]

    @property
    def noise(self) -> str:
        """Description of the noise of the samples."""
        known = KnownFriction.of(self.friction, self.recipe.fit.cut.priors)
        return _noise_in_words(known.noise, known.stroke_sd, "N m")

    def simulate(self, truth: Array, rng: np.random.Generator) -> tuple[Recording, ...]:
        """Recordings of the same motion through sheets of the truth's material."""
        return self.recordings_of(_plain(self.layout, truth), rng)

    def recordings_of(
        self, values: Mapping[str, float], rng: np.random.Generator
    ) -> tuple[Recording, ...]:
        """The same for a truth by the names of its parameters, in their units."""
        tick_s = self.motions[0].pieces[0].tick_s
        known = KnownFriction.of(self.friction, self.recipe.fit.cut.priors)
        return simulate_cut(self.motions, cut_truth(values, self.structure, known, tick_s), rng)

    def refit(
        self,
        data: tuple[Recording, ...],
        prior: StatedPrior,
        effort: Effort,
        rng: np.random.Generator,
    ) -> FitResult:
        """The fit: sensors, segments, teeth, comparison of the contenders, posterior.

        A power law's segments are begun at the mean of the truths, not at a first guess.
        """
        law = self.structure.get("response_law")
        fit = fit_cut(
            data,
            self.recipe,
            self.friction,
            effort=effort,
            rng=rng,
            run=CutRun(
                edge=self.edge,
                last_chosen=self.candidate,
                prior=replace(prior, laws=self.contenders),
                own_law=law,
            ),
        )
        return fit if law is None else as_law_fit(fit, law)


def friction_simulator(
    recordings: tuple[Recording, ...], settings: FitFriction, fit: FitResult, layout: Layout
) -> FrictionSimulator:
    """A simulator for a finished friction fit over its own recordings.

    ``layout`` is that of its design; noise and the offsets of strokes are those that it measured.
    """
    noise = torque_noise_of(fit.diagnostics)
    return FrictionSimulator(
        motions=motion_of(recordings, fit.parameter("inertia").mean, UNSEEN * noise.white_Nm),
        settings=settings.model_copy(update={"critic": False}),
        layout=layout,
        structure=dict(fit.structure),
        candidate=fit.candidate,
        torque_noise=noise,
        stroke_sd=_finite(fit.diagnostics.get("stroke_offset_sd_Nm", 0.0)),
        contenders=names_of_contenders(fit.candidates),
    )


def cut_simulator(
    recordings: tuple[Recording, ...],
    recipe: Recipe,
    friction: FitResult,
    fit: FitResult,
    layout: Layout,
    edge: EdgeDistribution | None = None,
) -> CutSimulator:
    """A simulator for a finished fit of cuts or presses over its own recordings.

    ``layout`` is that of its design, all else what the fit was made of.
    """
    cut = recipe.fit.cut.model_copy(update={"critic": False})
    quiet = recipe.model_copy(update={"fit": recipe.fit.model_copy(update={"cut": cut})})
    known = KnownFriction.of(friction)
    # Accelerations cancel in means over a way, so that they may be as large as the noise.
    motions = motion_of(recordings, known.inertia, known.noise.white_Nm)
    # Truths are of the fit's law: an average with its twin would have another prior than they.
    own = bool(fit.structure.get("load_share", False))
    near = names_of_contenders(
        [row for row in fit.candidates if bool(row["key"].get("load_share", False)) == own]
    )
    return CutSimulator(
        motions, quiet, friction, edge, layout, dict(fit.structure), fit.candidate, near
    )


def _noise_in_words(noise: TorqueNoise, stroke_sd: float, unit: str) -> str:
    """Describe the noise of simulated samples, for people.

    >>> _noise_in_words(TorqueNoise(1e-3, 5e-4, 0.02), 1e-4, "N m")
    'white 0.001, over 20 ms 0.0005, by stroke 0.0001 N m'
    """
    lasting = f"over {noise.slow_time_s * 1e3:.3g} ms {noise.slow_Nm:.3g}"
    return f"white {noise.white_Nm:.3g}, {lasting}, by stroke {stroke_sd:.3g} {unit}"


def _plain(layout: Layout, u: Array) -> dict[str, float]:
    return {name: float(value) for name, value in layout.natural(u).items()}


def _finite(value: Any) -> float:
    return float(value) if np.isfinite(value) else CutPriors().friction_sd_floor_Nm
