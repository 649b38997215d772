"""Poor logs of a joint end in a fit or in the sentence that names the cause and the remedy.

Logs are made here: a path of plain sums, and a torque of two levels, a slope and noise.
"""

import dataclasses
from collections.abc import Callable, Sequence

import numpy as np
import pytest

from scissorcal.calibration.friction.fit import fit_friction
from scissorcal.calibration.result import FitResult
from scissorcal.errors import InputError
from scissorcal.recipe import FitFriction
from scissorcal.recording import Joint, Recording, empty_samples, label_strokes

COULOMB, VISCOUS = 0.05, 0.02
SIMPLE = FitFriction(law="coulomb+viscous", symmetry="asymmetric", critic=False)


def log(
    *,
    seed: int = 0,
    rate_Hz: float = 1000.0,
    seconds: float = 20.0,
    speeds: Sequence[float] = (0.1, 0.3, 0.8),
    turns_s: float = 1.0,
    drift: float = 0.0,
    step: float = 1e-5,
    noise: float = 0.0,
    source: str = "log.csv",
) -> Recording:
    """Sweeps to and fro, ``turns_s`` each, at one speed after the other."""
    rng, time = np.random.default_rng(seed), np.arange(round(seconds * rate_Hz)) / rate_Hz
    part = np.minimum((time / seconds * len(speeds)).astype(int), len(speeds) - 1)
    wave = np.tanh(20.0 / max(turns_s, 1.0) * np.sin(np.pi * time / turns_s))
    rate = np.asarray(speeds)[part] * wave
    place = 0.5 + np.cumsum(rate) / rate_Hz
    torque = 2e-4 * np.gradient(rate, time) + COULOMB * np.sign(rate) + VISCOUS * rate
    samples = empty_samples(len(time))
    samples["device_time_us"] = np.rint(1e6 * time)
    samples["sequence"] = np.arange(len(time))
    place = place + noise * rng.standard_normal(len(time))
    samples["opening"] = np.round(place / step) * step if step else place
    samples["motor_torque"] = torque + drift * time / seconds + rng.normal(0.0, 0.003, len(time))
    samples["stroke"] = -1
    labels = label_strokes(samples["opening"], time, max(0.3 * min(speeds) * turns_s, 2.0 * step))
    samples["stroke"] = labels.stroke_of_sample
    return Recording("friction", samples, labels.strokes, source=source)


def without(recording: Recording, lost: np.ndarray) -> Recording:
    return dataclasses.replace(recording, samples=recording.samples[~lost])


def fitted(*recordings: Recording) -> FitResult:
    return fit_friction(recordings, SIMPLE, effort="draft", rng=np.random.default_rng(0))


def every(recording: Recording, period: int, lost: int) -> Recording:
    place = np.arange(len(recording.samples)) % period
    return without(recording, place >= period - lost)


GAPS: dict[str, Callable[[], Recording]] = {
    "every 30 ms": lambda: every(log(), 30, 1),
    "half of the time, 30 ms each": lambda: every(log(), 60, 30),
    "slow, 64.5 Hz": lambda: every(
        log(rate_Hz=64.5, seconds=200.0, speeds=(0.003, 0.006, 0.01), turns_s=20.0, step=1e-8),
        90,
        2,
    ),
    "a steady float": lambda: every(
        log(seconds=40.0, turns_s=8.0, speeds=(0.02, 0.1), step=0.0, noise=1e-7), 333, 40
    ),
    "random": lambda: without(log(), np.random.default_rng(1).random(20_000) < 0.01),
}


@pytest.mark.parametrize("name", GAPS)
def test_a_log_with_short_gaps_is_fitted(name: str) -> None:
    fit = fitted(GAPS[name]())
    for way in ("coulomb_pos", "coulomb_neg"):
        found = fit.parameter(way)
        assert found.mean == pytest.approx(COULOMB, abs=max(5.0 * found.sd, 0.02 * COULOMB))
        assert found.sd < 0.1 * COULOMB


def test_most_of_a_steady_log_with_gaps_is_used() -> None:
    """Pieces of a steady sweep have no step of an encoder: the sweep is not hidden by itself."""
    one = GAPS["a steady float"]()
    used = sum(int(np.sum(spans[:, 1] - spans[:, 0])) for spans in fitted(one).used)
    assert used > 0.6 * len(one.samples)


REFUSED: dict[str, tuple[Callable[[], Sequence[Recording]], str]] = {
    "gaps everywhere": (
        lambda: [every(log(), 150, 60)],
        r"log.csv: no stretch without gaps .*There are 133 gaps, the longest of 0.061 s "
        r"\(log.csv at .* s\); the longest stretch between gaps lasts 0.089 s\. Record for longer",
    ),
    "gaps that are short and many": (
        lambda: [every(log(), 8, 4)],
        "log.csv: 0 s of motion are left .*Most of the rest went to gaps.*Of 10 s recorded",
    ),
    "one sample a stroke": (
        lambda: [without(log(), np.arange(20_000) % 500 > 0)],
        "half of the strokes last less than .* log them at a higher rate",
    ),
    "one direction": (
        lambda: [log(turns_s=40.0, speeds=(0.1,))],
        r"one direction only; the negative \(closing\) one is missing",
    ),
    "it always reverses": (
        lambda: [log(turns_s=0.012, speeds=(0.5,), step=1e-6)],
        "The joint turns too soon: half of the strokes last less than 0.012 s",
    ),
    "noise hides the motion": (
        lambda: [log(rate_Hz=100.0, speeds=(0.01,), turns_s=5.0, step=0.0, noise=2e-4)],
        "below .* rad/s, where the position's noise of .* rad does not show its direction",
    ),
    "a coarse encoder hides the motion": (
        lambda: [log(speeds=(0.01, 0.02), turns_s=5.0, step=5e-4)],
        r"where the encoder's step of 0.0005 rad .* does not show its direction",
    ),
    "too short": (
        lambda: [log(seconds=1.0, speeds=(0.3,), turns_s=0.5)],
        "friction needs at least 1 s",
    ),
    "a recording twice": (
        lambda: [log(), log(source="again.csv")],
        "again.csv and log.csv are the same recording",
    ),
    "a recording without strokes twice": (
        lambda: [unlabelled(log()), unlabelled(log(source="again.csv"))],
        "again.csv and log.csv are the same recording",
    ),
    "two joints": (
        lambda: [log(), dataclasses.replace(log(seed=1, source="b.csv"), joint=Joint("linear"))],
        "log.csv is of a rotary joint and b.csv of a linear one",
    ),
    "two handles": (
        lambda: [
            dataclasses.replace(log(), handle_radius_m=0.06),
            dataclasses.replace(log(seed=1, source="b.csv"), handle_radius_m=0.072),
        ],
        "log.csv has a handle radius of 60 mm and b.csv of 72 mm",
    ),
    "two sampling rates": (
        lambda: [log(), log(rate_Hz=250.0, source="b.csv")],
        r"different sampling rates \(log.csv: 1000 Hz, b.csv: 250 Hz\)",
    ),
    "a drift larger than friction": (
        lambda: [log(drift=0.5)],
        r"log.csv: the torque's zero drifts by 0\.4. N m .* more than friction",
    ),
}


def unlabelled(recording: Recording) -> Recording:
    samples = recording.samples.copy()
    samples["stroke"] = -1
    return dataclasses.replace(recording, samples=samples, strokes=())


@pytest.mark.parametrize("name", REFUSED)
def test_a_log_that_tells_nothing_is_refused_with_its_cause(name: str) -> None:
    make, words = REFUSED[name]
    with pytest.raises(InputError, match=words):
        fitted(*make())


def test_one_speed_fails_the_verdict_that_says_so() -> None:
    failed = {one.check: one.why for one in fitted(log(speeds=(0.3,))).rejected}
    assert "record some that differ in it" in failed["strokes"]


def test_two_rigs_fail_the_verdict_that_names_the_recording() -> None:
    other = log(seed=1, source="b.csv")
    samples = other.samples.copy()
    samples["motor_torque"] *= 4.0
    failed = {
        one.check: one.why
        for one in fitted(log(), dataclasses.replace(other, samples=samples)).rejected
    }
    assert "The rig changed between recordings" in failed["recordings"]


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_drift_smaller_than_friction_is_not_refused(sign: float) -> None:
    """Nor is a torque of the wrong sign taken for a drift."""
    one = log(drift=0.02)
    samples = one.samples.copy()
    samples["motor_torque"] *= sign
    fitted(dataclasses.replace(one, samples=samples))
