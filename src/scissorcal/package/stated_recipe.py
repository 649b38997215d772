"""The recipe that a package carries as text: parsed by its schema, and held to the manifest.

What decides how a package is rendered stands in it twice: in the recipe (scene, limits, rig, hand
damping) and in the manifest's own values, which were compiled from it. A loop takes both, so both
must agree.
"""

import math
from collections.abc import Iterator, Mapping
from typing import Any

from pydantic import BaseModel, ValidationError

from scissorcal.errors import InputError
from scissorcal.identity import bytes_digest
from scissorcal.package.bound import SHARE_OF_TOLERANCE
from scissorcal.package.compile import scene_mechanics, scene_ranges
from scissorcal.package.exact import ExactModel
from scissorcal.package.manifest import Limits, Manifest, Provenance, units_of
from scissorcal.recipe.schema import Recipe

ROUNDING = 1e-9
"""Relative difference of equal values that two computers converted to SI units."""


def stated_recipe(provenance: Provenance) -> Recipe:
    """The recipe in a manifest; InputError where its text has another hash, or is no recipe.

    The sentence is the rest of one that begins with the file.
    """
    text = provenance.recipe.encode("utf-8")
    if bytes_digest(text) != provenance.recipe_sha256:
        raise InputError("provenance.recipe does not have the hash in provenance.recipe_sha256")
    try:
        return Recipe.model_validate_json(text)
    except ValidationError as error:
        raise InputError(
            f"provenance.recipe is not a recipe of this version ({_first(error)}; the package was "
            f"built by version {provenance.scissorcal_version})"
        ) from None


def refuse_contradictions(manifest: Manifest, recipe: Recipe, model: ExactModel) -> None:
    """Raise InputError where a value of the manifest is not that of its recipe and parameters.

    ``model`` is the exact model of the manifest's parameters.
    """
    try:
        for place, stated, compiled in _pairs(manifest, recipe, model):
            for key, found, wanted in _differences(place, stated, compiled):
                raise InputError(
                    f"{key} is {found!r}, and the recipe and parameters in the package give "
                    f"{wanted!r}"
                )
    except ValidationError as error:
        raise InputError(f"its recipe and parameters give no package ({_first(error)})") from None


def _pairs(manifest: Manifest, recipe: Recipe, model: ExactModel) -> Iterator[tuple[str, Any, Any]]:
    """Place in the manifest, what stands there, and what recipe and parameters give."""
    scene, share = recipe.scene, recipe.scene.tolerance_percent / 100.0
    yield "name", manifest.name, recipe.name
    yield "units", manifest.units, units_of(manifest.mechanics)
    yield "ranges", manifest.ranges, scene_ranges(recipe)
    yield "limits", manifest.limits, {key: getattr(recipe.limits, key) for key in _LIMITS}
    yield "mechanics", manifest.mechanics, scene_mechanics(model, recipe)
    yield "mechanics.moving_blades", manifest.mechanics.moving_blades, recipe.rig.moving_blades
    yield "mechanics.upper_face_m", manifest.mechanics.upper_face_m, recipe.upper_face_m
    if not scene.cut:
        yield "mechanics.fracture", manifest.mechanics.fracture, None
    if not scene.render_friction:
        yield "mechanics.friction", manifest.mechanics.friction, None
    yield "plate_pose", manifest.plate_pose, scene.plate_pose
    yield "bound.allowed_share", manifest.bound.allowed_share, SHARE_OF_TOLERANCE * share
    friction = manifest.mechanics.friction
    slowest = friction.rate_eps_rad_per_s if friction else 0.0
    yield "bound.from_rate_rad_per_s", manifest.bound.from_rate_rad_per_s, slowest
    if manifest.pieces is not None:
        yield "pieces", "of a drawn plate", "of a drawn plate" if recipe.plate.layers else None
    if manifest.reach is not None:
        yield "reach.tolerance", manifest.reach.tolerance, share
    if manifest.simplification is not None:
        stated = manifest.simplification
        yield "simplification.asked", stated.asked, scene.simplify
        yield "simplification.tolerance", stated.tolerance, share
        yield "simplification.confidence", stated.confidence, scene.confidence_percent / 100.0


_LIMITS = tuple(Limits.model_fields)


def _differences(place: str, stated: Any, compiled: Any) -> Iterator[tuple[str, Any, Any]]:
    """Each value of two trees that differs by more than its rounding: key, stated, compiled."""
    one, other = _plain(stated), _plain(compiled)
    if isinstance(one, Mapping) and isinstance(other, Mapping):
        for key in {**one, **other}:
            yield from _differences(f"{place}.{key}", one.get(key), other.get(key))
    elif isinstance(one, float | int) and isinstance(other, float | int):
        if not math.isclose(one, other, rel_tol=ROUNDING):
            yield place, stated, compiled
    elif isinstance(one, tuple | list) and isinstance(other, tuple | list):
        if len(one) != len(other):
            yield place, stated, compiled
        else:
            for index, (left, right) in enumerate(zip(one, other, strict=True)):
                yield from _differences(f"{place}.{index}", left, right)
    elif one != other:
        yield place, stated, compiled


def _first(error: ValidationError) -> str:
    first = error.errors()[0]
    place = ".".join(str(part) for part in first["loc"]) or "the whole"
    return f"{place}: {first['msg']}"


def _plain(value: Any) -> Any:
    return value.model_dump() if isinstance(value, BaseModel) else value
