"""Slopes of the torque over a scene by the parameters of both fits."""

from collections.abc import Mapping
from dataclasses import dataclass
from statistics import NormalDist
from typing import Any

import numpy as np

from scissorcal.aliases import Array
from scissorcal.calibration.design.band import SceneSlopes, TorqueKnowledge
from scissorcal.calibration.design.information import Knowledge
from scissorcal.calibration.design.state import CutState, FrictionState, sharing_of
from scissorcal.calibration.parameters import Layout
from scissorcal.errors import InputError
from scissorcal.package.exact import ExactModel, FitDraws, central_model, exact_model
from scissorcal.package.grid import NOTHING_TOUCHED
from scissorcal.package.scene_torque import felt_places, scene_grid
from scissorcal.recipe.schema import Recipe

LARGEST_STEP = 0.05
"""Step of the difference at most: 5 % of what has a logarithm."""


@dataclass(frozen=True)
class Law:
    """A fit's law at one point ``u`` (p,) of its unconstrained parameters; ``sd`` (p,) is how well
    they are known."""

    structure: Mapping[str, Any]
    layout: Layout
    u: Array
    sd: Array

    @classmethod
    def of(cls, structure: Mapping[str, Any], known: Knowledge) -> "Law":
        """A law where its knowledge stands."""
        sd = np.sqrt(np.maximum(np.diag(known.covariance), 0.0))
        return cls(structure, known.layout, known.point, sd)

    def draws(self, points: Array) -> FitDraws:
        """The law at points (k, p)."""
        return FitDraws(self.structure, self.layout.names, self.layout.columns(points))


def torque_knowledge(recipe: Recipe, friction: FrictionState, cut: CutState) -> TorqueKnowledge:
    """What is known of the scene's torque by two fits, or by priors."""
    laws = (Law.of(one.structure, one.knowledge) for one in (cut, friction))
    sharing = sharing_of(recipe, friction, cut)
    slopes = scene_slopes(recipe, *laws)
    return TorqueKnowledge(friction.knowledge, cut.knowledge, sharing, slopes)


def scene_slopes(recipe: Recipe, cut: Law, friction: Law) -> SceneSlopes:
    """Torque over the scene's grid where it can be felt, with its slopes (differences).

    Differences reach a standard deviation to either side, at most ``LARGEST_STEP`` of the
    coordinate. Where the torque is at the recipe's limit, the limit is rendered and slopes are
    zero. Raises InputError where no place of the scene can be felt.
    """
    rendered = recipe.scene.render_friction
    centre = central_model(cut.draws(cut.u[None]), friction.draws(friction.u[None]))
    if not rendered:
        centre = ExactModel(centre.cutting, None)
    grid = scene_grid(recipe)
    limit = recipe.limits.torque_Nm
    torque = np.clip(np.ravel(centre.torque(*grid)), -limit, limit)
    felt = felt_places(centre, grid, torque)
    if not felt.any():
        raise InputError(NOTHING_TOUCHED)
    places = tuple(array[felt] for array in grid)
    torque = torque[felt]
    free = np.abs(torque) < limit
    by_cut, by_friction = _both(cut, friction, places, rendered=rendered)
    confidence = 0.01 * recipe.scene.confidence_percent
    return SceneSlopes(
        torque,
        by_friction * free[:, None],
        by_cut * free[:, None],
        NormalDist().inv_cdf(0.5 + 0.5 * confidence),
        0.01 * recipe.scene.tolerance_percent,
    )


def _both(
    cut: Law, friction: Law, places: tuple[Array, ...], *, rendered: bool
) -> tuple[Array, Array]:
    """Slopes (n, p) by the parameters of the cut, and of friction where it is rendered."""
    held = np.broadcast_to(friction.u, (2 * len(cut.u), len(friction.u)))
    points, steps = _around(cut)
    model = exact_model(cut.draws(points), friction.draws(held) if rendered else None)
    by_cut = _differences(model.torque(*places), steps)
    if not rendered:
        return by_cut, np.zeros((len(places[0]), len(friction.u)))
    points, steps = _around(friction)
    held = np.broadcast_to(cut.u, (len(points), len(cut.u)))
    model = exact_model(cut.draws(held), friction.draws(points))
    return by_cut, _differences(model.torque(*places), steps)


def _around(law: Law) -> tuple[Array, Array]:
    """Points (2 p, p) above and below in each parameter, and the steps (p,)."""
    steps = np.minimum(law.sd, LARGEST_STEP)
    return np.concatenate([law.u + np.diag(steps), law.u - np.diag(steps)]), steps


def _differences(torque: Array, steps: Array) -> Array:
    above, below = np.split(torque, 2)
    return np.asarray(((above - below) / (2.0 * steps[:, None])).T)
