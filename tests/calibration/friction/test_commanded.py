"""How a commanded force acts: means against integration in small steps, and its lateness found."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from scissorcal.calibration.friction.advance import (
    Actuation,
    as_sliding_joint,
    driven,
    find_actuation,
    force_samples,
    two_tick_means,
)
from scissorcal.recording import SAMPLE_DTYPE, Recording, Stroke

FINE = 2000


def acting(command, delay, lag):
    """The force at FINE points a tick, by small steps of its lag, at the middle of each."""
    held = np.repeat(command, FINE)
    late = np.concatenate([np.zeros(round(delay * FINE)), held])[: len(held)]
    if lag == 0.0:
        return late
    keep, force = np.exp(-1.0 / (FINE * lag)), np.zeros(len(late))
    now = 0.0
    for index, wanted in enumerate(late):
        after = wanted + (now - wanted) * keep
        force[index], now = 0.5 * (now + after), after
    return force


@settings(max_examples=15)
@given(
    st.lists(st.floats(-30.0, 30.0), min_size=4, max_size=8),
    st.integers(0, 3 * FINE).map(lambda steps: steps / FINE),
    st.one_of(st.just(0.0), st.floats(0.05, 6.0)),
)
def test_means_are_those_of_the_force_itself(command, delay, lag):
    force = acting(np.array(command), delay, lag).reshape(-1, FINE)
    rising = (np.arange(FINE) + 0.5) / FINE
    up, down = force @ rising / FINE, force @ (1.0 - rising) / FINE
    exact = down + np.concatenate([[0.0], up[:-1]])
    found = two_tick_means(np.array(command), Actuation(delay, lag))
    np.testing.assert_allclose(found, exact, atol=1e-4)


@given(st.lists(st.floats(-1e3, 1e3), min_size=3, max_size=40), st.floats(0, 6), st.floats(0, 6))
def test_samples_have_the_forces_means(command, delay, lag):
    actuation = Actuation(delay, lag)
    samples = force_samples(np.array(command), actuation)
    means = np.convolve(samples, [1 / 6, 4 / 6, 1 / 6], "same")
    np.testing.assert_allclose(means, two_tick_means(np.array(command), actuation), atol=1e-9)


@given(st.floats(-40.0, 40.0), st.floats(0.0, 6.0), st.floats(0.0, 6.0))
def test_a_command_that_stands_is_the_force(level, delay, lag):
    means = two_tick_means(np.full(200, level), Actuation(delay, lag))
    np.testing.assert_allclose(means[150:], level, atol=1e-9 * abs(level) + 1e-12)


def moved(delay, lag, mass=0.7, coulomb=0.5, seconds=6.0):
    """A recording of a carriage under a wandering command: exact within each small step."""
    rng = np.random.default_rng(3)
    count, small = round(1e3 * seconds), 20
    tones = 2.0 * np.pi * rng.uniform(1.0, 8.0, 12)
    time = np.arange(count) * 1e-3
    command = 2.5 * np.sin(np.outer(time, tones) + rng.uniform(0, 6, 12)).sum(axis=1) / 3.0
    held = np.repeat(command, small)
    late = np.concatenate([np.zeros(round(delay * small)), held])[: len(held)]
    keep = np.exp(-1.0 / (small * lag)) if lag else 0.0
    step, force, rate, place = 1e-3 / small, 0.0, 0.0, 0.0
    places = np.zeros(count)
    for index, wanted in enumerate(late):
        if index % small == 0:
            places[index // small] = place
        before, force = force, wanted + (force - wanted) * keep
        free = rate + step / mass * 0.5 * (before + force)
        after = np.sign(free) * max(abs(free) - step / mass * coulomb, 0.0)
        place, rate = place + 0.5 * step * (rate + after), after
    samples = np.zeros(count, SAMPLE_DTYPE)
    samples["sequence"] = np.arange(count)
    samples["device_time_us"] = np.arange(count) * 1000
    samples["advance"] = np.round(places / 1e-6) * 1e-6
    samples["force_command"] = command
    samples["flags"] = 1
    return Recording("friction-advance", samples, (Stroke(0, "excitation"),), source="a.mcap")


@pytest.mark.parametrize(("delay", "lag"), [(0.0, 1.0), (1.0, 0.0), (0.5, 0.5), (2.0, 1.5)])
def test_delay_and_lag_together_are_found_from_the_motion(delay, lag):
    found = find_actuation((moved(delay, lag),), 25.0)
    assert found.late_ticks == pytest.approx(delay + lag, abs=0.05)


def test_a_recording_without_motion_has_the_usual_lag():
    still = moved(0.0, 1.0)
    still.samples["advance"] = 0.01
    assert find_actuation((still,), 25.0) == Actuation()


def test_samples_with_the_motors_off_are_left_out():
    recording = moved(0.0, 1.0)
    recording.samples["flags"][2000:2150] = 2
    sliding = as_sliding_joint(recording, Actuation())
    assert driven(recording).sum() == len(sliding.samples) == len(recording.samples) - 150
    assert sliding.joint.kind == "linear"
    assert np.isnan(sliding.handle_radius_m)
    np.testing.assert_array_equal(
        sliding.samples["opening"], recording.samples["advance"][driven(recording)]
    )
    assert np.all(sliding.samples["handle_force"] == 0.0)
    assert recording.samples["opening"].max() == 0.0, "the recording itself is left as it is"
