"""The C path of Dahl's presliding equals the closed form in Python."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from scissorcal.kernel import presliding_path
from scissorcal.model import presliding_state


@given(
    steps=st.lists(st.sampled_from([-2, -1, 0, 0, 1, 2, 5]), min_size=0, max_size=60),
    length=st.floats(1e-3, 10.0),
    size=st.floats(1e-3, 1.0),
)
@settings(max_examples=200)
def test_it_is_the_closed_form(steps, length, size):
    path = 0.3 + size * np.cumsum(np.array([0.0, *map(float, steps)]))
    assert np.abs(presliding_path(path, length) - presliding_state(path, length)).max() < 1e-12


def test_long_quantised_paths_agree_too():
    rng = np.random.default_rng(0)
    smooth = np.cumsum(np.cumsum(rng.standard_normal(50000)) * 1e-5)
    path = np.round(smooth / 1e-4) * 1e-4
    for length in (1e-4, 1e-2, 1.0):
        assert np.abs(presliding_path(path, length) - presliding_state(path, length)).max() < 1e-12


def test_no_path_and_no_length():
    assert len(presliding_path(np.zeros(0), 1.0)) == 0
    assert np.array_equal(presliding_path(np.ones(3), 1.0), np.zeros(3))
    with pytest.raises(ValueError, match="positive"):
        presliding_path(np.ones(3), 0.0)
