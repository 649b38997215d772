"""Short gaps are bridged: what lies beside one is kept, and stays what it was.

Motions are made here by closed forms; friction is regressed by least squares.
"""

import numpy as np
import pytest

from scissorcal.calibration.signals.segments import bridge
from scissorcal.calibration.signals.usage import GAP, SLOW, usage_of_windows
from scissorcal.calibration.signals.weak_form import Windows, weigh
from scissorcal.recording import Recording, empty_samples, gap_cost

INERTIA, COULOMB, VISCOUS = 2e-4, 0.05, 0.02


def swinging(
    rate_Hz: float = 1000.0, seconds: float = 20.0, noise: float = 0.0, step: float = 1e-6
) -> Recording:
    """A swing of 0.4 rad at 0.7 Hz with friction of two levels and a slope, without an offset."""
    time = np.arange(round(seconds * rate_Hz)) / rate_Hz
    omega = 2 * np.pi * 0.7
    opening = 0.5 + 0.4 * np.sin(omega * time)
    rate, acceleration = 0.4 * omega * np.cos(omega * time), -0.4 * omega**2 * np.sin(omega * time)
    torque = INERTIA * acceleration + COULOMB * np.sign(rate) + VISCOUS * rate
    samples = empty_samples(len(time))
    samples["device_time_us"] = np.rint(time * 1e6)
    samples["opening"] = np.round(opening / step) * step
    samples["motor_torque"] = torque + noise * np.random.default_rng(1).standard_normal(len(time))
    samples["stroke"] = -1
    return Recording("friction", samples, source="swing.csv")


def holed(recording: Recording, every: int, lost: int, offset: int = 7) -> Recording:
    """The recording without ``lost`` samples in each ``every``."""
    place = (np.arange(len(recording.samples)) - offset) % every
    return Recording("friction", recording.samples[place >= lost], source=recording.source)


def regressed(windows: Windows) -> np.ndarray:
    bins = windows.bins.where(windows.bins.moving)
    columns = np.column_stack([bins.acceleration, np.sign(bins.rate), bins.rate])
    return np.linalg.lstsq(columns, bins.drive, rcond=None)[0]


@pytest.mark.parametrize(
    ("rate_Hz", "every", "lost"),
    [(1000.0, 100, 3), (1000.0, 150, 40), (1000.0, 30, 1), (250.0, 60, 8), (100.0, 30, 2)],
)
def test_friction_beside_gaps_is_that_without_them(rate_Hz: float, every: int, lost: int) -> None:
    recording = swinging(rate_Hz, seconds=60.0)
    whole, parted = (weigh((one,), 75.0) for one in (recording, holed(recording, every, lost)))
    assert regressed(parted) == pytest.approx(regressed(whole), rel=2e-3)
    expected = (INERTIA, COULOMB, VISCOUS)
    assert regressed(parted)[1:] == pytest.approx(expected[1:], rel=0.02)


def test_a_gap_costs_the_windows_that_touch_it_and_no_others() -> None:
    recording = swinging()
    whole, parted = (weigh((one,), 75.0) for one in (recording, holed(recording, 200, 5)))
    gaps = len(recording.samples) // 200
    lost = whole.bins.moving.sum() - parted.bins.moving.sum()
    windows_at_a_gap = (5 + len(whole.weights)) / 5 + 1
    assert 0 < lost <= gaps * windows_at_a_gap
    assert len(parted.starts) == 1, "one piece"


def test_what_is_lost_at_a_gap_is_counted_as_a_gap() -> None:
    one = holed(swinging(), 200, 5)
    usable = (np.ones(len(one.samples), dtype=bool),)
    usage = usage_of_windows((one,), weigh((one,), 75.0), usable)
    (row,) = usage.rows
    assert row.used_s + sum(row.reasons.values()) == pytest.approx(row.recorded_s)
    assert row.reasons[GAP] > 0.5
    assert row.reasons[SLOW] < 1.0
    (spans,) = usage.spans
    assert spans.max() <= len(one.samples)
    assert "gap" in usage.counted


def test_longer_gaps_part_a_recording() -> None:
    one = holed(swinging(), 2000, 51)
    assert len(bridge(one, np.ones(len(one.samples), dtype=bool)).pieces) == 10
    assert len(weigh((one,), 75.0).starts) == 10


def test_made_up_samples_are_not_usable_and_follow_the_motion() -> None:
    recording = swinging()
    one = holed(recording, 500, 40)
    bridged = bridge(one, np.ones(len(one.samples), dtype=bool))
    assert not np.any(bridged.usable & ~bridged.recorded)
    assert np.array_equal(bridged.recording.samples[bridged.recorded], one.samples)
    time = np.asarray(bridged.recording.samples["device_time_us"], dtype=np.int64)
    truth = recording.samples["opening"][time // 1000]
    assert np.all(np.diff(time) == 1000)
    assert bridged.recording.samples["opening"] == pytest.approx(truth, abs=5e-5)


@pytest.mark.parametrize("rate_Hz", [10.0, 64.5, 1000.0])
def test_a_steady_motion_is_not_taken_for_the_step_of_an_encoder(rate_Hz: float) -> None:
    """Floats without a step, in pieces that hold one steady sweep each: all of it moves."""
    time = np.arange(round(60.0 * rate_Hz)) / rate_Hz
    phase = (time / 20.0) % 2.0
    samples = empty_samples(len(time))
    samples["device_time_us"] = np.rint(time * 1e6)
    samples["opening"] = 0.3 * np.where(phase < 1.0, phase, 2.0 - phase) * np.sqrt(2.0)
    samples["opening"] += 1e-7 * np.random.default_rng(0).standard_normal(len(time))
    samples["motor_torque"] = np.sin(time)
    samples["stroke"] = -1
    one = Recording("friction", np.delete(samples, np.arange(0, len(time), len(time) // 9)))
    windows = weigh((one,), 75.0)
    assert windows.bins.moving.mean() > 0.8
    assert windows.bins.rate_floor < 0.005


@pytest.mark.parametrize(
    ("rate_Hz", "every", "lost"),
    [(1000.0, 100, 3), (1000.0, 500, 60), (250.0, 60, 8), (100.0, 30, 2), (64.5, 120, 2)],
)
def test_the_cost_that_an_import_states_is_about_that_of_a_fit(
    rate_Hz: float, every: int, lost: int
) -> None:
    recording = swinging(rate_Hz, seconds=60.0)
    parted = holed(recording, every, lost)
    seconds = []
    for one in (recording, parted):
        usable = (np.ones(len(one.samples), dtype=bool),)
        found = usage_of_windows((one,), weigh((one,), 75.0), usable).lost
        seconds.append(sum(found.values()))
    more = seconds[1] - seconds[0] + seconds[0] * (lost / every)
    assert gap_cost(parted.device_time_s).lost_s == pytest.approx(more, rel=0.35)
