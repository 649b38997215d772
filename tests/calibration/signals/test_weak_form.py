"""Windows: the weak form is exact, both sides are treated alike, rests and invalid samples go."""

import dataclasses

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from scissorcal.calibration.friction.columns import FrictionBasis
from scissorcal.calibration.signals.weak_form import next_cutoff, weigh
from scissorcal.errors import InputError
from scissorcal.model import (
    FrictionLaw,
    angle_factor,
    friction_torque,
    law_names,
    presliding_state,
    terms_of,
)
from scissorcal.recording import SAMPLE_DTYPE, Recording


def recording(opening, drive, *, rate_Hz=1000.0, hand=None, commands=None) -> Recording:
    samples = np.zeros(len(opening), SAMPLE_DTYPE)
    samples["device_time_us"] = np.round(np.arange(len(opening)) / rate_Hz * 1e6)
    samples["opening"], samples["motor_torque"] = opening, drive
    samples["stroke"] = -1
    samples["handle_force"] = 0.0 if hand is None else hand
    samples["torque_command"] = 0.0 if commands is None else commands
    radius = float("nan") if hand is None else 0.05
    return Recording("friction", samples, source="motion.mcap", handle_radius_m=radius)


@pytest.mark.parametrize("frequency_Hz", [5, 20, 50])
@pytest.mark.parametrize("cutoff_Hz", [30.0, 75.0, 100.0])
def test_the_equation_of_motion_holds_in_every_window(frequency_Hz, cutoff_Hz):
    """Inertia times acceleration equals the drive to 1e-4 at 20 Hz, where central differences of
    the position are wrong by 5e-3, and to 3e-3 at 50 Hz, where they are wrong by 3e-2."""
    time, omega = np.arange(6000) / 1000, 2 * np.pi * frequency_Hz
    opening = 0.3 * np.sin(omega * time + 0.3)
    windows = weigh((recording(opening, 2.5 * -(omega**2) * opening),), cutoff_Hz)
    away = 2.5 * windows.bins.acceleration - windows.bins.drive
    allowed = {5: 1e-6, 20: 1e-4, 50: 3e-3}[frequency_Hz]
    assert np.abs(away).max() < allowed * np.abs(windows.bins.drive).max()


def test_weights_sum_to_one_and_ignore_what_lies_outside():
    time = np.arange(4000) / 1000
    drive = np.zeros(4000)
    drive[2000] = 1.0
    windows = weigh((recording(np.sin(time), drive),), 75.0)
    assert windows.weights.sum() == pytest.approx(1.0)
    touched = np.flatnonzero(windows.bins.drive)
    covered = (windows.first[touched] <= 2000) & (windows.first[touched] + 15 > 2000)
    assert len(windows.weights) == 15
    assert 0 < len(touched) <= 3
    assert np.all(covered)


def test_the_weights_pass_half_at_the_cutoff():
    for cutoff_Hz in (20.0, 50.0):
        time = np.arange(20000) / 1000
        windows = weigh((recording(np.sin(time), np.cos(2 * np.pi * cutoff_Hz * time)),), cutoff_Hz)
        drive = windows.bins.drive
        assert np.sqrt(2 * np.mean(drive**2)) == pytest.approx(0.5, abs=0.04)


def law_and_values(rng) -> tuple[FrictionLaw, dict[str, float]]:
    low, high = 0.2, 2.0
    values = {
        name: float(rng.uniform(low, high))
        for name in (
            "coulomb_pos",
            "coulomb_neg",
            "viscous_pos",
            "viscous_neg",
            "stribeck",
            "stribeck_rate",
            "angle_slope",
            "angle_curvature",
            "load_share",
            "load_gain",
            "presliding_length",
            "rate^2",
            "sin(opening)",
        )
    }
    values["presliding_share"] = float(rng.uniform(0, 1))
    law = FrictionLaw(values, angle_center=0.4)
    return law, values


@settings(max_examples=10)
@given(seed=st.integers(0, 2**32 - 1))
def test_the_basis_is_the_law_at_every_sample_and_weighed(seed):
    """To 1e-4 of the largest, and 2.5 % of what Stribeck friction lacks after a reversal."""
    rng = np.random.default_rng(seed)
    time = np.arange(3000) / 1000
    opening = 0.5 + 0.3 * np.sin(3 * time) + 0.1 * np.sin(11 * time)
    load = rng.uniform(0.5, 2.0) * np.cos(2 * time)
    windows = weigh((recording(opening, np.sin(time), hand=load / 0.05),), 75.0)
    law, values = law_and_values(rng)
    state = presliding_state(windows.opening, values["presliding_length"])
    exact = friction_torque(law, windows.opening, windows.rate, windows.load, state)
    basis = FrictionBasis(windows, 0.4, terms_of(law_names()[-1], ("rate^2", "sin(opening)")))
    found = basis({name: np.asarray(value) for name, value in values.items()})
    coupled = values["presliding_share"] * values["stribeck"]
    coupled *= np.abs(angle_factor(law, windows.opening)).max()
    allowed = 1e-4 * np.abs(exact).max() + 0.025 * coupled
    assert found == pytest.approx(windows.average(exact), abs=allowed)


def test_steps_count_beside_a_recording_without_any():
    """A log without steps to be seen hides nothing of the steps of another one's encoder."""
    time = np.arange(4000) / 1000
    smooth = recording(np.sin(time), np.sin(time))
    stepped = recording(np.round(np.sin(time) / 1e-3) * 1e-3, np.sin(time))
    assert weigh((smooth,), 75.0).encoder_share == 0.0
    for logs in ((stepped,), (smooth, stepped), (stepped, smooth)):
        windows = weigh(logs, 75.0)
        assert windows.step == pytest.approx(1e-3)
        assert windows.encoder_share > 0.0


def test_windows_that_hold_a_rest_or_a_turn_do_not_count():
    """A swing of 6 rad/s turns seven times in 3.7 s; each turn spoils the windows that hold it."""
    time = np.arange(8000) / 1000
    swing = np.where(time < 4, 0.3 * np.sin(6 * time), 0.3 * np.sin(24.0))
    windows = weigh((recording(np.round(swing / 1e-5) * 1e-5, np.sin(time)),), 75.0)
    bins = windows.bins
    swinging = (bins.time_s > 0.2) & (bins.time_s < 3.7)
    last = windows.first + len(windows.weights)
    turned = [
        np.ptp(np.sign(np.cos(6 * time[low:high]))) > 0
        for low, high in zip(windows.first, last, strict=True)
    ]
    assert not np.any(bins.moving & turned & swinging)
    assert np.mean(bins.moving[swinging & ~np.array(turned)]) > 0.97
    assert not np.any(bins.moving[bins.time_s > 4.2])


def moved_at(rate) -> Recording:
    opening = np.cumsum(rate) / 1000
    return recording(np.round(opening / 1e-5) * 1e-5, np.sin(np.arange(len(rate)) / 1000))


def test_sticking_and_slipping_in_one_direction_is_a_row_of_rests():
    """Touches of zero of 3 ms each, 25 times a second."""
    time = np.arange(8000) / 1000
    bins = weigh((moved_at(0.1 * (1.0 + np.sin(2 * np.pi * 25 * time))),), 75.0).bins
    touching = bins.rate < 0.025
    assert np.count_nonzero(touching) > 100
    assert not np.any(bins.moving[touching])
    assert np.count_nonzero(bins.moving) > 200


def test_windows_with_invalid_samples_do_not_count():
    time = np.arange(4000) / 1000
    one = recording(np.sin(time), np.cos(time))
    usable = np.ones(4000, dtype=bool)
    usable[1000:1010] = False
    windows = weigh((one,), 75.0, (usable,))
    touches = (windows.first < 1010) & (windows.first + 15 > 1000)
    assert not np.any(windows.bins.moving[touches])
    assert np.all(windows.bins.moving[~touches & (windows.bins.rate > 0.5)])


def test_held_drives_are_recognised_by_their_commands():
    time = np.arange(1000) / 1000
    held = recording(np.sin(time), np.cos(time), commands=np.cos(time))
    assert weigh((held,), 75.0).held
    assert not weigh((recording(np.sin(time), np.cos(time)),), 75.0).held


def test_recordings_of_two_rates_are_refused():
    time = np.arange(4000)
    slow = recording(np.sin(time / 250), np.cos(time / 250), rate_Hz=250.0)
    quick = recording(np.sin(time / 1000), np.cos(time / 1000))
    with pytest.raises(InputError, match="different sampling rates"):
        weigh((slow, quick), 75.0)


def test_shorter_windows_end_at_one_sample():
    time = np.arange(1000) / 1000
    one = recording(np.sin(time), np.cos(time))
    assert next_cutoff(weigh((one,), 75.0)) == pytest.approx(91.25)
    assert next_cutoff(weigh((one,), 400.0)) is None


def test_a_gap_is_not_bridged():
    time = np.arange(6000) / 1000
    whole = recording(np.sin(time), np.cos(time))
    holed = dataclasses.replace(whole, samples=np.delete(whole.samples, np.s_[3000:3300]))
    bins = weigh((holed,), 75.0).bins
    assert set(bins.series) == {0, 1}
    assert bins.time_s[bins.series == 1].min() - bins.time_s[bins.series == 0].max() > 0.3
