"""Strokes in which a device let go of its motors are counted, and named with their cause."""

from dataclasses import replace

import numpy as np
import pytest

from scissorcal.calibration.signals.soundness import interruptions
from scissorcal.recording import Recording
from tests.calibration.truth import Stroke, Truth, make_recording, sweep

SPEEDS = (0.3, 0.3, 0.8, 0.8)


def recorded() -> Recording:
    """Two closing strokes at each of two speeds."""
    strokes = [Stroke(place, "closing", speed) for place, speed in enumerate(SPEEDS)]
    opening = [sweep(0.87, 0.2, speed) for speed in SPEEDS]
    places = [0.0] * len(opening)
    rng = np.random.default_rng(1)
    made = make_recording("friction", opening, places, strokes, Truth(), rng, False)
    return replace(made, device={"name": "a rig"})


def with_fault(recording: Recording, *strokes: int, flags: int = 6) -> Recording:
    """A fault for 20 ticks in the middle of strokes; braked samples belong to none."""
    samples = recording.samples.copy()
    for number in strokes:
        middle = int(np.median(np.flatnonzero(recording.samples["stroke"] == number)))
        samples["flags"][middle : middle + 20] |= flags
        samples["stroke"][middle : middle + 20] = -1
    return replace(recording, samples=samples)


def test_whole_strokes_say_nothing() -> None:
    found = interruptions((recorded(),))
    assert (found.strokes, found.interrupted, found.sentence) == (4, 0, "")


def test_one_of_two_strokes_of_a_speed_is_told_and_decides_nothing() -> None:
    found = interruptions((with_fault(recorded(), 1),))
    assert (found.interrupted, found.worst) == (1, 0.5)
    assert "in 1 of 4 strokes, in 1 of them since commands came late: close" in found.sentence
    assert found.verdict("fit.friction").status == "not_evaluated"


def test_no_whole_stroke_of_a_speed_fails() -> None:
    found = interruptions((with_fault(recorded(), 2, 3),))
    assert found.decide
    verdict = found.verdict("fit.cut")
    assert (verdict.status, verdict.value) == ("fail", pytest.approx(1.0))


def test_other_faults_are_not_laid_to_late_commands() -> None:
    found = interruptions((with_fault(recorded(), 0, flags=2),))
    assert found.late == 0
    assert "look up the faults" in found.sentence
    assert "close programs" not in found.sentence


def test_another_recording_with_a_whole_stroke_shows_the_speed() -> None:
    found = interruptions((with_fault(recorded(), 2, 3), recorded()))
    assert (found.strokes, found.interrupted, found.worst) == (8, 2, 0.5)
    assert not found.decide


def test_a_fault_in_the_last_samples_of_a_stroke_counts() -> None:
    for number in (1, 3):
        samples = recorded().samples.copy()
        last = int(np.flatnonzero(samples["stroke"] == number)[-1])
        samples["flags"][last - 5 :] |= 6
        samples["stroke"][last - 5 : last + 1] = -1
        assert interruptions((replace(recorded(), samples=samples),)).interrupted == 1


def test_a_fault_between_strokes_interrupts_none() -> None:
    samples = recorded().samples.copy()
    between = np.flatnonzero(np.diff(samples["stroke"]) != 0)[0]
    samples["flags"][between : between + 1] |= 6
    samples["stroke"][between - 3 : between + 3] = -1
    assert interruptions((replace(recorded(), samples=samples),)).interrupted == 0


def test_imported_logs_have_no_flags_to_count() -> None:
    plain = replace(with_fault(recorded(), 0), device={})
    assert interruptions((plain,)).strokes == 0
