"""What ``recording show`` says is counted right."""

import numpy as np
import pytest

from scissorcal.recording import Joint, Recording, Stroke, summary
from scissorcal.recording.recording import find_gaps
from tests.recording.made import made_recording, made_samples


def test_a_recording_in_numbers() -> None:
    found = summary(made_recording(3000))
    assert found.samples == 3000
    assert found.duration_s == pytest.approx(2.999)
    assert found.rate_Hz == pytest.approx(1000.0)
    assert (found.gaps.places, found.gaps.missing) == (0, 0)
    closing, excitation = found.strokes
    assert (closing.samples, excitation.samples) == (2000, 1000)
    assert closing.travel == pytest.approx(0.6, abs=1e-3)
    ranges = {entry.channel: entry for entry in found.ranges}
    assert ranges["opening"].low == pytest.approx(0.2, abs=1e-3)
    assert ranges["opening"].high == pytest.approx(0.8, abs=1e-3)
    assert ranges["motor_torque"].unit == "N m"


def test_a_linear_joint_has_other_units() -> None:
    ranges = summary(Recording("friction", made_samples(5), joint=Joint("linear"))).ranges
    assert [entry.unit for entry in ranges] == ["m", "m", "N", "N", "N", "N"]


def test_missing_frames_are_counted_across_the_wrap_of_the_counter() -> None:
    samples = made_samples(100)
    keep = np.ones(100, dtype=bool)
    keep[10] = keep[50:55] = False
    samples["sequence"] = (np.arange(100) + 2**32 - 52).astype(np.uint32)
    gaps = find_gaps(samples[keep])
    assert (gaps.places, gaps.missing, gaps.longest) == (2, 6, 5)
    assert gaps.longest_at_s == pytest.approx(0.049)


def test_repeated_and_reordered_frames_are_no_gaps() -> None:
    samples = made_samples(6)
    samples["sequence"] = [1, 2, 2, 3, 1, 4]
    assert find_gaps(samples).missing == 2  # the step from 1 to 4


def test_nothing_recorded_gives_finite_numbers() -> None:
    found = summary(Recording("friction", made_samples(0), (Stroke(0, "closing"),)))
    assert (found.samples, found.duration_s, found.rate_Hz) == (0, 0.0, 0.0)
    assert found.strokes[0].travel == 0.0
    assert all(entry.low == entry.high == 0.0 for entry in found.ranges)
    assert summary(Recording("friction", made_samples(1))).rate_Hz == 0.0


def test_strokes_that_return_to_each_other_are_summed_up_whole() -> None:
    """The samples of a stroke need not lie together, as where a fault interrupted it."""
    samples = made_samples(6)
    samples["stroke"] = [1, -1, 0, 1, 0, 5]
    samples["opening"] = [0.1, 9.0, 0.5, 0.4, 0.3, 0.0]
    strokes = tuple(Stroke(index, "closing") for index in (0, 1, 2))
    found = summary(Recording("cut", samples, strokes)).strokes
    assert [row.samples for row in found] == [2, 2, 0]
    assert [row.travel for row in found] == pytest.approx([0.2, 0.3, 0.0])
