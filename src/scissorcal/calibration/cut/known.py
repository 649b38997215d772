"""What a cut's fit takes as given: recipe, geometry, and levels and noise of friction."""

from dataclasses import dataclass, replace

import numpy as np

from scissorcal.aliases import Array
from scissorcal.calibration.cut.geometry import Geometry, geometry_of_prior
from scissorcal.calibration.cut.path_motion import PathMotion
from scissorcal.calibration.cut.path_work import (
    FrictionDraws,
    Material,
    material_of,
    torque_noise_of,
)
from scissorcal.calibration.cut.structure import edge_of
from scissorcal.calibration.friction.layout import friction_and_offset, typical_values
from scissorcal.calibration.parameters import StatedPrior
from scissorcal.calibration.result import FitResult
from scissorcal.calibration.signals.torque_noise import TorqueNoise
from scissorcal.calibration.signals.zeros import DriveZero
from scissorcal.model import EdgeDistribution, FrictionLaw
from scissorcal.recipe.priors import CutPriors
from scissorcal.recipe.schema import Recipe

USUAL_RATE = 0.3
SOME_DRAWS = 48
"""Draws of friction that a cut looks at: they give a segment's sd to a tenth."""
WITHIN_SD = (0.1587, 0.8413)
"""Quantiles one standard deviation from the middle of a normal distribution."""


@dataclass(frozen=True)
class KnownFriction:
    """Friction as fitted to the empty sweeps.

    ``law`` and ``offset`` (N m) are typical of the posterior (`typical_values`). ``closing_sd`` and
    ``opening_sd`` (N m) are how well friction is known in either direction over all strokes,
    ``stroke_sd`` what single strokes differ by. ``cogging`` is (cosine, sine, periods per turn) of
    what the motor adds to the measured drive. ``fine_rad`` is the length over which the part of dry
    friction builds up that the law lets jump, 0 where no probe found it. ``prior`` takes the
    recipe's place where a study of simulated data states one; ``draws`` is what friction may be
    instead, None where it is known but for those sds.
    """

    law: FrictionLaw
    offset: float
    inertia: float
    cogging: tuple[float, float, float]
    noise: TorqueNoise
    closing_sd: float
    opening_sd: float
    stroke_sd: float
    fine_rad: float = 0.0
    prior: StatedPrior | None = None
    draws: FrictionDraws | None = None

    @classmethod
    def of(cls, friction: FitResult, priors: CutPriors | None = None) -> "KnownFriction":
        """Take a finished fit of friction, with the recipe's priors of a cut or their defaults."""
        floor = (priors or CutPriors()).friction_sd_floor_Nm
        centre = float(friction.structure["angle_center"])
        means = typical_values(friction)
        per_turn = float(friction.structure.get("cogging_periods_per_turn", 0.0))
        law = FrictionLaw.of_fit(means, centre)
        # The fit gives what the drive has to give beside friction: the motor's own torque, negated.
        cogging = [-float(means.get(f"cogging_{part}", 0.0)) for part in ("cos", "sin")]
        closing, opening = (
            max(floor, _spread(friction, centre, sign * USUAL_RATE)) for sign in (-1, 1)
        )
        stroke = float(friction.diagnostics.get("stroke_offset_sd_Nm", floor))
        return cls(
            law=law,
            offset=float(means.get("offset", 0.0)),
            inertia=float(means["inertia"]),
            cogging=(cogging[0], cogging[1], per_turn if any(cogging) else 0.0),
            noise=torque_noise_of(friction.diagnostics),
            closing_sd=closing,
            opening_sd=opening,
            stroke_sd=max(floor, stroke),
            fine_rad=float(friction.diagnostics.get("presliding_fine_rad", 0.0)),
            draws=_draws(friction, means, law),
        )

    def with_zero(self, own: DriveZero | None, before: DriveZero | None) -> "KnownFriction":
        """Friction for a cut whose zero was measured apart: errors of both are in its offsets.

        ``before`` is the zero of the empty sweeps; levels and offset of that fit hold together,
        whatever is left of it, but not with another zero.
        """
        if own is None or before is None:
            return self
        rest = float(np.hypot(own.sd, before.sd))
        return replace(
            self,
            closing_sd=float(np.hypot(self.closing_sd, rest)),
            opening_sd=float(np.hypot(self.opening_sd, rest)),
        )

    def material(self, motion: PathMotion) -> Material:
        """Work and torque of the material along a motion, friction and cogging taken off."""
        return material_of(motion, self.law, self.offset, self.cogging, self.fine_rad, self.draws)


def _draws(friction: FitResult, taken: dict[str, Array], law: FrictionLaw) -> FrictionDraws:
    """Some draws of a posterior beside the values that were taken, evenly out of all."""
    picked = np.unique(np.linspace(0, len(friction.draws) - 1, SOME_DRAWS).astype(int))
    values = {p.name: friction.column(p.name)[picked, None] for p in friction.parameters}
    known = {name: law.values[name] for name in law.values if name not in values}
    centre = law.angle_center
    closing, opening = (
        friction_and_offset(values, centre, sign * USUAL_RATE)
        - friction_and_offset(taken, centre, sign * USUAL_RATE)
        for sign in (-1, 1)
    )
    offset = values.get("offset", np.zeros((len(picked), 1)))
    return FrictionDraws(FrictionLaw.of_fit(known | values, centre), offset, closing, opening)


def _spread(friction: FitResult, centre: float, rate: float) -> float:
    """Standard deviation of friction and offset together at one rate, over the posterior's core."""
    draws = {p.name: friction.column(p.name) for p in friction.parameters}
    low, high = np.quantile(friction_and_offset(draws, centre, rate), WITHIN_SD)
    return float(0.5 * (high - low))


@dataclass(frozen=True)
class CutBasis:
    """What a fit of cuts takes as given: recipe, geometry with the edge, and friction."""

    recipe: Recipe
    geometry: Geometry
    friction: KnownFriction

    @classmethod
    def of(
        cls, recipe: Recipe, friction: KnownFriction, edge: EdgeDistribution | None = None
    ) -> "CutBasis":
        """That of a recipe; ``edge`` takes the place of the edge that it states."""
        return cls(recipe, geometry_of_prior(recipe, edge or edge_of(recipe)), friction)

    def data(self, motions: tuple[PathMotion, ...]) -> "MaterialData":
        """What the material did along motions, friction taken off."""
        materials = tuple(self.friction.material(motion) for motion in motions)
        return MaterialData(motions, materials, self.friction.noise, self.friction.stroke_sd)


@dataclass(frozen=True)
class MaterialData:
    """What the material did along motions, with the noise by sample and from stroke to stroke."""

    motions: tuple[PathMotion, ...]
    materials: tuple[Material, ...]
    noise: TorqueNoise
    offset_sd: float
