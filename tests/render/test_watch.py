"""What the supervisor sees of a rendering does not depend on its length or on the blocks' sizes."""

import numpy as np
import pytest

from scissorcal.device import Samples
from scissorcal.kernel import SAMPLE_DTYPE, SampleFlag, StateFlag
from scissorcal.recording import label_strokes
from scissorcal.render import latency_of
from scissorcal.render.result import Watch


def motion(seconds: float, rate_Hz: float = 1000.0, stroke_s: float = 2.0) -> Samples:
    """Strokes between 0.2 and 1.0 rad with noise, and latencies of a busy computer."""
    time = np.arange(round(seconds * rate_Hz)) / rate_Hz
    rng = np.random.default_rng(1)
    samples = np.zeros(len(time), dtype=SAMPLE_DTYPE)
    samples["sequence"] = np.arange(len(time))
    samples["device_time_us"] = np.round(1e6 * time) + 5_000_000
    samples["opening"] = 0.6 + 0.4 * np.cos(2 * np.pi * time / stroke_s)
    samples["opening"] += 1e-3 * rng.uniform(-1, 1, len(time))
    samples["torque_command"] = rng.uniform(-0.1, 0.1, len(time))
    samples["latency_ns"] = np.exp(rng.normal(10.5, 0.5, len(time)))
    return samples


@pytest.mark.parametrize("block", [7, 50, 5000])
def test_figures_are_those_of_the_whole(block: int) -> None:
    samples = motion(20.0)
    samples["flags"][::10] |= int(SampleFlag.TORQUE_LIMITED)
    told: list[str] = []
    watch = Watch(0.1, None, lambda done, sentence: told.append(sentence), 20.0)
    for start in range(0, len(samples), block):
        assert not watch.take(samples[start : start + block])
    labels = label_strokes(samples["opening"], samples["device_time_us"] * 1e-6, 0.1)
    assert watch.strokes == sum(stroke.kind == "closing" for stroke in labels.strokes) == 10
    assert watch.frames == 20_000
    assert watch.limited == 2000
    assert watch.largest_torque == pytest.approx(np.max(np.abs(samples["torque_command"])))
    exact, found = latency_of(samples["latency_ns"]), watch.latency
    assert exact is not None
    assert found is not None
    assert exact.p99 <= found.p99 <= 1.011 * exact.p99
    assert found.worst == pytest.approx(exact.worst)
    assert "10 strokes" in told[-1]


def test_it_ends_once_the_last_stroke_is_made_and_the_blades_rest_open() -> None:
    samples = motion(30.0)
    resting = samples["device_time_us"] > 5_000_000 + 12e6
    samples["opening"][resting] = 1.0
    watch = Watch(0.1, None, lambda done, sentence: None, 60.0)
    watch.wanted = 6
    ended = [watch.take(samples[start : start + 50]) for start in range(0, len(samples), 50)]
    assert 12.5 <= ended.index(True) * 0.05 <= 13.0


def test_an_opening_that_stands_at_the_end_is_told_unless_at_a_stop() -> None:
    samples = motion(10.0)
    samples["opening"][7000:] = 0.5
    watch = Watch(0.1, None, lambda done, sentence: None, 10.0)
    for start in range(0, len(samples), 130):
        watch.take(samples[start : start + 130])
    assert watch.still_s == pytest.approx(2.999, abs=2e-3)
    samples["flags"][7000:] |= int(StateFlag.OPENING_AT_STOP)
    watch = Watch(0.1, None, lambda done, sentence: None, 10.0)
    watch.take(samples)
    assert watch.still_s == 0.0


def test_unusable_places_make_no_stroke() -> None:
    samples = motion(2.0)
    samples["opening"][500:504] = [np.nan, 40.0, -40.0, np.inf]
    samples["flags"][500:504] |= int(SampleFlag.INVALID)
    watch = Watch(0.1, None, lambda done, sentence: None, 2.0)
    watch.take(samples)
    assert watch.strokes == 1


def test_memory_does_not_grow_with_time() -> None:
    watch = Watch(0.1, None, lambda done, sentence: None, 3600.0)
    for start in range(0, 60_000, 50):
        block = motion(0.05)
        block["device_time_us"] += start * 1000
        block["opening"] = 0.5
        watch.take(block)
    held = [value for value in vars(watch).values() if hasattr(value, "__len__")]
    assert max(len(value) for value in held) < 20
