"""Load, presliding and named terms: closed forms, and sense at the extremes."""

from typing import get_args

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from scissorcal.model import FrictionLaw, friction_torque, presliding_state
from scissorcal.model.terms import TERMS, Motion, evaluate
from scissorcal.recipe.schema import FrictionTerm

paths = st.lists(st.floats(-1, 1), min_size=2, max_size=40).map(np.array)


def test_dahl_state_is_the_solution_of_its_equation():
    """Against small Euler steps of length dz/dx = 1 - z sgn(dx), along a path with three turns."""
    way = np.concatenate([np.linspace(0, 1, 40), np.linspace(1, 0.4, 30), np.linspace(0.4, 2, 50)])
    state, z, length = presliding_state(way, 0.2), 1.0, 0.2
    for k in range(1, len(way)):
        step = (way[k] - way[k - 1]) / 2000
        for _ in range(2000):
            z += (1.0 - z * np.sign(step)) * step / length
        assert state[k] == pytest.approx(z, abs=2e-3)


@given(path=paths, length=st.floats(1e-9, 1e6))
def test_the_state_stays_between_its_ends_whatever_the_path(path, length):
    state = presliding_state(path, length)
    assert state.shape == path.shape
    assert np.all(np.abs(state) <= 1.0)


@given(path=paths, length=st.floats(1e-3, 10), repeats=st.integers(1, 5))
def test_the_state_knows_the_way_and_not_the_time(path, length, repeats):
    slow = presliding_state(np.repeat(path, repeats), length)
    assert slow[repeats - 1 :: repeats] == pytest.approx(presliding_state(path, length))


def test_a_joint_that_never_moved_has_built_up_nothing():
    assert np.all(presliding_state(np.full(5, 0.3), 0.1) == 0)


def test_friction_grows_with_the_load_and_builds_up_after_a_turn():
    law = FrictionLaw(
        coulomb_pos=0.01, coulomb_neg=0.01, load_share=0.2, presliding_share=0.5, load_gain=0.1
    )
    assert friction_torque(law, 0.0, 1.0, 0.05) == pytest.approx(0.01 + 0.01 + 0.005)
    assert friction_torque(law, 0.0, -1.0, 0.05) == pytest.approx(-0.02 + 0.005)
    assert friction_torque(law, 0.0, 1.0, -0.05) == pytest.approx(0.02 - 0.005)
    assert friction_torque(law, 0.0, 1.0, 0.0, state=-1.0) == pytest.approx(0.0)
    assert friction_torque(law, 0.0, 1.0, 0.0, state=1.0) == pytest.approx(0.01)


def test_named_terms_are_added_and_those_of_the_rate_follow_the_place():
    law = FrictionLaw(angle_slope=1.0, terms=("rate^2", "opening"), coefficients=(2.0, 3.0))
    assert friction_torque(law, 0.5, 2.0) == pytest.approx(2.0 * 4.0 * 1.5 + 3.0 * 0.5)
    still = FrictionLaw(terms=("1", "|rate|"), coefficients=(2.0, 3.0))
    assert friction_torque(still, 0.5, 0.0) == 0.0


def test_every_term_is_finite_and_as_long_as_its_motion():
    rng = np.random.default_rng(0)
    motion = Motion(*(rng.standard_normal(50) for _ in range(4)))
    columns = evaluate(tuple(TERMS), motion)
    assert columns.shape == (50, len(TERMS))
    assert np.all(np.isfinite(columns))
    with pytest.raises(ValueError, match="needs a load"):
        evaluate(("load*sign",), Motion(motion.opening, motion.rate, motion.acceleration))


def test_terms_of_the_rate_alone_do_not_know_the_place():
    rng = np.random.default_rng(1)
    rate, other = rng.standard_normal(20), rng.standard_normal(20)
    for term in TERMS.values():
        here, there = (term.value(Motion(place, rate, other, other)) for place in (other, rate))
        if term.of_rate_only:
            assert np.array_equal(here, there), term.name


@pytest.mark.parametrize("name", list(TERMS))
def test_the_unit_of_a_coefficient_makes_an_effort(name):
    """Scaling the units of position, time and effort scales a term as its powers say."""
    term = TERMS[name]
    motion = Motion(*(np.array([0.7]) for _ in range(4)))
    scaled = Motion(np.array([1.4]), np.array([1.4]), np.array([1.4]), np.array([1.4]))
    if not term.rotary:
        ratio = float((term.value(scaled) / term.value(motion)).item())
        assert ratio == pytest.approx(2.0 ** (term.position + term.effort))


def test_a_recipe_may_adopt_every_term_that_is_friction():
    assert set(get_args(FrictionTerm)) == {t.name for t in TERMS.values() if t.adoptable}


def test_all_dry_friction_builds_up_after_a_reversal_and_the_viscous_part_is_there_at_once():
    """A bristle that is not bent yet bears neither Coulomb nor Stribeck friction."""
    law = FrictionLaw(
        coulomb_pos=0.010,
        viscous_pos=0.002,
        stribeck=0.004,
        stribeck_rate=0.1,
        presliding_share=0.8,
    )
    dry, viscous = 0.010 + 0.004 * np.exp(-1.0), 0.002 * 0.1
    for state in (-1.0, 0.0, 1.0):
        built_up = 0.2 + 0.8 * state
        expected = built_up * dry + viscous
        assert friction_torque(law, 0.0, 0.1, 0.0, state) == pytest.approx(expected, rel=1e-12)
