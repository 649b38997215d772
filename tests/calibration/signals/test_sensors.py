"""Sensors: ends of range, dead bands, steps and silence are seen, and nothing where nothing is."""

import dataclasses

import numpy as np
import pytest

from scissorcal.calibration import fit_friction
from scissorcal.calibration.signals.filtering import low_pass
from scissorcal.calibration.signals.sensors import channels_of, inspect_sensors
from scissorcal.recipe import FitFriction
from scissorcal.recording import SAMPLE_DTYPE, Recording, resolution_of
from tests.calibration.truth import QUICK, Truth, friction_recording

SIMPLE = FitFriction(law="coulomb+viscous", symmetry="asymmetric")


@pytest.fixture(scope="module")
def clean() -> Recording:
    return friction_recording(Truth(), np.random.default_rng(1), QUICK)


def changed(recording: Recording, change) -> Recording:
    samples = recording.samples.copy()
    samples["motor_torque"] = change(samples["motor_torque"])
    return dataclasses.replace(recording, samples=samples)


def clipped(recording: Recording, limit: float) -> Recording:
    return changed(recording, lambda torque: np.clip(torque, -limit, limit))


def test_a_clean_recording_keeps_every_sample_and_its_step_is_known(clean):
    found = inspect_sensors((clean,))
    assert np.all(found.usable[0])
    assert found.verdict.status == "pass"
    opening, torque = channels_of(clean)
    assert opening.step == pytest.approx(5e-5)
    assert np.isnan(torque.step)
    assert any("opening has a resolution of 5e-05 rad" in note for note in found.notes)


@pytest.mark.parametrize("seed", range(20))
def test_clean_noise_is_never_called_saturated(seed):
    rng = np.random.default_rng(seed)
    one = friction_recording(Truth(), rng)
    coarse = changed(one, lambda torque: np.round(torque / 2e-4) * 2e-4)
    assert np.all(inspect_sensors((one, coarse)).usable[0])
    assert np.all(inspect_sensors((one, coarse)).usable[1])


def test_saturated_samples_are_found_and_left_out(clean):
    found = inspect_sensors((clipped(clean, 0.0165),))
    torque = np.abs(clean.samples["motor_torque"])
    beyond = torque > 0.0165
    assert np.mean(~found.usable[0][beyond]) > 0.6
    assert not np.any(~found.usable[0][torque < 0.0164])
    assert any("at an end of its range" in note for note in found.notes)


def test_a_fit_to_a_saturated_sensor_fails(clean):
    invalid = clipped(clean, 0.0155)
    fit = fit_friction((invalid,), SIMPLE, effort="draft", rng=np.random.default_rng(2))
    (verdict,) = [v for v in fit.verdicts if v.check == "sensors"]
    assert verdict.status == "fail"
    assert "larger range" in verdict.why
    assert any("at an end of its range" in note for note in fit.notes)


def test_a_dead_band_is_found(clean):
    band = changed(clean, lambda torque: np.where(np.abs(torque) < 0.012, 0.0, torque))
    found = inspect_sensors((band,))
    assert any("a dead band" in note for note in found.notes)
    assert np.mean(~found.usable[0]) > 0.02


def test_a_noiseless_plateau_is_not_called_saturation():
    """Simulated or smoothed data hold a torque exactly; that says nothing about a sensor."""
    time = np.arange(20000) / 1000
    one = friction_recording(Truth(noise=0.0), np.random.default_rng(3))
    held = np.where(np.sin(time) > 0, 0.013, -0.016)
    samples = one.samples[:20000].copy()
    samples["motor_torque"] = held
    found = inspect_sensors((dataclasses.replace(one, samples=samples),))
    assert np.all(found.usable[0])


def test_device_flags_invalidate_samples_and_a_constant_channel_is_named(clean):
    samples = clean.samples.copy()
    samples["flags"][5000:5100] = 64
    samples["motor_torque"] = 0.25
    found = inspect_sensors((dataclasses.replace(clean, samples=samples),))
    assert not np.any(found.usable[0][5000:5100])
    assert any("motor_torque is constant at 0.25 N m" in note for note in found.notes)


def test_a_resolution_is_found_only_in_a_quantised_channel():
    rng = np.random.default_rng(4)
    smooth = np.cumsum(rng.standard_normal(5000))
    assert resolution_of(np.round(smooth / 0.25) * 0.25) == pytest.approx(0.25)
    assert np.isnan(resolution_of(smooth))
    assert np.isnan(resolution_of(np.full(100, 2.0)))


def test_a_note_states_that_near_zero_rates_are_left_out(clean):
    fit = fit_friction((clean,), SIMPLE, effort="draft", rng=np.random.default_rng(5))
    assert any("show the direction" in note for note in fit.notes)


def quantised(recording: Recording, bits: int) -> Recording:
    step = np.ptp(recording.samples["motor_torque"]) / 2**bits
    return changed(recording, lambda torque: np.round(torque / step) * step)


def slow(recording: Recording) -> Recording:
    """A sensor of 20 Hz whose steps are larger than its noise: it repeats 60 % of its values."""
    return quantised(changed(recording, lambda torque: low_pass(torque, 20.0, 1000.0)), 10)


def held(recording: Recording) -> Recording:
    """A sensor that is read ten times for each time that it measures."""
    return changed(recording, lambda torque: np.repeat(torque[::10], 10)[: len(torque)])


def coarse(recording: Recording) -> Recording:
    """Eight bits, which repeat a third of their values."""
    return quantised(recording, 8)


@pytest.mark.parametrize("sensor", [slow, held, coarse])
@pytest.mark.parametrize("share", [0.086, 0.27])
def test_a_sensor_that_repeats_its_values_is_examined_too(clean, sensor, share):
    honest = sensor(clean)
    assert np.all(inspect_sensors((honest,)).usable[0])
    limit = float(np.quantile(np.abs(honest.samples["motor_torque"]), 1.0 - share))
    found = inspect_sensors((clipped(honest, limit),), "fit.cut")
    assert found.verdict.status == "fail"
    assert found.verdict.scope == "fit.cut"
    ends = np.abs(honest.samples["motor_torque"]) >= limit
    assert not np.any(~found.usable[0] & ~ends)
    assert np.mean(~found.usable[0]) > 0.6 * share


@pytest.mark.parametrize("rate_Hz", [200.0, 1000.0, 10000.0])
@pytest.mark.parametrize("bits", [6, 8, 12])
@pytest.mark.parametrize("shape", ["sine", "triangle", "steps", "sweep"])
def test_turns_and_dwells_are_not_called_saturation(rate_Hz, bits, shape):
    """Noiseless and quantised: a sine turns at its extremes, a sweep's torque stays at its ends."""
    time = np.arange(0.0, 20.0, 1.0 / rate_Hz)
    phase = 2 * np.pi * 0.2 * time
    torque = {
        "sine": 0.02 * np.sin(phase),
        "triangle": 0.02 * np.arcsin(np.sin(phase)),
        "steps": 0.01 * np.sign(np.sin(phase)),
        "sweep": 0.012 * np.tanh(30 * np.cos(phase)) * (1.0 + 0.3 * (time > 10)),
    }[shape]
    samples = np.zeros(len(time), SAMPLE_DTYPE)
    samples["device_time_us"] = np.round(time * 1e6)
    samples["opening"] = np.round(np.clip(0.5 + 0.4 * np.sin(phase), 0.2, 0.8) / 5e-5) * 5e-5
    step = 0.04 / 2**bits
    samples["motor_torque"] = np.round(torque / step) * step
    samples["stroke"] = -1
    found = inspect_sensors((Recording("friction", samples, source="a.mcap"),))
    assert np.all(found.usable[0])


@pytest.mark.parametrize("factor", [0.2, 10.0])
def test_saturation_is_found_at_any_sampling_rate(factor):
    """The same motion and noise sampled at 200 Hz and at 10 kHz."""
    clean = friction_recording(Truth(), np.random.default_rng(1))
    samples = clean.samples[:: round(1 / factor)] if factor < 1 else clean.samples
    samples = np.repeat(samples, max(1, round(factor)))
    noise = np.random.default_rng(2).standard_normal(len(samples))
    samples["motor_torque"] += 3e-4 * noise
    samples["device_time_us"] = np.arange(len(samples)) * round(1000 / factor)
    one = dataclasses.replace(clean, samples=samples)
    assert np.all(inspect_sensors((one,)).usable[0])
    found = inspect_sensors((clipped(one, 0.0155),))
    assert found.verdict.status == "fail"


def rig_at_rest_or_in_motion(
    length: int, noise_steps: float, load_N: float, rng: np.random.Generator
) -> Recording:
    """A tared force sensor with steps of 0.01 N and white noise; the load turns with the joint."""
    time = 1e-3 * np.arange(length)
    samples = np.zeros(length, SAMPLE_DTYPE)
    samples["device_time_us"] = 1000 * np.arange(length)
    samples["opening"] = np.round((0.5 + 0.3 * np.sin(0.8 * time)) / 5e-5) * 5e-5
    samples["motor_torque"] = 0.02 * np.cos(0.8 * time) + rng.normal(0.0, 1e-3, length)
    force = load_N * np.tanh(20.0 * np.cos(0.8 * time)) + rng.normal(
        0.0, 0.01 * noise_steps, length
    )
    samples["handle_force"] = np.round(force / 0.01) * 0.01
    samples["stroke"] = -1
    return Recording("friction", samples, source="a.mcap", handle_radius_m=0.06)


def false_alarms(length: int, noise_steps: float, load_N: float, count: int) -> int:
    """Recordings of healthy sensors, seeds from 0 on, of which any sample is called invalid."""
    found = 0
    for seed in range(count):
        rng = np.random.default_rng(seed)
        made = rig_at_rest_or_in_motion(length, noise_steps, load_N, rng)
        found += not np.all(inspect_sensors((made,)).usable[0])
    return found


@pytest.mark.parametrize("load_N", [0.0, 0.05, 0.3])
@pytest.mark.parametrize("noise_steps", [0.5, 1.0, 1.4, 2.0, 3.0])
@pytest.mark.parametrize("length", [3_000, 66_000])
def test_equal_readings_by_chance_are_no_fault_however_long_a_recording(
    length: int, noise_steps: float, load_N: float
) -> None:
    """At 1 in 1,000 recordings one of these 120 fails with a chance of 0.11; none does."""
    assert false_alarms(length, noise_steps, load_N, 4) == 0


@pytest.mark.slow
@pytest.mark.parametrize("noise_steps", [1.4, 2.0, 3.0])
def test_false_alarms_of_a_tared_sensor_are_1_in_1000(noise_steps: float) -> None:
    """Of 1,000 recordings 5 or more are expected in 4 of 1,000 such tests."""
    assert false_alarms(6_000, noise_steps, 0.0, 1000) < 5


@pytest.mark.parametrize("width_N", [0.1, 0.2])
def test_a_dead_band_of_a_noisy_sensor_is_still_found(width_N: float) -> None:
    rng = np.random.default_rng(3)
    made = rig_at_rest_or_in_motion(20_000, 2.0, 0.3, rng)
    samples = made.samples.copy()
    slow = 0.3 * np.sin(1.7 * samples["device_time_us"] * 1e-6)
    force = slow + rng.normal(0.0, 0.02, len(samples))
    force = np.where(np.abs(force) < width_N, 0.0, force)
    samples["handle_force"] = np.round(force / 0.01) * 0.01
    found = inspect_sensors((dataclasses.replace(made, samples=samples),))
    inside = np.abs(slow) < 0.5 * width_N
    assert np.mean(~found.usable[0][inside]) > 0.9
    assert any("a dead band" in note for note in found.notes)


@pytest.mark.parametrize("mark", [9999.0, -32768.0])
def test_marks_of_overflow_are_told_from_measurements(mark: float) -> None:
    rng = np.random.default_rng(4)
    torque = 0.05 * np.sign(np.sin(np.arange(6000) / 300)) + rng.normal(0.0, 0.01, 6000)
    for values, marked in (
        (torque, 0),
        (_marked(torque, mark, 2), 2),
        (_marked(torque, mark, 1), 1),
        (_marked(torque, 3.0, 1), 0),
    ):
        samples = np.zeros(6000, SAMPLE_DTYPE)
        samples["device_time_us"] = np.arange(6000) * 1000
        samples["opening"], samples["motor_torque"] = np.sin(np.arange(6000) / 300), values
        one = Recording("friction", samples, source="a.csv")
        (channel,) = channels_of(one, ("motor_torque",))
        assert channel.marks == ((mark,) if marked else ())
        assert channel.saturated.sum() == marked
        found = inspect_sensors((one,))
        assert found.verdict.status == "pass"
        counted = f"exactly {mark:g} N m in {marked} sample"
        told = [said for said in found.notes if counted in said]
        assert len(told) == (1 if marked else 0)


@pytest.mark.parametrize(("lasting", "marked"), [(1, True), (40, False)])
def test_zero_is_a_level_unless_it_never_lasts(lasting: int, marked: bool) -> None:
    """A motor under load that is let go for 40 ms, and a line that loses single samples."""
    rng = np.random.default_rng(5)
    samples = np.zeros(6000, SAMPLE_DTYPE)
    samples["device_time_us"] = np.arange(6000) * 1000
    samples["opening"] = np.sin(np.arange(6000) / 300)
    torque = 0.5 + rng.normal(0.0, 0.01, 6000)
    for begin in (900, 2300, 4100):
        torque[begin : begin + lasting] = 0.0
    samples["motor_torque"] = torque
    (channel,) = channels_of(Recording("cut", samples), ("motor_torque",))
    assert channel.marks == ((0.0,) if marked else ())


def _marked(values, mark, count):
    other = values.copy()
    other[np.arange(count) * 700 + 50] = mark
    return other


def test_a_level_of_one_direction_is_no_mark() -> None:
    samples = np.zeros(6000, SAMPLE_DTYPE)
    samples["device_time_us"] = np.arange(6000) * 1000
    samples["opening"] = np.sin(np.arange(6000) / 300)
    closing = np.cos(np.arange(6000) / 300) < 0.0
    samples["motor_torque"] = np.where(closing, 0.1 + 0.01 * samples["opening"], -0.1)
    (channel,) = channels_of(Recording("cut", samples), ("motor_torque",))
    assert channel.marks == ()
