"""What is not used is counted, and says why."""

import dataclasses

import numpy as np
import pytest

from scissorcal.calibration.signals.sensors import inspect_sensors
from scissorcal.calibration.signals.usage import EDGE, GAP, INVALID, SLOW, usage_of_windows
from scissorcal.calibration.signals.weak_form import weigh
from scissorcal.recording import Recording
from tests.calibration.truth import Truth, friction_recording


@pytest.fixture(scope="module")
def recording() -> Recording:
    return friction_recording(Truth(), np.random.default_rng(1))


def test_every_second_is_used_or_has_a_reason(recording):
    samples = recording.samples.copy()
    samples["flags"][5000:5200] = 64
    holed = np.delete(samples, np.r_[9000:9400, 9500:9600])
    one = dataclasses.replace(recording, samples=holed)
    sensors = inspect_sensors((one, recording))
    every = weigh((one, recording), 75.0, sensors.usable)
    usage = usage_of_windows((one, recording), every, sensors.usable)
    for row in usage.rows:
        assert row.used_s + sum(row.reasons.values()) == pytest.approx(row.recorded_s)
    total = sum(row.recorded_s for row in usage.rows)
    assert total == pytest.approx((len(holed) + len(samples)) * 1e-3)
    used = sum(row.used_s for row in usage.rows)
    assert used == pytest.approx(np.count_nonzero(every.bins.moving) * 0.005)
    reasons = {name for row in usage.rows for name in row.reasons}
    assert reasons == {GAP, EDGE, INVALID, SLOW}
    lost = sum(row.reasons.get(GAP, 0.0) for row in usage.rows)
    assert lost == pytest.approx(0.1), "the piece of 0.1 s between the two gaps"
    strokes = {row.stroke for row in usage.rows}
    assert max(strokes) == 2 * len(recording.strokes) - 1


def test_the_speed_that_is_hardly_used_is_named(recording):
    samples = recording.samples.copy()
    slow = min(stroke.speed for stroke in recording.strokes if np.isfinite(stroke.speed))
    lost = np.isin(samples["stroke"], [s.index for s in recording.strokes if s.speed == slow])
    samples["flags"][lost] = 64
    invalid = dataclasses.replace(recording, samples=samples)
    sensors = inspect_sensors((invalid,))
    every = weigh((invalid,), 75.0, sensors.usable)
    sentence = usage_of_windows((invalid,), every, sensors.usable).sentence
    assert f"at {slow:.3g} per s: 0 s of" in sentence
    assert "invalid sensor value" in sentence


def test_spans_are_the_samples_that_are_used(recording):
    samples = recording.samples.copy()
    samples["flags"][5000:5200] = 64
    one = dataclasses.replace(recording, samples=samples)
    sensors = inspect_sensors((one,))
    every = weigh((one,), 75.0, sensors.usable)
    usage = usage_of_windows((one,), every, sensors.usable)
    (spans,) = usage.spans
    assert np.all(spans[:, 0] < spans[:, 1])
    assert np.all(spans[1:, 0] > spans[:-1, 1])
    assert not np.any((spans[:, 0] < 5200) & (spans[:, 1] > 5000))
    in_spans = float(np.sum(spans[:, 1] - spans[:, 0])) * 1e-3
    assert in_spans == pytest.approx(sum(row.used_s for row in usage.rows))
