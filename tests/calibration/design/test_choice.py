"""The expected band and the greedy list, on problems small enough to count by hand."""

from dataclasses import replace

import numpy as np
import pytest

from scissorcal.calibration.design import (
    CaptureList,
    Information,
    Knowledge,
    Offer,
    SceneSlopes,
    Sharing,
    Stock,
    TorqueKnowledge,
    choose_captures,
    expected_band,
    knowledge_after,
)
from scissorcal.calibration.design.choice import SPARE, _shorter
from scissorcal.calibration.parameters import Layout, Parameter
from scissorcal.model import IDENTITY
from scissorcal.recipe import MOST_SPEEDS

TORQUE = np.array([0.1, 0.1, 0.1])


def fit_of(*names: str) -> Knowledge:
    layout = Layout(tuple(Parameter(name, "1", IDENTITY, 0.0, 1.0, "one") for name in names))
    return Knowledge(layout, np.zeros(len(names)), np.eye(len(names)))


def known(tolerance: float = 0.07) -> TorqueKnowledge:
    """Friction has one parameter, the cut one and two offsets; each slope is the torque's."""
    scene = SceneSlopes(
        TORQUE,
        by_friction=TORQUE[:, None],
        by_cut=np.column_stack([TORQUE, np.zeros(3), np.zeros(3)]),
        reach=2.0,
        tolerance=tolerance,
    )
    sharing = Sharing(np.array([[1e-3], [1e-3]]), (1, 2), 1e-5, np.zeros(2))
    return TorqueKnowledge(
        fit_of("level"), fit_of("force", "offset_closing", "offset_opening"), sharing, scene
    )


def tells(precision: float, size: int = 1) -> Information:
    curvature = np.zeros((size, size))
    curvature[0, 0] = precision
    return Information(curvature, curvature)


def stock(precision: float = 500.0) -> Stock:
    slow, fast = Offer(tells(precision), 60.0), Offer(tells(precision), 6.0)
    strokes = {
        (speed, place): Offer(tells(precision, 3), seconds)
        for speed, seconds in ((0.1, 20.0), (0.6, 4.0))
        for place in range(3)
    }
    middle = Offer(tells(0.1 * precision), 6.0)
    return Stock(
        sweeps={0.05: slow, 0.2: middle, 1.0: fast},
        excitation=Offer(tells(0.0), 5.0),
        excitation_s=4.0,
        strokes=strokes,
        piece_s=30.0,
        begin_s=20.0,
    )


def test_the_band_is_the_quadratic_form_of_both_covariances() -> None:
    everything = known().plus(tells(99.0), tells(399.0, 3))
    band = expected_band(everything)
    np.testing.assert_allclose(band.share, 2.0 * np.sqrt(1 / 100.0 + 1 / 400.0))
    assert band.worst == pytest.approx(band.typical)
    assert band.within == 0.0
    assert not band.reached


def test_a_band_within_the_tolerance_is_reached_and_has_no_excess() -> None:
    band = expected_band(known(tolerance=0.5).plus(tells(99.0), tells(399.0, 3)))
    assert band.reached
    assert band.within == 1.0
    assert band.excess == 0.0


def test_what_friction_leaves_open_is_the_prior_of_the_offsets() -> None:
    """A level known to 0.1 gives offsets that are known to 1e-3 times that before the cut."""
    start = known().plus(tells(99.0))
    prior = start.cut_given_friction.prior
    np.testing.assert_allclose(prior[[1, 2], [1, 2]], 1e8)
    assert prior[0, 0] == 1.0
    without = known().cut_given_friction.prior
    np.testing.assert_allclose(without[[1, 2], [1, 2]], 1e6)


def test_a_first_list_has_three_speeds_and_two_pieces_however_good_the_prior() -> None:
    design = choose_captures(known(tolerance=0.99), stock(1e9))
    assert design.captures.speeds == (0.05, 0.2, 1.0)
    assert design.captures.pieces == ((0.1, 0.6), (0.6, 0.1))
    assert [step.capture for step in design.steps] == ["friction", "cut"]
    assert design.expected.reached
    assert not design.now.reached


def test_a_list_grows_by_what_gains_most_per_minute() -> None:
    """Fast sweeps tell as much as slow ones here, in a tenth of the time."""
    design = choose_captures(known(tolerance=0.05), stock())
    assert design.steps[2].what == "sweep at 1 rad/s, both ways"
    counts = {speed: design.captures.speeds.count(speed) for speed in (0.05, 0.2, 1.0)}
    assert counts[1.0] == max(counts.values())
    assert counts[1.0] <= 2 * min(counts.values()), "the law that is assumed may lack something"
    assert design.expected.reached
    later = list(design.steps[2:])
    assert all(step.gain > 0 for step in later if step.minutes > 0)
    assert design.minutes == pytest.approx(sum(step.minutes for step in design.steps))
    assert design.minutes == pytest.approx(design.steps[-1].total_minutes)


def test_the_list_stops_when_the_tolerance_is_reached_and_not_before() -> None:
    offers = stock()
    design = choose_captures(known(tolerance=0.05), offers)
    whole = knowledge_after(known(tolerance=0.05), offers, design.captures)
    assert expected_band(whole).reached
    grown = [step for step in design.steps if step.minutes > 0]
    assert not grown[-1].before.wider(SPARE).reached


def test_nothing_is_added_where_the_tolerance_is_reached_already() -> None:
    done = known(tolerance=0.5).plus(tells(1e6), tells(1e6, 3))
    design = choose_captures(done, stock())
    assert design.captures == CaptureList()
    assert design.steps == ()
    assert design.minutes == 0.0
    assert design.sentence.startswith("Nothing more to capture")


def test_only_what_helps_is_captured_again() -> None:
    """Friction is known exactly, the cut is not: no sweep is added."""
    start = known(tolerance=0.05).plus(tells(1e9), tells(50.0, 3))
    start = replace(start, cut=replace(start.cut, between=np.zeros(3)))
    design = choose_captures(start, stock())
    assert design.captures.speeds == ()
    assert design.captures.pieces
    assert design.expected.reached


def test_a_tolerance_that_no_stroke_reaches_is_said_so() -> None:
    """The law's stated error alone is wider."""
    start = known(tolerance=0.01)
    offers = stock()
    wrong = {
        key: replace(
            offer,
            information=replace(offer.information, errors={"run": offer.information.curvature[0]}),
        )
        for key, offer in offers.strokes.items()
    }
    start = replace(start, cut=replace(start.cut, error_shares={"run": 0.1}))
    design = choose_captures(start, replace(offers, strokes=wrong))
    assert not design.expected.reached
    assert "the best found" in design.sentence


def test_a_list_that_no_length_of_suffices_is_no_longer_than_a_recipe_holds() -> None:
    """Long pieces, each of which would take 40 strokes, towards a tolerance of 1e-4 %."""
    strokes = {
        (speed, place): Offer(tells(50.0, 3), 4.0) for speed in (0.1, 0.6) for place in range(40)
    }
    found = choose_captures(known(1e-6), replace(stock(), strokes=strokes))
    count = sum(len(piece) for piece in found.captures.pieces)
    assert 60 < count <= MOST_SPEEDS
    assert found.captures.fits_a_recipe


def test_presses_take_speeds_in_turn() -> None:
    design = choose_captures(known(tolerance=0.04), replace(stock(), rotates=True))
    for number, presses in enumerate(design.captures.pieces):
        assert presses == tuple((0.1, 0.6)[(place + number) % 2] for place in range(len(presses)))


def test_nothing_can_be_left_out_of_the_list() -> None:
    offers = stock()
    design = choose_captures(known(tolerance=0.05), offers)
    shorter = list(_shorter(offers, design.captures))
    assert shorter
    for _, what, less in shorter:
        band = expected_band(knowledge_after(known(tolerance=0.05), offers, less))
        assert not band.wider(SPARE).reached, what
    assert design.expected.wider(SPARE).reached


def test_where_no_stroke_helps_the_sentence_says_so() -> None:
    """An empty list is neither a list nor the best found."""
    settled = known(tolerance=0.001)
    have = replace(
        settled,
        friction=replace(settled.friction, recordings=(tells(1.0),)),
        cut=replace(settled.cut, recordings=(tells(1.0, 3),)),
    )
    design = choose_captures(have, stock(0.0))
    assert design.captures == CaptureList()
    assert design.sentence.startswith("No stroke on offer is expected to narrow")
