"""The blade's edge as a recipe states it, and the model's curve that follows from it."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING, Annotated, Any, Literal, cast

from pydantic import ConfigDict, Field, GetCoreSchemaHandler, Strict, model_validator
from pydantic_core import CoreSchema, core_schema

from scissorcal.recipe.priors import Length_mm, Section

if TYPE_CHECKING:
    from scissorcal.model.edge import Edge as Curve

Offset_mm = Annotated[float, Field(ge=-1000, le=1000, allow_inf_nan=False)]
Point_mm = Annotated[tuple[Offset_mm, Offset_mm], Strict(False)]
Points_mm = Annotated[tuple[Point_mm, ...], Strict(False)]

_STRAIGHT = ("offset_mm", "taper_deg", "length_mm")
NEEDED: dict[str, tuple[str, ...]] = {
    "line": _STRAIGHT,
    "arc": _STRAIGHT,
    "points": ("points_mm",),
}
"""Keys that give the shape of each family; an arc has ``curvature_per_m`` beside."""


class Edge(Section):
    """The cutting edge e(s) of one blade in its own frame, until photographs give it.

    ``line``: e = offset + s tan(taper). ``arc``: the same plus curvature s^2 / 2. ``points``: a
    smooth curve through ``points_mm``, pairs of station s and offset e from the pivot (the first
    station is 0 or less) to the tip, whose station is the blade's length. ``offset_sd_mm`` and
    ``taper_sd_deg`` say how well both are known; 0 holds them as they are. With ``source =
    "photographs"`` the fit of the blade takes their place, and these only plan the captures.
    """

    model_config = ConfigDict(
        json_schema_extra={
            "if": {"properties": {"family": {"const": "points"}}, "required": ["family"]},
            "then": {"required": list(NEEDED["points"])},
            "else": {"required": list(NEEDED["line"])},
        }
    )

    source: Literal["recipe", "photographs"] = "recipe"
    family: Literal["line", "arc", "points"] = "line"
    offset_mm: Offset_mm | None = None
    taper_deg: Annotated[float, Field(gt=-90, lt=90, allow_inf_nan=False)] | None = None
    curvature_per_m: Offset_mm = 0.0
    length_mm: Length_mm | None = None
    points_mm: Points_mm | None = None
    offset_sd_mm: Annotated[float, Field(ge=0, le=100, allow_inf_nan=False)] = 0.0
    taper_sd_deg: Annotated[float, Field(ge=0, le=45, allow_inf_nan=False)] = 0.0

    @model_validator(mode="after")
    def _family_has_its_keys(self) -> Edge:
        needed = NEEDED[self.family]
        stated = [key for key in (*_STRAIGHT, "points_mm") if getattr(self, key) is not None]
        if self.curvature_per_m != 0.0 and self.family != "arc":
            if self.family == "line":
                raise ValueError('curvature_per_m needs family = "arc"')
            stated.append("curvature_per_m")
        for key in stated:
            if key not in needed and self.family == "points":
                raise ValueError(f'{key} does not go with family = "points": leave {key} out')
            if key not in needed:
                raise ValueError(f'{key} needs family = "points"')
        missing = [key for key in needed if key not in stated]
        if missing:
            verb, them = ("is", missing[0]) if len(missing) == 1 else ("are", "them")
            raise ValueError(f"{_listed(missing)} {verb} missing: add {them} in [rig.edge]")
        return self

    @model_validator(mode="after")
    def _points_make_an_edge(self) -> Edge:
        if self.points_mm is not None:
            try:
                stated_curve(self)
            except ValueError as error:
                raise ValueError(f"points_mm cannot be an edge: {error}") from error
        return self

    @classmethod
    def __get_pydantic_core_schema__(cls, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        """Keys of other families are left out where a recipe is written.

        So digests of recipes are what they were before there were points.
        """
        written = core_schema.wrap_serializer_function_ser_schema(
            lambda edge, inner: {k: v for k, v in inner(edge).items() if v is not None}
        )
        return cast(CoreSchema, {**handler(source), "serialization": written})

    @property
    def length_m(self) -> float:
        """The blade's length: the station of its tip, in metres."""
        return 1e-3 * (self.length_mm if self.points_mm is None else self.points_mm[-1][0])  # type: ignore[operator]


@dataclass(frozen=True)
class StatedCurve:
    """A recipe's edge as the model has it, and how far it leaves the stated points (m)."""

    edge: Curve
    misfit_m: float = 0.0

    @property
    def pieces(self) -> int:
        """Cubics of the curve through points; 1 for a line or an arc."""
        return max(1, len(self.edge.spline_m) - 3)


def stated_curve(edge: Edge) -> StatedCurve:
    """The model's edge that a recipe states; every other room takes it from here.

    Points become one spline (:func:`scissorcal.model.edge_points.edge_through`). Raises
    ValueError, a sentence, for points that are none; a recipe that was read has none of these.

    >>> from scissorcal.recipe.load import builtin_recipe
    >>> curve = stated_curve(builtin_recipe("paper-80gsm").rig.edge).edge
    >>> curve.family, curve.offset_m, curve.length_m
    ('line', -0.008, 0.075)
    """
    if edge.family == "points":
        return _through(edge.points_mm or ())
    from scissorcal.model.edge import Edge as Curve

    return StatedCurve(
        Curve(
            edge.family,
            offset_m=1e-3 * (edge.offset_mm or 0.0),
            taper_rad=math.radians(edge.taper_deg or 0.0),
            length_m=edge.length_m,
            curvature_per_m=edge.curvature_per_m,
        )
    )


@lru_cache(maxsize=64)
def _through(points_mm: tuple[tuple[float, float], ...]) -> StatedCurve:
    """Cached, as every step of a day asks for it."""
    import numpy as np

    from scissorcal.model.edge_points import edge_through

    return StatedCurve(*edge_through(1e-3 * np.array(points_mm, dtype=np.float64)))


def edge_sentence(edge: Edge, joint: str) -> str:
    """What a stated edge's points make of the blade; "" where it is a line or an arc."""
    if edge.points_mm is None or joint == "linear":
        return ""
    curve = stated_curve(edge)
    those = "one cubic" if curve.pieces == 1 else f"a smooth curve of {curve.pieces} cubics"
    use = (
        "Photographs take its place; it only plans the captures."
        if edge.source == "photographs"
        else "It is taken from the recipe, not measured."
    )
    return (
        f"The edge follows {len(edge.points_mm)} points of the recipe, from "
        f"{edge.points_mm[0][0]:g} to {edge.points_mm[-1][0]:g} mm: {those} that leaves them by "
        f"at most {max(1e6 * curve.misfit_m, 0.1):.2g} um. {use}"
    )


def _listed(keys: list[str]) -> str:
    return " and ".join([", ".join(keys[:-1]), keys[-1]] if len(keys) > 1 else keys)
