"""Work of the material between openings, and its covariance."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from scissorcal.aliases import Array, Integers
from scissorcal.calibration.cut.path_motion import PathMotion, turning_points
from scissorcal.calibration.signals.torque_noise import TorqueNoise
from scissorcal.model import FrictionLaw, friction_torque, presliding_state

DEFAULT_SLOW_TIME_S = 0.012
SURE = 3.0
"""Standard errors from which a difference has a sign: it is wrong once in 740."""


def torque_noise_of(diagnostics: Mapping[str, Any]) -> TorqueNoise:
    """The noise that a friction fit measured; its residual as white noise where it did not."""
    if "noise_white_Nm" in diagnostics:
        return TorqueNoise(
            float(diagnostics["noise_white_Nm"]),
            float(diagnostics["noise_slow_Nm"]),
            float(diagnostics["noise_slow_time_s"]),
        )
    rms = float(diagnostics["residual_rms"])
    return TorqueNoise(rms, rms, DEFAULT_SLOW_TIME_S)


@dataclass(frozen=True)
class Material:
    """What the material does to the opening at each sample (n,).

    ``work`` (J) is what it did so far, ``torque`` (N m) what it does now: the former is summed and
    exact, the latter carries the noise of an acceleration. Where blades rest, friction acts
    along their mean creep: tremor of the smoothed position is noise, whose friction would add up.
    ``direction`` (n - 1,) is how dry friction acts between samples, from -1 (closing) to 1, less
    where it has not built up. ``doubt`` is what friction may be instead, None where it is known.
    """

    work: Array
    torque: Array
    direction: Array
    doubt: "FrictionDoubt | None" = None

    def torque_doubt(self, motion: PathMotion, ends: Integers) -> Array:
        """Covariance (k, k) of mean torques between samples ``ends`` (k + 1,) by that doubt."""
        if self.doubt is None:
            return np.zeros((len(ends) - 1, len(ends) - 1))
        off = self.doubt.work_between(ends) / np.diff(motion.opening[ends])
        return np.asarray(off.T @ off / len(off))


@dataclass(frozen=True)
class FrictionDraws:
    """Friction by k posterior draws: a law with values (k, 1), and the offsets (k, 1).

    ``closing`` and ``opening`` (k, 1) in N m are how far each draw is, at one rate, from the law
    that is taken off; a fit of a cut has offsets for these.
    """

    law: FrictionLaw
    offset: Array
    closing: Array
    opening: Array


@dataclass(frozen=True)
class FrictionDoubt:
    """By how much friction differs along a path (n - 1,) with the draws of its posterior.

    ``taken`` is the friction (N m) that was taken off between samples, ``step`` (rad) the way. It
    is worked out where it is asked for: for all of a long recording it is half a gigabyte.
    """

    draws: FrictionDraws
    middle: Array
    rate: Array
    direction: Array
    taken: Array
    step: Array

    def work_between(self, ends: Integers) -> Array:
        """Differences of the work (draws, k) in J between samples ``ends`` (k + 1,)."""
        span = slice(int(ends[0]), int(ends[-1]))
        rate, draws = self.rate[span], self.draws
        law = built_friction(draws.law, self.middle[span], rate, 0.0, self.direction[span])
        off = law + draws.offset - self.taken[span]
        off -= np.where(rate < 0.0, draws.closing, draws.opening)
        return np.asarray(np.add.reduceat(off * self.step[span], ends[:-1] - ends[0], axis=1))


def material_of(
    motion: PathMotion,
    friction: FrictionLaw,
    offset: float,
    cogging: tuple[float, float, float] = (0.0, 0.0, 0.0),
    fine_rad: float = 0.0,
    draws: FrictionDraws | None = None,
) -> Material:
    """Work and torque of the material along a motion.

    W = I omega^2 / 2 + sum of (F + offset - cog - drive) d(theta), so that between two samples the
    material's mean torque over the path is the difference of W over that of the opening,
    independent of acceleration and speed. ``cogging`` is
    (cosine, sine, periods per turn) of a motor torque that is not in the measured drive.
    ``fine_rad`` is the length over which dry friction builds up where the law lets it jump, if any.
    ``draws`` are what friction may be instead, for the doubt.
    """
    path = motion.opening
    # Friction that builds up takes little work of tremor, and its state follows every turn.
    builds_up = float(np.asarray(friction["presliding_share"])) > 0.0
    turned = path if builds_up else without_tremor(path, SURE * np.sqrt(2.0) * motion.opening_sd)
    step = np.diff(turned)
    middle, rate = 0.5 * (turned[1:] + turned[:-1]), _turning_rate(motion, step)
    direction = built_up(turned, np.sign(rate), friction, fine_rad)
    law = built_friction(friction, middle, rate, 0.0, direction)
    gone = (law + offset) * step - motion.drive[:-1] * np.diff(path)
    work = np.concatenate([[0.0], np.cumsum(gone)]) + 0.5 * motion.inertia * motion.rate**2
    cosine, sine, number = cogging
    if number:
        work = work - (cosine * np.sin(number * path) - sine * np.cos(number * path)) / number
    torque = motion.inertia * np.gradient(motion.rate) / motion.tick_s - motion.drive
    torque[:-1] += law + offset
    doubt = FrictionDoubt(draws, middle, rate, direction, law + offset, step) if draws else None
    return Material(np.asarray(work), np.asarray(torque), np.asarray(direction), doubt)


def built_up(path: Array, sense: Array, friction: FrictionLaw, fine_rad: float) -> Array:
    """How dry friction acts between samples (n - 1,), from -1 to 1.

    The law's share builds up over its length, the rest over ``fine_rad``; without that it has the
    ``sense`` of the motion (n - 1,).
    """

    def between(length: float) -> Array:
        built = presliding_state(path, length)
        return np.asarray(0.5 * (built[1:] + built[:-1]))

    direction = between(fine_rad) if fine_rad > 0.0 else sense
    share = float(np.asarray(friction["presliding_share"]))
    if share > 0.0:
        direction = direction + share * (between(float(friction["presliding_length"])) - direction)
    return np.asarray(direction)


def built_friction(
    friction: FrictionLaw, opening: Array, rate: Array, load: ArrayLike, direction: Array
) -> Array:
    """Friction (n - 1,) whose dry part acts by ``direction`` (n - 1,), as `built_up` gives it."""
    whole = replace(friction, values={**friction.values, "presliding_share": np.asarray(1.0)})
    return friction_torque(whole, opening, rate, load, direction)


def without_tremor(path: Array, least: ArrayLike) -> Array:
    """The opening (n,) by which friction works: turns that are undone within ``least`` are none.

    Friction takes work of every motion, there and back, so what an encoder's steps leave in a
    smoothed path would add up while the blades rest. Where the path comes back within ``least``
    (one number, or (n,)), it goes on instead, midway between how far it was and how far back it
    comes.

    >>> without_tremor(np.array([0.0, 2, 1, 3, 9, 5]), 1.5)
    array([0. , 1.5, 1.5, 3. , 9. , 5. ])
    """
    turns = turning_points(path, least)
    certain = np.array(path)
    for first, last in pairwise([0, *turns, len(path) - 1]):
        onward = 1.0 if path[last] >= path[first] else -1.0
        way = onward * path[first : last + 1]
        back = np.minimum.accumulate(way[::-1])[::-1]
        certain[first : last + 1] = 0.5 * onward * (np.maximum.accumulate(way) + back)
    return certain


def _turning_rate(motion: PathMotion, step: Array) -> Array:
    """Rate (n - 1,) between samples; its mean while the blades rest."""
    rate = step / motion.tick_s
    still = np.concatenate([[False], motion.standing[1:] & motion.standing[:-1], [False]])
    starts, ends = np.flatnonzero(np.diff(still.astype(int))).reshape(-1, 2).T
    for low, high in zip(starts.tolist(), ends.tolist(), strict=True):
        rate[low:high] = rate[low:high].mean()
    return np.asarray(rate)


def mean_torque(motion: PathMotion, work: Array, ends: Integers) -> tuple[Array, Array]:
    """Mean torque (k,) between samples ``ends`` (k + 1,), and what one tick of delay adds to it."""
    path = np.diff(motion.opening[ends])
    span = slice(int(ends[0]), int(ends[-1]))
    late = motion.drive_step[span] * np.diff(motion.opening[span.start : span.stop + 1])
    return np.diff(work[ends]) / path, sums_between(late, ends - ends[0]) / path


def mean_advance(motion: PathMotion, ends: Integers) -> Array:
    """Mean advance (k,) in m over the path between samples ``ends`` (k + 1,)."""
    return np.asarray(advance_line(motion, ends).mean(axis=1))


def advance_line(motion: PathMotion, ends: Integers) -> Array:
    """Advance (k, 2) in m at both ends of the path between samples ``ends`` (k + 1,).

    By the regression line over the opening along the path, within the carriage's range: single
    samples carry the steps of the encoder. Motion of the carriage while the blades rest does not
    count.
    """
    low, high = int(ends[0]), int(ends[-1])
    path, place = motion.opening[low : high + 1], motion.advance[low : high + 1]
    step, gone = np.diff(path), np.diff(place)
    inside, segment = ends - low, np.repeat(np.arange(len(ends) - 1), np.diff(ends))
    still = motion.standing[low:high] & motion.standing[low + 1 : high + 1]
    way, turned = sums_between(step, inside), sums_between(np.where(still, 0.0, step), inside)
    moving = turned * way > 0.5 * way**2
    weight = np.where(moving[segment] & still, 0.0, np.abs(step))
    whole = sums_between(weight, inside)
    middle, advance = 0.5 * (path[1:] + path[:-1]), 0.5 * (place[1:] + place[:-1])
    centre, mean = (sums_between(x * weight, inside) / whole for x in (middle, advance))
    away, beyond = middle - centre[segment], advance - mean[segment]
    # linear motion between samples adds a twelfth of a step's product
    spread = sums_between((away**2 + step**2 / 12.0) * weight, inside)
    slope = sums_between((beyond * away + gone * step / 12.0) * weight, inside) / spread
    first, last = motion.opening[ends[:-1]] - centre, motion.opening[ends[1:]] - centre
    line = np.stack([mean + slope * first, mean + slope * last], axis=1)
    half_step = np.sqrt(3.0) * motion.advance_sd
    least = np.minimum(np.minimum.reduceat(place[:-1], inside[:-1]), place[inside[1:]])
    most = np.maximum(np.maximum.reduceat(place[:-1], inside[:-1]), place[inside[1:]])
    return np.clip(line, least[:, None] - half_step, most[:, None] + half_step)


def sums_between(values: Array, ends: Integers) -> Array:
    """Sums (k,) of values from each of the samples ``ends`` (k + 1,) up to the next."""
    return np.asarray(np.add.reduceat(values[: ends[-1]], ends[:-1]))


def kinetic_variance(motion: PathMotion, ends: Integers) -> Array:
    """Variance (k,) in J^2 of the kinetic energy at samples ``ends`` (k,), by the rate's error."""
    sd = motion.rate_sd[ends]
    by_rate = (motion.inertia * motion.rate[ends] * sd) ** 2
    return np.asarray(by_rate + (0.5 * motion.inertia * sd**2) ** 2)


def torque_covariance(
    motion: PathMotion, ends: Integers, noise: TorqueNoise, offset_sd: float
) -> Array:
    """Covariance (k, k) of the mean torques between samples ``ends`` (k + 1,).

    The drive's noise summed along the path, the rate's error in the kinetic energy at both ends of
    a segment (shared by neighbours), and an offset that all segments have in common.
    """
    low, high = int(ends[0]), int(ends[-1])
    count = len(ends) - 1
    step = np.diff(motion.opening[low : high + 1])
    rows = np.zeros((count, high - low))
    for k in range(count):
        inside = slice(int(ends[k]) - low, int(ends[k + 1]) - low)
        rows[k, inside] = step[inside]
    times = np.arange(high - low) * motion.tick_s
    memory = np.exp(-np.abs(times[:, None] - times[None, :]) / noise.slow_time_s)
    gamma = noise.slow_Nm**2 * memory + noise.white_Nm**2 * np.eye(high - low)
    covariance = rows @ gamma @ rows.T
    energy = kinetic_variance(motion, ends)
    difference = np.eye(count, count + 1, 1) - np.eye(count, count + 1)
    covariance += (difference * energy) @ difference.T
    path = np.diff(motion.opening[ends])
    return np.asarray(covariance / np.outer(path, path) + offset_sd**2)
