"""The stroke that comes next, the outlook, and what bounds a band: on problems counted by hand."""

from dataclasses import replace

import numpy as np
import pytest

from scissorcal.calibration.design import expected_band
from scissorcal.calibration.design.next_stroke import (
    FRICTION_SHARE,
    Taken,
    begun,
    bounds,
    friction_alone,
    outlook,
)
from tests.calibration.design.test_choice import known, stock, tells

BEGUN = Taken(((0.1, 0), (0.6, 1), (0.6, 0), (0.1, 1)))
"""Two pieces of two strokes each."""


def test_a_cut_begins_with_two_pieces_of_two_speeds_however_narrow_the_band() -> None:
    start = known(tolerance=0.99).plus(tells(1e6), tells(1e6, 3))
    taken, offers = Taken(), stock()
    chosen = []
    while (following := outlook(start, offers, "cut", taken, expected_band).following) is not None:
        chosen.append((following.speed, following.place))
        taken = taken.plus(following.speed, following.place)
    assert [place for _, place in chosen] == [0, 1, 0, 1]
    assert chosen[0][0] != chosen[1][0]
    assert chosen[2][0] != chosen[3][0]
    assert begun(offers, "cut", taken)
    assert taken.pieces == 2


def test_the_next_stroke_is_the_one_that_gains_most_per_minute() -> None:
    """Strokes tell alike here: the fast one in the piece that lies there takes least time."""
    start = known(tolerance=0.03).plus(tells(1e6), tells(100.0, 3))
    following = outlook(start, stock(), "cut", BEGUN, expected_band).following
    assert following is not None
    assert (following.speed, following.place) == (0.6, 2)
    assert following.seconds == 4.0


def test_a_full_piece_is_followed_by_a_fresh_one_with_the_time_of_its_handling() -> None:
    start = known(tolerance=0.03).plus(tells(1e6), tells(100.0, 3))
    following = outlook(start, stock(), "cut", BEGUN.plus(0.6, 2), expected_band).following
    assert following is not None
    assert (following.speed, following.place) == (0.6, 0)
    assert following.seconds == 34.0


def test_the_outlook_counts_strokes_until_the_band_is_within_the_tolerance() -> None:
    """Half of the band is 2 / sqrt(1 + 500 k): below 0.05 from k = 4 strokes on (0.0447)."""
    start = known(tolerance=0.05).plus(tells(1e9))
    view = outlook(start, stock(), "cut", BEGUN, expected_band)
    assert view.reaches
    assert view.strokes == 4
    assert view.last.share[0] == pytest.approx(2.0 / np.sqrt(2001.0), rel=1e-3)
    assert view.seconds == pytest.approx(4.0 + 3 * 34.0 - 2 * 30.0)


def test_a_single_speed_on_offer_goes_on_in_the_piece_that_was_begun() -> None:
    """Another speed is asked for only where there is one."""
    offers = stock()
    slow = {key: offer for key, offer in offers.strokes.items() if key[0] == 0.1}
    offers = replace(offers, strokes=slow)
    start = known(tolerance=0.99).plus(tells(1e6), tells(1e6, 3))
    view = outlook(start, offers, "cut", Taken(((0.1, 0),)), expected_band)
    assert view.following is not None
    assert (view.following.speed, view.following.place) == (0.1, 1)
    assert view.strokes == 3


def test_nothing_on_offer_is_no_next_stroke() -> None:
    view = outlook(known(), replace(stock(), sweeps={}), "friction", Taken(), friction_alone)
    assert view.following is None
    assert not view.reaches


def test_strokes_that_are_asked_for_come_also_within_the_tolerance() -> None:
    start = known(tolerance=0.9).plus(tells(1e6), tells(1e4, 3))
    assert outlook(start, stock(), "cut", BEGUN, expected_band).following is None
    view = outlook(start, stock(), "cut", BEGUN, expected_band, least=2)
    assert view.following is not None
    assert view.strokes == 2
    assert view.reaches


def test_a_band_that_friction_bounds_is_not_expected_to_be_reached_by_cuts() -> None:
    start = known(tolerance=0.05).plus(tells(9.0), tells(1e4, 3))
    view = outlook(start, stock(), "cut", BEGUN, expected_band)
    assert not view.reaches
    now = expected_band(start).excess
    excess = {name: band.excess for name, band in bounds(start).items()}
    assert min(excess, key=lambda name: excess[name]) == "friction"
    assert excess["friction"] == 0.0 < now
    assert excess["law"] == pytest.approx(now)


def test_the_stated_error_of_the_law_bounds_a_band_in_the_end() -> None:
    told = replace(tells(1e8, 3), errors={"loading": np.array([1e8, 0.0, 0.0])})
    start = known(tolerance=0.05).plus(tells(1e8), told)
    shares = replace(start.cut, error_shares={"loading": 0.1})
    start = replace(start, cut=shares)
    np.testing.assert_allclose(expected_band(start).share, 0.2, rtol=1e-3)
    assert bounds(start)["law"].reached
    assert not bounds(start)["friction"].reached


def test_friction_alone_may_take_half_of_the_tolerance() -> None:
    start = known(tolerance=0.1).plus(tells(2499.0))
    own = friction_alone(start)
    np.testing.assert_allclose(own.share, 2.0 / 50.0 / FRICTION_SHARE, rtol=1e-6)
    assert own.reached
    assert not expected_band(start).reached
    view = outlook(known(tolerance=0.1), stock(), "friction", Taken(((1.0, 0),)), friction_alone)
    assert view.following is not None
    assert view.following.speed == 1.0
    assert view.reaches


def test_friction_that_is_not_rendered_counts_by_the_level_that_the_cut_takes_off() -> None:
    """The level has slope 1e-3 N m, which is 1 % of a torque of 0.1 N m."""
    before = known(tolerance=0.03)
    before = replace(
        before, scene=replace(before.scene, by_friction=np.zeros_like(before.scene.by_friction))
    )
    own = friction_alone(before)
    np.testing.assert_allclose(own.share, 2.0 * 0.01 / FRICTION_SHARE, rtol=1e-6)
    assert not own.reached
    after = friction_alone(before.plus(tells(3.0)))
    np.testing.assert_allclose(after.share, own.share / 2.0, rtol=1e-6)
    assert after.reached
