"""Force or torque over angle, summed up: closed forms, recovery, and how often intervals hold.

Logs are made here, by sums of a few plain terms, with noise, steps, drift and an effect of speed.
"""

import math
from dataclasses import dataclass, replace

import numpy as np
import pytest

from scissorcal.calibration.stroke_intervals import difference_interval, mean_interval, plateau_of
from scissorcal.calibration.summary import (
    BINS,
    LogSummary,
    common_places,
    difference,
    effort_unit,
    friction_of,
    plateau_in,
    slope_in,
    summarise,
)
from scissorcal.errors import InputError
from scissorcal.recording import Joint, Recording, empty_samples, label_strokes

LOW, HIGH = 0.2, 1.0
RATE_HZ = 250.0


@dataclass(frozen=True)
class Made:
    """Torque of closing: ``level`` + ``slope`` (opening - 0.6) + friction; opening: - friction."""

    level: float = 0.10
    slope: float = 0.0
    friction: float = 0.03
    strokes: int = 8
    stroke_sd: float = 0.0
    noise: float = 0.0
    step: float = 0.0
    drift: float = 0.0
    speeds: tuple[float, ...] = (0.8,)
    per_speed: float = 0.0
    sign: float = 1.0


def log(made: Made, seed: int = 0) -> Recording:
    rng = np.random.default_rng(seed)
    opening, torque = [], []
    for number in range(made.strokes):
        speed = made.speeds[number % len(made.speeds)]
        count = round((HIGH - LOW) / speed * RATE_HZ)
        down = np.linspace(HIGH, LOW, count)
        own = rng.normal(0.0, made.stroke_sd) if made.stroke_sd else 0.0
        cut = made.level + made.slope * (down - 0.6) + own + made.drift * number
        cut = cut + made.per_speed * speed + made.friction
        opening += [down, down[::-1]]
        torque += [cut, np.full(count, made.level * 0.0 - made.friction)]
    place = np.concatenate(opening)
    values = made.sign * (np.concatenate(torque) + rng.normal(0.0, 1.0, len(place)) * made.noise)
    if made.step:
        place = np.round(place / made.step) * made.step
    samples = empty_samples(len(place))
    samples["opening"], samples["motor_torque"] = place, values
    samples["device_time_us"] = np.rint(np.arange(len(place)) * 1e6 / RATE_HZ)
    labels = label_strokes(place, samples["device_time_us"] * 1e-6, 0.1)
    samples["stroke"] = labels.stroke_of_sample
    return Recording("cut", samples, labels.strokes, Joint(), source=f"log{seed}.csv")


def summed(*made: Recording) -> tuple[LogSummary, ...]:
    places = common_places(made)
    return summarise([(one, "motor_torque") for one in made], places)


def test_a_plain_log_has_its_closed_form() -> None:
    (found,) = summed(log(Made(slope=-0.05)))
    span = found.places[-1] - found.places[0]
    width = span * BINS / (BINS - 1)
    assert found.mean.value == pytest.approx(0.13, rel=1e-3)
    assert found.work.value == pytest.approx(0.13 * width, rel=1e-3)
    assert slope_in(found).value == pytest.approx(-0.05, rel=1e-3)
    assert (found.mean.strokes, found.left_out, found.turned) == (8, 0, False)
    assert found.opening is not None
    assert found.opening.mean == pytest.approx(np.full(BINS, -0.03), rel=1e-6)
    # Half of closing minus opening: the level of closing alone is halved with it.
    half = friction_of(found)
    assert half is not None
    assert half.value == pytest.approx(0.5 * (0.13 + 0.03), rel=1e-3)


def test_the_blank_gives_friction_and_the_difference_the_cut() -> None:
    cut, blank = summed(log(Made()), log(Made(level=0.0)))
    apart = difference(cut, blank, np.random.default_rng(0))
    assert apart.mean.value == pytest.approx(0.10, rel=1e-6)
    assert apart.curve == pytest.approx(np.full(BINS, 0.10), rel=1e-6)
    assert apart.excludes_zero is True
    friction = friction_of(blank)
    assert friction is not None
    assert friction.value == pytest.approx(0.03, rel=1e-6)


def test_a_sign_that_is_the_other_way_round_is_changed_and_told() -> None:
    (found,) = summed(log(Made(sign=-1.0)))
    assert found.turned
    assert found.mean.value == pytest.approx(0.13, rel=1e-3)


def test_speeds_are_classes_of_their_own() -> None:
    (found,) = summed(log(Made(speeds=(0.4, 1.2), per_speed=0.02)))
    closing = [one for one in found.speeds if one.kind == "closing"]
    assert [round(one.speed, 1) for one in closing] == [0.4, 1.2]
    assert [one.level.value for one in closing] == pytest.approx([0.138, 0.154], rel=1e-3)
    assert [one.level.strokes for one in closing] == [4, 4]


def test_a_class_holds_speeds_of_at_most_its_factor() -> None:
    (found,) = summed(log(Made(speeds=(0.5, 0.65, 0.85, 1.1))))
    closing = [one for one in found.speeds if one.kind == "closing"]
    assert [one.level.strokes for one in closing] == [4, 4]
    assert [one.speed for one in closing] == pytest.approx([0.575, 0.975], rel=0.02)


@pytest.mark.parametrize(("level", "start", "end"), [(1.0, 20, 50), (-0.3, 0, 60), (5e-6, 5, 15)])
def test_a_plateau_is_found_where_it_is(level: float, start: int, end: int) -> None:
    curve = np.linspace(3.0, 9.0, BINS) * abs(level) * np.where(np.arange(BINS) % 2, 1.0, -1.0)
    curve[start:end] = level
    places = np.linspace(0.2, 0.8, BINS)
    assert plateau_of(curve, places) == (start, end)


def test_a_slope_throughout_is_no_plateau() -> None:
    assert plateau_of(np.linspace(1.0, 30.0, BINS), np.linspace(0.0, 1.0, BINS)) is None
    (found,) = summed(log(Made(slope=-1.0, level=0.5)))
    plateau = plateau_in(found, np.random.default_rng(0))
    assert plateau is None or plateau.high - plateau.low < 0.3


def test_fewer_than_three_strokes_have_no_interval() -> None:
    cut, blank = summed(log(Made(strokes=2)), log(Made(level=0.0)))
    assert (cut.mean.low, cut.mean.high, cut.mean.strokes) == (None, None, 2)
    assert cut.drift is None
    apart = difference(cut, blank, np.random.default_rng(0))
    assert (apart.low, apart.mean.low, apart.excludes_zero) == (None, None, None)


def test_equal_strokes_have_an_interval_of_no_width() -> None:
    assert difference_interval(np.ones(4), np.zeros(5)).low == 1.0
    assert mean_interval(np.ones(4)).high == 1.0


@pytest.mark.parametrize(
    ("made", "words"),
    [
        (lambda: [log(Made(level=0.0, friction=0.0))], "motor_torque is constant at 0"),
        (lambda: [_moved(log(Made()), 0.0), _moved(log(Made()), 2.0)], "no common range"),
        (lambda: [_moved(log(Made()), 0.0, 57.3)], "-u opening=deg"),
        (lambda: [_without_strokes(log(Made()))], "has no closing stroke"),
    ],
)
def test_what_cannot_be_summed_up_is_refused(made: object, words: str) -> None:
    with pytest.raises(InputError, match=words):
        summed(*made())  # type: ignore[operator]


def _moved(recording: Recording, by: float, times: float = 1.0) -> Recording:
    recording.samples["opening"] = times * (recording.samples["opening"] + by)
    return recording


def _without_strokes(recording: Recording) -> Recording:
    recording.samples["stroke"] = -1
    return replace(recording, strokes=())


def test_a_force_without_a_lever_stays_a_force() -> None:
    made = log(Made())
    assert math.isnan(made.handle_radius_m)
    assert (effort_unit(made, "handle_force"), effort_unit(made, "motor_torque")) == ("N", "N m")


@pytest.mark.parametrize("level_N", [5.0, -5.0])
def test_a_difference_inside_its_noise_changes_no_sign(level_N: float) -> None:
    """A force sensor that is never below 0, or never above: its strokes differ by more."""
    turned = 0
    for seed in range(200):
        (found,) = summed(one_sided(level_N, seed))
        turned += found.turned
        assert found.mean.value == pytest.approx(level_N, abs=0.5)
    # A chance of 1 / 1,000 each: two or more of 200 once in 57.
    assert turned <= 1
    assert not found.signed
    assert found.sign.low is not None
    assert found.sign.high is not None
    assert found.sign.low < 0.0 < found.sign.high


def one_sided(level_N: float, seed: int) -> Recording:
    """Closing and opening alike but for the noise of a stroke, 0.15 N."""
    made = log(Made())
    rng = np.random.default_rng(seed)
    own = rng.normal(0.0, 0.15, len(made.strokes) + 1)
    made.samples["motor_torque"] = level_N + own[made.samples["stroke"]]
    made.samples["motor_torque"] += rng.normal(0.0, 0.05, len(made.samples))
    return made


def test_one_log_that_knows_its_sign_decides_for_its_channel() -> None:
    made = log(Made(sign=-1.0, stroke_sd=0.001))
    few = log(Made(sign=-1.0, strokes=2))
    known, other = summed(made, few)
    assert (known.turned, other.turned, other.signed) == (True, True, True)
    (alone,) = summed(few)
    assert (alone.turned, alone.signed, alone.sign.low) == (False, False, None)


def test_logs_that_contradict_each_other_keep_their_signs() -> None:
    one, other = summed(log(Made(stroke_sd=0.001)), log(Made(stroke_sd=0.001, sign=-1.0)))
    assert (one.turned, other.turned, one.signed) == (False, False, False)


def test_the_ends_of_a_plateau_have_intervals_that_hold_them() -> None:
    """Level below an opening of 0.6, rising above it; the corner moves from stroke to stroke."""
    made = log(Made(strokes=10, noise=0.002))
    rng = np.random.default_rng(3)
    for stroke in made.strokes:
        own = made.samples["stroke"] == stroke.index
        away = np.maximum(made.samples["opening"][own] - 0.6 - rng.normal(0.0, 0.02), 0.0)
        made.samples["motor_torque"][own] += 3.0 * away
    (found,) = summed(made)
    plateau = plateau_in(found, np.random.default_rng(0))
    assert plateau is not None
    assert plateau.determined
    assert plateau.low_ends is not None
    assert plateau.high_ends is not None
    assert plateau.high_ends[0] < plateau.high_ends[1]
    assert plateau.high_ends[0] <= plateau.high <= plateau.high_ends[1]
    # Half of the 20 % that a plateau may rise, at 3 N m/rad: within 0.6 + 0.01 rad.
    assert plateau.high_ends[0] - 0.05 < 0.61 < plateau.high_ends[1] + 0.05


def test_a_plateau_that_one_stroke_makes_is_not_determined() -> None:
    """Three strokes fall by 1 N m/rad and one rises by 3: their mean is level, by chance."""
    made = log(Made(strokes=4, slope=-1.0, level=0.3))
    first = made.samples["stroke"] <= 1
    made.samples["motor_torque"][first] += 4.0 * (made.samples["opening"][first] - 0.6)
    (found,) = summed(made)
    plateau = plateau_in(found, np.random.default_rng(0))
    assert plateau is not None
    assert plateau.share is not None
    assert plateau.share < 0.9
    assert not plateau.determined


def test_strokes_with_a_hole_are_left_out_and_counted() -> None:
    made = log(Made())
    opening = made.samples["opening"]
    hole = (made.samples["stroke"] == 2) & (opening > 0.5) & (opening < 0.65)
    pair = (made.samples["stroke"] == 4) & (opening > LOW + 0.05) & (opening < HIGH - 0.05)
    kept = replace(made, samples=made.samples[~(hole | pair)])
    (found,) = summed(kept)
    assert (found.holed, found.mean.strokes) == (2, 6)
    assert found.mean.value == pytest.approx(0.13, rel=1e-3)


def test_one_sample_a_stroke_is_refused_with_what_to_do() -> None:
    made = log(Made())
    edge = (made.samples["opening"] < LOW + 0.08) | (made.samples["opening"] > HIGH - 0.08)
    with pytest.raises(InputError, match="log at a higher rate"):
        summed(replace(made, samples=made.samples[edge]))


def test_marks_of_overflow_are_left_out() -> None:
    made = log(Made(noise=0.002))
    made.samples["motor_torque"][::301] = 9999.0
    (found,) = summed(made)
    assert found.mean.value == pytest.approx(0.13, rel=1e-2)


@pytest.mark.slow
def test_intervals_hold_as_often_as_they_state() -> None:
    """90 % intervals of mean, work, slope and difference, over 400 pairs of logs.

    Outside 360 +- 5 binomial standard deviations (6.0) by chance: once in 10^6 for each of four.
    The truth has coloured angle steps, noise, and an effect of speed that is alike in all strokes.
    """
    held = {"mean": 0, "slope": 0, "difference": 0, "work": 0}
    for seed in range(400):
        truth = Made(slope=-0.05, strokes=6, stroke_sd=0.01, noise=0.02, step=0.004)
        other = Made(slope=-0.05, level=0.12, strokes=9, stroke_sd=0.02, noise=0.02, step=0.004)
        one, two = summed(log(truth, 1000 + seed), log(other, 5000 + seed))
        apart = difference(two, one, np.random.default_rng(0))
        middle = float(one.places.mean())
        width = (one.places[1] - one.places[0]) * BINS
        mean = 0.13 - 0.05 * (middle - 0.6)
        for name, found, true in (
            ("mean", one.mean, mean),
            ("work", one.work, mean * width),
            ("slope", slope_in(one), -0.05),
            ("difference", apart.mean, 0.02),
        ):
            assert found.low is not None
            assert found.high is not None
            held[name] += found.low <= true <= found.high
    assert all(330 <= count <= 390 for count in held.values()), held
