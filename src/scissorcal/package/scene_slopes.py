"""Slopes of the torque over a scene by the parameters of both fits."""

from statistics import NormalDist

import numpy as np

from scissorcal.aliases import Array
from scissorcal.calibration.design.band import SceneSlopes, TorqueKnowledge
from scissorcal.calibration.design.information import Knowledge
from scissorcal.calibration.design.state import CutState, FrictionState, sharing_of
from scissorcal.errors import InputError
from scissorcal.package.exact import ExactModel, FitDraws, central_model, exact_model
from scissorcal.package.grid import NOTHING_TOUCHED
from scissorcal.package.scene_torque import felt_places, scene_grid
from scissorcal.recipe.schema import Recipe

LARGEST_STEP = 0.05
"""Step of the difference at most: 5 % of what has a logarithm."""


def torque_knowledge(recipe: Recipe, friction: FrictionState, cut: CutState) -> TorqueKnowledge:
    """What is known of the scene's torque by two fits, or by priors."""
    sharing = sharing_of(recipe, friction, cut)
    slopes = _scene_slopes(recipe, cut, friction)
    return TorqueKnowledge(friction.knowledge, cut.knowledge, sharing, slopes)


def _scene_slopes(recipe: Recipe, cut: CutState, friction: FrictionState) -> SceneSlopes:
    """Torque over the scene's grid where it can be felt, with its slopes (differences).

    Differences reach a standard deviation to either side, at most ``LARGEST_STEP`` of the
    coordinate. Where the torque is at the recipe's limit, the limit is rendered and slopes are
    zero. Raises InputError where no place of the scene can be felt.
    """
    rendered = recipe.scene.render_friction
    centre = central_model(
        *(_draws(known, known.knowledge.point[None]) for known in (cut, friction))
    )
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
    cut: CutState, friction: FrictionState, places: tuple[Array, ...], *, rendered: bool
) -> tuple[Array, Array]:
    """Slopes (n, p) by the parameters of the cut, and of friction where it is rendered."""
    centres = cut.knowledge.point, friction.knowledge.point
    points, steps = _around(cut.knowledge)
    held = np.broadcast_to(centres[1], (len(points), len(centres[1])))
    model = exact_model(_draws(cut, points), _draws(friction, held) if rendered else None)
    by_cut = _differences(model.torque(*places), steps)
    if not rendered:
        return by_cut, np.zeros((len(places[0]), len(centres[1])))
    points, steps = _around(friction.knowledge)
    held = np.broadcast_to(centres[0], (len(points), len(centres[0])))
    model = exact_model(_draws(cut, held), _draws(friction, points))
    return by_cut, _differences(model.torque(*places), steps)


def _draws(known: CutState | FrictionState, points: Array) -> FitDraws:
    """The law at points (k, p) of its unconstrained parameters."""
    layout = known.knowledge.layout
    return FitDraws(known.structure, layout.names, layout.columns(points))


def _around(knowledge: Knowledge) -> tuple[Array, Array]:
    """Points (2 p, p) above and below in each parameter, and the steps (p,)."""
    sd = np.sqrt(np.maximum(np.diag(knowledge.covariance), 0.0))
    steps = np.minimum(sd, LARGEST_STEP)
    point = knowledge.point
    return np.concatenate([point + np.diag(steps), point - np.diag(steps)]), steps


def _differences(torque: Array, steps: Array) -> Array:
    above, below = np.split(torque, 2)
    return np.asarray(((above - below) / (2.0 * steps[:, None])).T)
