"""A recording of cuts in pieces: turns, rests, cracks that wait and cracks that run."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from scissorcal.calibration.cut.guess import Rest, placed_by_loading
from scissorcal.calibration.cut.known import MaterialData
from scissorcal.calibration.cut.path_motion import find_runs, path_motion, split
from scissorcal.calibration.cut.path_work import material_of
from scissorcal.calibration.cut.segments import cut_into_segments
from tests.calibration.cut.made_cuts import (
    FRICTION,
    GEOMETRY,
    GUESS,
    HIGH,
    LOW,
    NOISE,
    Cut,
    cut,
    way,
)
from tests.calibration.cut.path.made import INERTIA


def segments_of(made: Cut, cuts: bool = True):
    return cut_into_segments(
        MaterialData(made.motions, made.materials, NOISE, 1e-4), GEOMETRY, GUESS, cuts
    )


@pytest.fixture(scope="module")
def two_strokes() -> Cut:
    return cut(way(HIGH, LOW, HIGH), way(HIGH, LOW, HIGH))


def test_a_sheet_is_loaded_unloaded_loaded_and_cut(two_strokes):
    found = segments_of(two_strokes)
    assert [piece.kind for piece in found.pieces] == ["fresh", "unloading", "loading", "unloading"]
    assert [rest.fresh for rest in found.rests] == [True, False, False]
    assert [piece.rest for piece in found.pieces] == [0, 1, 1, 2]
    assert [stretch.sheet for stretch in found.stretches] == [0, 0]


def test_rests_lie_where_the_crack_stands(two_strokes):
    found = segments_of(two_strokes)
    length = len(two_strokes.tip) // 2
    for rest, tip in zip(found.rests[1:], two_strokes.tip[[length - 1, -1]], strict=True):
        assert rest.place == pytest.approx(tip, abs=2e-5)
        assert rest.opening == pytest.approx(LOW, abs=1e-4)


def test_the_next_loading_places_a_crack_whose_unloading_the_encoder_hides():
    """Steps of 0.8 mrad: the torque after the turn alone places it 0.4 mm off."""
    made = cut(way(HIGH, LOW, HIGH), way(HIGH, LOW, HIGH), step_rad=8e-4)
    found = segments_of(made)
    ends = made.tip[[len(made.tip) // 2 - 1, -1]]
    assert [rest.seen for rest in found.rests] == [True, False, False]
    assert found.rests[1].place == pytest.approx(ends[0], abs=5e-6)
    assert abs(found.rests[2].place - ends[1]) > 1e-4, "no loading follows the last stroke"
    assert [(piece.kind, piece.rest) for piece in found.pieces] == [
        ("unloading", 1),
        ("loading", 1),
        ("unloading", 2),
    ]


def test_mean_torques_are_those_of_the_truth(two_strokes):
    """Means over the path of the true torque, to 0.5 % of the largest."""
    found = segments_of(two_strokes)
    opening, torque = two_strokes.made.opening, two_strokes.torque
    path = np.diff(opening)
    work = np.concatenate([[0.0], np.cumsum(0.5 * (torque[1:] + torque[:-1]) * path)])
    for part in (*found.pieces, *found.stretches):
        expected = np.diff(work[part.ends]) / np.diff(opening[part.ends])
        assert part.torque == pytest.approx(expected, abs=5e-3 * torque.max()), part
    for stretch in found.stretches:
        assert stretch.path == pytest.approx(np.diff(opening[stretch.ends]), rel=1e-3)
        assert stretch.speed == pytest.approx(0.4, rel=0.2)


def test_unloading_begins_after_the_blades_leave_the_turn():
    """A servo that opens by 2 mrad, comes back to within 0.2 mrad of the turn, and then opens."""
    made = cut(way(HIGH, LOW, LOW + 2e-3, LOW + 2e-4, HIGH))
    piece = segments_of(made).pieces[-1]
    opening = made.motions[0].opening
    assert piece.kind == "unloading"
    assert opening[piece.ends[0] :].min() == pytest.approx(opening[piece.ends[0]], abs=1e-5)


def test_each_sheet_starts_uncut():
    found = segments_of(
        cut(way(HIGH, LOW, HIGH), way(HIGH, LOW, HIGH), places=(-0.018,) * 2, kinds=(0, 1))
    )
    assert [piece.kind for piece in found.pieces] == ["fresh", "unloading"] * 2
    assert [stretch.sheet for stretch in found.stretches] == [0, 1]


def test_a_pause_or_tremor_within_a_stroke_splits_nothing(two_strokes):
    """A servo that stops for a while in the middle and moves back by 2 mrad."""
    found = segments_of(two_strokes)
    paused = segments_of(cut(way(HIGH, 0.5, 0.502, LOW, HIGH), way(HIGH, LOW, HIGH)))
    assert [p.kind for p in paused.pieces] == [p.kind for p in found.pieces]
    assert len(paused.stretches) == len(found.stretches)
    before, after = found.stretches[0], paused.stretches[0]
    assert abs(after.path.sum()) == pytest.approx(abs(before.path.sum()), abs=6e-3)
    assert np.all(after.path < 0.0)


def test_an_interrupted_stroke_rests_at_its_turn_and_continues_beyond():
    """Back by 60 mrad at 0.5 rad: the crack waits, is loaded again and runs on only beyond."""
    found = segments_of(cut(way(HIGH, 0.5, 0.56, LOW, HIGH)))
    assert [rest.fresh for rest in found.rests] == [True, False, False]
    assert found.rests[1].opening == pytest.approx(0.5, abs=1e-4)
    first, second = found.stretches
    opening = found.motions[0].opening
    assert opening[first.ends[-1]] >= 0.5
    assert opening[second.ends[0]] < 0.5
    assert [p.kind for p in found.pieces][:2] == ["fresh", "unloading"]


def test_invalid_samples_split_a_stretch_and_remove_one_segment(two_strokes):
    whole = segments_of(two_strokes)
    usable = np.ones(len(two_strokes.tip), dtype=bool)
    middle = int(whole.stretches[0].ends[len(whole.stretches[0].ends) // 2])
    usable[middle : middle + 3] = False
    invalid = segments_of(
        cut(way(HIGH, LOW, HIGH), way(HIGH, LOW, HIGH), usable=usable),
    )
    assert len(invalid.stretches) == 3
    for stretch in invalid.stretches:
        assert np.all(usable[stretch.ends[0] : stretch.ends[-1] + 1])
    lost = sum(len(s.torque) for s in whole.stretches) - sum(
        len(s.torque) for s in invalid.stretches
    )
    assert 1 <= lost <= 2


@pytest.mark.parametrize("count", [1, 2])
def test_a_piece_is_not_lost_for_a_sample_or_two(two_strokes, count):
    """Torque between usable samples 3 ms apart is that of the line between them."""
    whole = segments_of(two_strokes)
    usable = np.ones(len(two_strokes.tip), dtype=bool)
    first = int(whole.pieces[1].ends[2])
    usable[first : first + count] = False
    torn = np.where(usable, two_strokes.made.recording.samples["motor_torque"], 1e3)
    recording = two_strokes.made.recording
    samples = recording.samples.copy()
    samples["motor_torque"] = torn
    made = replace(two_strokes.made, recording=replace(recording, samples=samples))
    motions = path_motion((made.recording,), INERTIA, (usable,))
    materials = tuple(material_of(motion, FRICTION, 0.0) for motion in motions)
    found = segments_of(replace(two_strokes, made=made, motions=motions, materials=materials))
    assert [p.kind for p in found.pieces] == [p.kind for p in whole.pieces]
    for one, other in zip(found.pieces, whole.pieces, strict=True):
        allowed = 5.0 * np.sqrt(np.diag(other.covariance)) + 1e-4
        np.testing.assert_allclose(one.torque, other.torque, atol=float(allowed.max()))


def test_an_invalid_piece_is_left_out(two_strokes):
    whole = segments_of(two_strokes)
    usable = np.ones(len(two_strokes.tip), dtype=bool)
    first = int(whole.pieces[1].ends[2])
    usable[first : first + 3] = False
    invalid = segments_of(cut(way(HIGH, LOW, HIGH), way(HIGH, LOW, HIGH), usable=usable))
    assert [piece.kind for piece in invalid.pieces] == ["fresh", "loading", "unloading"]


def lacking(made: Cut, keep: np.ndarray) -> Cut:
    """The cut without the samples that ``keep`` leaves out."""
    recording = replace(made.made.recording, samples=made.made.recording.samples[keep])
    motions = path_motion((recording,), INERTIA)
    materials = tuple(material_of(motion, FRICTION, 0.0) for motion in motions)
    return replace(made, motions=motions, materials=materials)


def test_single_lost_samples_cost_nothing(two_strokes):
    """1 % of the samples, at random: no stretch between two is as long as a rate needs."""
    keep = np.random.default_rng(1).random(len(two_strokes.tip)) > 0.01
    whole, torn = segments_of(two_strokes), segments_of(lacking(two_strokes, keep))
    assert [p.kind for p in torn.pieces] == [p.kind for p in whole.pieces]
    assert len(torn.stretches) == len(whole.stretches)
    for one, other in zip(torn.rests, whole.rests, strict=True):
        assert one.place == pytest.approx(other.place, abs=1e-5)
    for one, other in zip(torn.pieces, whole.pieces, strict=True):
        np.testing.assert_allclose(one.torque, other.torque, atol=0.01 * other.torque.max())


def test_no_rest_is_placed_by_what_a_gap_hides(two_strokes):
    """A gap of 40 ms over the turn, then one within the unloading."""
    whole = segments_of(two_strokes)
    turn = int(np.argmin(two_strokes.made.opening[: len(two_strokes.tip) // 2]))
    keep = np.ones(len(two_strokes.tip), dtype=bool)
    keep[turn - 20 : turn + 160] = False
    keep[turn + 20 : turn + 120] = True
    hidden = segments_of(lacking(two_strokes, keep))
    unloading = whole.pieces[1]
    keep = np.ones(len(two_strokes.tip), dtype=bool)
    keep[unloading.ends[1] : unloading.ends[3]] = False
    torn = segments_of(lacking(two_strokes, keep))
    assert not torn.rests[1].seen
    assert torn.rests[1].placed
    assert torn.rests[1].place == pytest.approx(whole.rests[1].place, abs=5e-5)
    assert [p.kind for p in torn.pieces] == ["fresh", "loading", "unloading"]
    assert [p.rest for p in hidden.pieces if p.kind == "unloading"] == [len(hidden.rests) - 1]


@pytest.mark.parametrize(("begins_at", "placed"), [(0.0, True), (0.9, False)])
def test_a_loading_that_begins_beyond_its_measure_places_no_crack(two_strokes, begins_at, placed):
    """Shares of the running crack's torque: it falls as the crack jumps, and rises again.

    Blades that spring back by 3 mrad as a crack jumps are loaded still: what comes up to the
    measure later is the next jump's torque, and once placed a crack 2 mm off.
    """
    (motion,), run = two_strokes.motions, find_runs(two_strokes.motions)[0]
    middle = int(np.argmax(motion.opening < 0.5))
    run = replace(run, low=middle, high=middle + 200)
    shares = np.interp(np.arange(201), [0, 60, 100, 140, 200], [begins_at, 0.9, 0.9, 0.3, 0.9])
    torque = np.zeros(len(motion.opening))
    torque[middle : middle + 201] = shares * two_strokes.torque[middle : middle + 201]
    work = np.append(0.0, np.cumsum(0.5 * (torque[1:] + torque[:-1]) * np.diff(motion.opening)))
    rest = Rest(0, False, float(two_strokes.tip[middle]), 0.5, -0.018, seen=False)
    assert placed_by_loading(motion, work, run, rest, GEOMETRY, GUESS).placed == placed


def test_where_nothing_is_cut_the_near_edge_is_the_only_place():
    pressed = cut(way(HIGH, 0.62, HIGH), places=(-0.02,), cuts=False)
    found = segments_of(pressed, cuts=False)
    assert found.stretches == ()
    assert {piece.rest for piece in found.pieces} == {0}
    assert found.rests[0].place == 0.0
    assert "unloading" in [piece.kind for piece in found.pieces]


def test_strokes_without_a_sheet_have_no_runs():
    made = cut(way(HIGH, LOW, HIGH), kinds=(-1,))
    assert find_runs(made.motions) == []


@given(
    steps=st.lists(st.floats(-1e-4, 8e-4), min_size=30, max_size=200),
    step=st.floats(1e-3, 1e-2),
)
def test_segments_go_forward_by_a_step_at_least(steps, step):
    path = -np.cumsum(np.array([1e-4, *steps]))
    ends = split(path, 0, len(path) - 1, step)
    if path[-1] < path[0]:
        assert ends[0] == 0
        assert np.all(np.diff(ends) > 0)
        assert np.all(-np.diff(path[ends]) >= step * (1 - 1e-9))
