"""How deep and how hard a scene presses, beside what the data of its fit reach: for any law.

What is rendered beyond the data is the fitted law continued. The posterior's band takes that law
for right there, so it cannot show how far off it may be.
"""

import numpy as np
from numpy.typing import NDArray

from scissorcal.aliases import Array
from scissorcal.calibration.result import FitResult
from scissorcal.model import edge_height
from scissorcal.model.cutting import torque_at, within_thickness
from scissorcal.package.exact import ExactModel, FitDraws, central_model
from scissorcal.package.grid import Points
from scissorcal.package.layer_pieces import hardest_layer
from scissorcal.package.manifest import DataReach
from scissorcal.recipe.schema import Recipe

OPENINGS, CONTACTS = 61, 31


def data_reach(recipe: Recipe, cut: FitResult) -> DataReach | None:
    """Depths and forces at the edge of data and scene; None where no sample presses on anything.

    The scene's are within the torque limit, and of the toughest and thickest layer of a drawn
    plate. A sheet that is only pressed counts up to its thickness.
    """
    known = _data_depth(central_model(FitDraws.centre(cut), None), cut)
    if known is None:
        return None
    model, depth, crossed, through = _of_scene(recipe, cut)
    response = model.cutting.response
    return DataReach(
        data_depth_m=known,
        data_force_N=float(response.force_at(known)),
        scene_depth_m=depth,
        scene_force_N=float(response.force_at(depth)),
        crossed_share=crossed,
        through_share=through,
        tolerance=0.01 * recipe.scene.tolerance_percent,
    )


def scene_depth(recipe: Recipe, cut: FitResult) -> float:
    """How deep (m) a scene presses within its torque limit, by the central law of a fit."""
    return _of_scene(recipe, cut)[1]


def reach_sentences(reach: DataReach | None, law: str) -> tuple[str, ...]:
    """What a person has to know of them: what is extrapolated, and where edges cross.

    The data end where the scene's largest force is more than the tolerance above theirs.
    """
    if reach is None:
        return ()
    said = []
    if reach.scene_force_N > (1.0 + reach.tolerance) * reach.data_force_N:
        said.append(
            f"The scene presses down to {_mm(reach.scene_depth_m)} mm, {reach.scene_force_N:.2g} N "
            f"at the edge, and the data reach {_mm(reach.data_depth_m)} mm, "
            f"{reach.data_force_N:.2g} N: what is rendered beyond is the {law} law continued, and "
            "the band takes that law for right there. Press as deep as the scene does, or narrow "
            "scene.opening_deg and scene.contact_mm."
        )
    if reach.through_share > 0.0:
        said.append(
            f"At {reach.through_share:.0%} of the places where the scene presses, the blades would "
            "sink in by more than the material's thickness, and nothing is cut: no average over "
            "the scene counts them. Narrow scene.opening_deg and scene.contact_mm."
        )
    elif reach.crossed_share > 0.0:
        said.append(
            f"At {reach.crossed_share:.0%} of the places where the scene presses, the blades' "
            "edges have crossed, which would cut the material, and the scene cuts nothing. Narrow "
            "scene.opening_deg and scene.contact_mm."
        )
    return tuple(said)


def _of_scene(recipe: Recipe, cut: FitResult) -> tuple[ExactModel, float, float, float]:
    """The law of the hardest layer, and what :func:`_scene_depth` says of it."""
    model = central_model(FitDraws.centre(cut), None)
    opening, contact = np.meshgrid(
        np.linspace(*recipe.scene.opening_rad, OPENINGS),
        np.linspace(*recipe.scene.contact_m, CONTACTS),
    )
    places = Points(opening.ravel(), np.zeros(opening.size), contact.ravel())
    limit = recipe.limits.torque_Nm
    if recipe.plate.layers:
        model, limit = hardest_layer(model, recipe)
    return model, *_scene_depth(model, places, limit)


def _data_depth(model: ExactModel, cut: FitResult) -> float | None:
    series = cut.series
    met = np.isfinite(series.contact)
    if not met.any():
        return None
    # of the encoder's places, not of a torque: the deepest sample is no outlier of noise
    deepest = float(np.max(_depth(model, series.opening[met], series.contact[met])[0]))
    return deepest if deepest > 0.0 else None


def _scene_depth(model: ExactModel, places: Points, limit: float) -> tuple[float, float, float]:
    """The largest depth within the limit, and shares of pressed places where edges have crossed
    and where it is beyond the thickness, which are 0 where something is cut."""
    cutting, opening = model.cutting, places.opening
    depth, place, reached = _depth(model, opening, places.contact)
    pressed = reached & (depth > 0.0)
    if not pressed.any():
        return 0.0, 0.0, 0.0
    within = pressed & within_thickness(cutting, depth)
    torque = torque_at(cutting, opening, place)
    force = cutting.response.force_at(depth)
    held = np.where(torque > limit, force * limit / np.where(torque > 0.0, torque, 1.0), force)
    most = float(np.max(held[within], initial=0.0))
    deepest = min(
        float(np.max(depth[within], initial=0.0)), float(cutting.response.indentation_at(most))
    )
    if cutting.fracture_energy is not None:
        return deepest, 0.0, 0.0
    crossed = depth[pressed] > cutting.upper_face_m
    return deepest, float(np.mean(crossed)), 1.0 - float(np.mean(within[pressed]))


def _depth(
    model: ExactModel, opening: Array, contact: Array
) -> tuple[Array, Array, NDArray[np.bool_]]:
    """Indentation, place of the crack, and whether the blade reaches it, at places (n,)."""
    place = np.ravel(model.settled(opening, contact))
    view = edge_height(model.cutting.edge, place, model.blade_angle(opening))
    reached = np.asarray(view.station < model.cutting.edge.length_m)
    return np.asarray(model.cutting.upper_face_m - view.height), place, reached


def _mm(metres: float) -> str:
    return f"{1e3 * metres:.2g}"
