"""One axis: friction with inertia and offset, a damper near rest."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from scissorcal.model.friction import AxisLaw, FrictionLaw


@given(st.floats(-50.0, 50.0), st.floats(0.0, 1.0), st.floats(0.0, 0.5))
def test_friction_of_an_axis_opposes_every_motion(rate, place, rest_rate):
    law = FrictionLaw(
        {"coulomb_pos": 0.4, "coulomb_neg": 0.9, "viscous": 0.1, "angle_slope": 0.5}, 0.4
    )
    axis = AxisLaw(1.0, law, rest_rate=rest_rate)
    assert float(axis.effort(place, rate)) * rate >= 0.0


def test_friction_near_rest_is_a_damper_that_joins_the_law():
    axis = AxisLaw(1.0, FrictionLaw({"coulomb_pos": 2.0, "coulomb_neg": 3.0}), 0.25, 0.01)
    rates = np.array([-0.01, -0.005, 0.0, 0.0025, 0.01, 0.02])
    np.testing.assert_allclose(axis.effort(0.0, rates) - 0.25, [-3.0, -1.5, 0.0, 0.5, 2.0, 2.0])


def test_an_axis_is_read_from_a_fits_parameters():
    values = {"inertia": 0.8, "offset": -0.1, "coulomb": 0.7, "viscous": 4.0, "delay": 1e-3}
    axis = AxisLaw.of_fit(values, 0.03, 1e-3)
    assert (axis.inertia, axis.offset, axis.friction.angle_center) == (0.8, -0.1, 0.03)
    assert float(axis.effort(0.0, 0.1)) == pytest.approx(0.7 + 0.4 - 0.1)


@pytest.mark.parametrize(
    ("make", "match"),
    [
        (lambda: AxisLaw(0.0, FrictionLaw()), "inertia of an axis"),
        (lambda: AxisLaw(1.0, FrictionLaw(), rest_rate=-1.0), "rest rate"),
    ],
)
def test_an_axis_that_cannot_be_is_refused(make, match):
    with pytest.raises(ValueError, match=match):
        make()
