"""Laws and shapes refuse unknown names and impossible numbers, once, where they are made."""

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from scissorcal.errors import InputError, ModelError
from scissorcal.model import Cutting, Edge, EdgeDistribution, FrictionLaw, Response
from scissorcal.model.blade_point import BladePoint
from scissorcal.model.friction import AxisLaw
from scissorcal.model.surface import Cylinder, HeightField, Sphere

RESPONSE = Response("power", 2.0, 1.5, 3e-4)
SPLINE = Response("spline", 2.0, 1.5, 3e-4, (0.1,), (1e-4, 3e-4, 1e-3))
EDGE = Edge("line", -0.008, 0.03, 0.07)
CURVE = Edge("spline", -0.008, 0.03, 0.07, spline_m=(0.0,) * 5)
CUTTING = Cutting(EDGE, RESPONSE, 2, 5e-5, 0.5, 0.7)
LAW = FrictionLaw({"coulomb_pos": 0.01, "coulomb_neg": 0.012, "presliding_share": 0.9})
FIELD = HeightField((0.0, 0.1), (0.0, 0.1), np.zeros((5, 4)))

NAMES = [
    (RESPONSE, "family", "powr", "power"),
    (RESPONSE, "family", "Exponential", "exponential"),
    (EDGE, "family", "Arc", "arc"),
    (EDGE, "family", "splines", "spline"),
    (CUTTING, "closure", "eq5", "eq4"),
    (CUTTING, "closure", "worke", "work"),
    (LAW, "values", {"colomb_pos": 0.01}, "coulomb_pos"),
    (LAW, "values", {"viscos": 0.01}, "viscous"),
    (EdgeDistribution(EDGE, ("offset_m",), np.eye(1)), "names", ("offset",), "offset_m"),
]


@pytest.mark.parametrize(("made", "field", "value", "meant"), NAMES)
def test_an_unknown_name_is_refused_with_the_nearest(
    made: Any, field: str, value: Any, meant: str
) -> None:
    with pytest.raises(ModelError, match=f'Did you mean "{meant}"') as caught:
        replace(made, **{field: value})
    assert str(caught.value).endswith((".", "?"))
    assert isinstance(caught.value, InputError)
    assert isinstance(caught.value, ValueError)


NEVER = (math.nan, math.inf, -math.inf)
WRONG: list[tuple[Any, str, tuple[Any, ...]]] = [
    (RESPONSE, "force", (*NEVER, 0.0, -1.0, "2", None, True)),
    (RESPONSE, "exponent", (*NEVER, 0.0, -1.5)),
    (RESPONSE, "reference_m", (*NEVER, 0.0, -3e-4)),
    (SPLINE, "shape", ((math.nan,), (0.1, 0.2), ())),
    (SPLINE, "knots_m", ((1e-4, math.nan, 1e-3), (1e-4, 1e-4, 1e-3), (1e-4, 1e-3), (3e-4,), ())),
    (EDGE, "offset_m", NEVER),
    (EDGE, "taper_rad", (*NEVER, 2.0, -90.0)),
    (EDGE, "length_m", (*NEVER, 0.0, -1.0)),
    (EDGE, "curvature_per_m", NEVER),
    (EDGE, "bend_per_m2", NEVER),
    (EDGE, "spline_m", ((0.0,) * 5,)),
    (CURVE, "spline_m", ((0.0,) * 3, (0.0, 0.0, 0.0, math.nan), ())),
    (CURVE, "spline_start_m", (*NEVER, 0.07, 0.1)),
    (CUTTING, "moving_blades", (0, 3, 1.5, math.nan, "both")),
    (CUTTING, "upper_face_m", (*NEVER, -1e-4)),
    (CUTTING, "fracture_energy", (*NEVER, 0.0, -1.0)),
    (CUTTING, "kappa", (*NEVER, -0.5, 1.7)),
    (CUTTING, "rate_damping", (*NEVER, -1.0)),
    (LAW, "values", tuple({"coulomb_pos": one} for one in (*NEVER, -0.01))),
    (LAW, "values", ({"presliding_share": 1.2}, {"presliding_share": -0.1})),
    (LAW, "angle_center", NEVER),
    (AxisLaw(1.0, LAW), "inertia", (*NEVER, 0.0, -1.0)),
    (AxisLaw(1.0, LAW), "offset", NEVER),
    (BladePoint(0.07, -0.008, 2), "moving_blades", (0, 3)),
    (BladePoint(0.07, -0.008, 2), "station_m", NEVER),
    (Sphere(0.02), "radius_m", (*NEVER, 0.0)),
    (Cylinder(0.02), "axis_rad", NEVER),
    (FIELD, "x_m", ((0.1, 0.0), (0.0, math.nan), (0.0, 0.0))),
    (FIELD, "weights_m", (np.full((5, 4), math.nan), np.zeros((5, 3)), np.zeros(5))),
]


@pytest.mark.parametrize(("made", "field", "values"), WRONG)
def test_an_impossible_number_is_refused_in_a_sentence(
    made: Any, field: str, values: tuple[Any, ...]
) -> None:
    for value in values:
        with pytest.raises(ModelError) as caught:
            replace(made, **{field: value})
        said = str(caught.value)
        assert said[0].isupper() or said[0].isdigit() or said[0] == '"'
        assert said.endswith(".")


ARRAYS = [
    (RESPONSE, "force"),
    (RESPONSE, "exponent"),
    (EDGE, "offset_m"),
    (EDGE, "taper_rad"),
    (CUTTING, "fracture_energy"),
    (CUTTING, "kappa"),
    (CUTTING, "rate_damping"),
]


@pytest.mark.parametrize(("made", "field"), ARRAYS)
def test_one_wrong_draw_among_many_is_found(made: Any, field: str) -> None:
    draws = np.full((1000, 1), float(getattr(made, field)))
    assert getattr(replace(made, **{field: draws}), field) is draws
    for wrong in NEVER:
        bad = draws.copy()
        bad[617, 0] = wrong
        with pytest.raises(ModelError, match="must be finite"):
            replace(made, **{field: bad})


def test_a_law_whose_parameters_step_into_the_complex_plane_is_made() -> None:
    stepped = replace(RESPONSE, force=np.asarray(2.0 + 1e-30j))
    assert np.imag(stepped.force_at(3e-4)) == pytest.approx(1e-30)
