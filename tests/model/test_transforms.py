"""Transforms: inverse of each other, and priors that hold 90 %."""

import pickle
from operator import attrgetter

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from scissorcal.model.terms import IDENTITY, LOG, LOGIT

EVERY = pytest.mark.parametrize("transform", [IDENTITY, LOG, LOGIT], ids=attrgetter("name"))


@EVERY
@given(u=st.floats(-20, 20))
def test_forward_and_inverse_undo_each_other(transform, u):
    x = transform.natural(np.asarray(u))
    assert float(transform.unconstrained(x)) == pytest.approx(u, abs=1e-6)


def test_two_numbers_of_a_recipe_hold_ninety_percent():
    z = 1.6448536269514722
    for transform, centre, width, low, high in (
        (IDENTITY, 1.0, 2.0, 1.0 - 2.0 * z, 1.0 + 2.0 * z),
        (LOG, 3.0, 10.0, 0.3, 30.0),
        (LOGIT, 0.5, 4.0, 0.2, 0.8),
    ):
        mean, sd = transform.normal_prior(centre, width)
        ends = transform.natural(np.array([mean - z * sd, mean, mean + z * sd]))
        assert ends == pytest.approx([low, centre, high])


@EVERY
def test_a_transform_stays_itself_in_another_process(transform):
    assert pickle.loads(pickle.dumps(transform)) == transform
