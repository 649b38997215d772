"""Strokes are found where the motion turns, whatever the noise, and rest belongs to none."""

import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from scissorcal.aliases import Array
from scissorcal.recording import TurningPoints, label_strokes


def trapezoids(speeds: list[float], rest_s: float, step: float = 1e-3) -> tuple[Array, Array]:
    """Closing and opening by turns between 1.0 and 0.2, at constant speeds, with rests between."""
    pieces, position = [np.full(round(rest_s / step), 1.0)], 1.0
    for number, speed in enumerate(speeds):
        target = 0.2 if number % 2 == 0 else 1.0
        count = round(0.8 / speed / step)
        pieces.append(np.linspace(position, target, count, endpoint=False))
        pieces.append(np.full(round(rest_s / step), target))
        position = target
    opening = np.concatenate(pieces)
    return opening, np.arange(len(opening)) * step


def test_constant_speeds_are_found_with_their_rests_left_out() -> None:
    speeds = [0.5, 1.0, 0.25, 2.0]
    opening, time = trapezoids(speeds, rest_s=0.5)
    labels = label_strokes(opening, time, 0.05, sheet=3)
    assert [s.kind for s in labels.strokes] == ["closing", "opening", "closing", "opening"]
    assert [s.index for s in labels.strokes] == [0, 1, 2, 3]
    assert [s.speed for s in labels.strokes] == pytest.approx(speeds, rel=0.01)
    assert {s.sheet for s in labels.strokes} == {3}
    for stroke in labels.strokes:
        here = np.flatnonzero(labels.stroke_of_sample == stroke.index)
        assert np.all(np.diff(here) == 1)
        moving = 0.8 / stroke.speed
        # The motion, 0.05 s of rest at both ends, and the slow creep within 2 % of min_travel.
        assert moving <= (len(here) + 1) * 1e-3 <= moving + 0.11


@given(
    noise=st.floats(0, 0.01),
    step=st.sampled_from([0.0, 1e-4, 5e-3]),
    seed=st.integers(0, 1000),
    mirrored=st.booleans(),
)
def test_noise_and_encoder_steps_do_not_split_strokes(
    noise: float, step: float, seed: int, mirrored: bool
) -> None:
    opening, time = trapezoids([0.7, 0.4, 1.1, 0.9], rest_s=0.2, step=2e-3)
    opening = opening + noise * np.random.default_rng(seed).uniform(-1, 1, len(opening))
    opening = np.round(opening / step) * step if step else opening
    labels = label_strokes(-opening if mirrored else opening, time, 0.05)
    kinds = ["closing", "opening"] * 2
    assert [s.kind for s in labels.strokes] == (kinds[1:] + kinds[:1] if mirrored else kinds)


@given(
    values=st.lists(st.floats(-10, 10), max_size=60),
    min_travel=st.floats(1e-3, 5),
)
def test_every_label_is_a_contiguous_leg_that_travels_enough(
    values: list[float], min_travel: float
) -> None:
    opening = np.array(values)
    labels = label_strokes(opening, np.arange(len(values)) * 0.001, min_travel)
    assert len(labels.stroke_of_sample) == len(values)
    assert set(labels.stroke_of_sample) <= {-1, *range(len(labels.strokes))}
    kinds = [s.kind for s in labels.strokes]
    assert all(one != other for one, other in itertools.pairwise(kinds))
    if len(values) and np.ptp(opening) >= min_travel:
        assert labels.strokes
    else:
        assert not labels.strokes


def test_no_motion_and_no_samples_give_no_strokes() -> None:
    assert label_strokes([], [], 0.1).strokes == ()
    labels = label_strokes(np.full(100, 0.3), np.arange(100.0), 0.1)
    assert labels.strokes == ()
    assert set(labels.stroke_of_sample) == {-1}


def test_invalid_arguments_are_refused() -> None:
    with pytest.raises(ValueError, match="min_travel must be positive"):
        label_strokes([0, 1], [0, 1], 0.0)
    with pytest.raises(ValueError, match="shape"):
        label_strokes([0, 1], [0], 0.1)


def reference_turns(values: list[float], min_travel: float) -> list[int]:
    """Turning points of the whole motion at once, written without regard to its length."""
    turns: list[int] = []
    for end in range(len(values)):
        low = values.index(min(values[: end + 1]))
        high = values.index(max(values[: end + 1]))
        if values[high] - values[low] >= min_travel:
            turns, at, direction = [min(low, high)], end, 1 if high > low else -1
            break
    else:
        return []
    while True:
        reached = at
        for index in range(at + 1, len(values)):
            if (values[index] - values[reached]) * direction > 0:
                reached = index
            elif (values[reached] - values[index]) * direction >= min_travel:
                at = index
                break
        else:
            return [*turns, reached]
        turns.append(reached)
        direction = -direction


@settings(max_examples=300)
@given(
    values=st.lists(st.floats(-10, 10) | st.sampled_from([0.0, 1.0, 2.0]), max_size=60),
    cuts=st.lists(st.integers(0, 60), max_size=8),
    min_travel=st.floats(1e-3, 5),
)
def test_turning_points_of_pieces_are_those_of_the_whole(
    values: list[float], cuts: list[int], min_travel: float
) -> None:
    points = TurningPoints(min_travel)
    for start, end in itertools.pairwise([0, *sorted(cuts), len(values) + 60]):
        points.feed(values[start:end])
        here = values[:end]
        labels = label_strokes(np.array(here), np.arange(len(here)) * 1e-3, min_travel)
        kinds = [stroke.kind for stroke in labels.strokes]
        assert (points.closings, points.openings) == (
            kinds.count("closing"),
            kinds.count("opening"),
        )
        assert points.so_far == reference_turns(here, min_travel)
