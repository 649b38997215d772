"""Load, presliding and named terms: closed forms, and sense at the extremes."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from scissorcal.model import FrictionLaw, friction_torque, presliding_state
from scissorcal.model.friction import angle_factor, angle_slope, friction_level
from scissorcal.model.friction_terms import PARAMETERS, TERMS, law_names, terms_of
from scissorcal.model.terms import Motion, Role
from scissorcal.recipe import FitFriction

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
        {"coulomb": 0.01, "load_share": 0.2, "presliding_share": 0.5, "load_gain": 0.1}
    )
    assert friction_torque(law, 0.0, 1.0, 0.05) == pytest.approx(0.01 + 0.01 + 0.005)
    assert friction_torque(law, 0.0, -1.0, 0.05) == pytest.approx(-0.02 + 0.005)
    assert friction_torque(law, 0.0, 1.0, -0.05) == pytest.approx(0.02 - 0.005)
    assert friction_torque(law, 0.0, 1.0, 0.0, state=-1.0) == pytest.approx(0.0)
    assert friction_torque(law, 0.0, 1.0, 0.0, state=1.0) == pytest.approx(0.01)


def test_named_terms_are_added_and_those_of_the_rate_follow_the_place():
    law = FrictionLaw({"angle_slope": 1.0, "rate^2": 2.0, "opening": 3.0})
    assert friction_torque(law, 0.5, 2.0) == pytest.approx(2.0 * 4.0 * 1.5 + 3.0 * 0.5)
    still = FrictionLaw({"1": 2.0, "|rate|": 3.0})
    assert friction_torque(still, 0.5, 0.0) == 0.0


def test_every_term_is_finite_and_as_long_as_its_motion():
    rng = np.random.default_rng(0)
    motion = Motion(*(rng.standard_normal(50) for _ in range(4)))
    columns = np.stack([term.column(motion) for term in TERMS.values()], axis=1)
    assert columns.shape == (50, len(TERMS))
    assert np.all(np.isfinite(columns))
    with pytest.raises(ValueError, match="needs a load"):
        TERMS["load*sign"].column(Motion(motion.opening, motion.rate, motion.acceleration))


def test_terms_of_the_rate_alone_do_not_know_the_place():
    rng = np.random.default_rng(1)
    rate, other = rng.standard_normal(20), rng.standard_normal(20)
    for term in TERMS.values():
        here, there = (term.value(Motion(place, rate, other, other)) for place in (other, rate))
        if term.role is Role.SLIDING:
            assert np.array_equal(here, there), term.name


@pytest.mark.parametrize("name", list(TERMS))
def test_the_unit_of_a_coefficient_makes_an_effort(name):
    """Scaling the units of position, time and effort scales a term as its powers say."""
    term = TERMS[name]
    motion = Motion(*(np.array([0.7]) for _ in range(4)))
    scaled = Motion(np.array([1.4]), np.array([1.4]), np.array([1.4]), np.array([1.4]))
    if not term.rotary:
        ratio = float((term.value(scaled) / term.value(motion)).item())
        effort, position, _ = term.powers
        assert ratio == pytest.approx(2.0 ** (1 - effort - position))


def test_a_recipe_may_adopt_every_term_that_is_friction():
    for term in TERMS.values():
        if term.adoptable:
            assert FitFriction(adopt=(term.name,)).adopt == (term.name,)
        else:
            with pytest.raises(ValueError, match="Input should be"):
                FitFriction(adopt=(term.name,))


@pytest.mark.parametrize("name", law_names())
def test_a_law_is_the_sum_of_its_rows(name):
    """Each parameter moves friction by what its row says, and those of other laws are refused."""
    rng = np.random.default_rng(5)
    values = {n: rng.uniform(0.1, 0.9) for t in terms_of(name) for n in t.names(symmetric=False)}
    law = FrictionLaw(values, angle_center=0.4)
    assert law.terms == terms_of(name)
    speed = np.linspace(0.0, 2.0, 21)
    for sign in (-1.0, 1.0):
        level, slope = friction_level(law, sign, speed)
        moving = np.maximum(speed, 1e-12)
        assert level == pytest.approx(sign * friction_torque(law, 0.4, sign * moving))
        steps = (friction_level(law, sign, speed[1:] + step)[0] for step in (1e-6, -1e-6))
        assert slope[1:] == pytest.approx((next(steps) - next(steps)) / 2e-6, abs=1e-8)
    place, step = np.linspace(0.0, 1.0, 5), 1e-6
    assert angle_factor(law, place).shape == place.shape
    rise = (angle_factor(law, place + step) - angle_factor(law, place - step)) / (2 * step)
    assert angle_slope(law, place) == pytest.approx(rise, abs=1e-8)


def test_a_name_that_no_row_has_is_refused():
    with pytest.raises(ValueError, match='"colomb" is no parameter'):
        FrictionLaw({"colomb": 1.0})
    with pytest.raises(ValueError, match='"inertia" is no parameter'):
        FrictionLaw({"inertia": 1.0})
    law = FrictionLaw.of_fit({"inertia": 1.0, "noise": 1.0, "coulomb": 0.1, "rate^2": 0.2}, 0.0)
    assert set(law.values) == {"coulomb", "rate^2"}


def test_every_row_of_a_law_has_a_prior_with_a_reason_and_a_key_of_its_own():
    for kind in ("rotary", "linear"):
        keys = [term.prior_key(kind) for term in PARAMETERS.values()]
        assert len(set(keys)) == len(keys) - 1, "cogging's two parameters share one"
        assert all(
            term.prior is not None and term.prior.of(kind)[2] for term in PARAMETERS.values()
        )


def test_all_dry_friction_builds_up_after_a_reversal_and_the_viscous_part_is_there_at_once():
    """A bristle that is not bent yet bears neither Coulomb nor Stribeck friction."""
    law = FrictionLaw(
        {
            "coulomb_pos": 0.010,
            "viscous_pos": 0.002,
            "stribeck": 0.004,
            "stribeck_rate": 0.1,
            "presliding_share": 0.8,
        }
    )
    dry, viscous = 0.010 + 0.004 * np.exp(-1.0), 0.002 * 0.1
    for state in (-1.0, 0.0, 1.0):
        built_up = 0.2 + 0.8 * state
        expected = built_up * dry + viscous
        assert friction_torque(law, 0.0, 0.1, 0.0, state) == pytest.approx(expected, rel=1e-12)
