"""A first estimate of response and fracture, and where cracks rest by it.

A crack's place follows from the unloading after a turn, or from the next loading.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from scissorcal.aliases import Array, Mask
from scissorcal.calibration.cut.geometry import Geometry
from scissorcal.calibration.cut.known import MaterialData
from scissorcal.calibration.cut.path_motion import PathMotion, Run, find_runs, split
from scissorcal.calibration.cut.path_work import Material, mean_torque
from scissorcal.calibration.signals.torque_noise import TorqueNoise
from scissorcal.model import Response
from scissorcal.recipe.priors import LogNormalPrior

LEAST_DEPTH_M = 1e-9


PROFILE_RAD = 1e-3
LONGEST_PROFILE = 80
RELEASED = 0.05
LEAST_TORQUE = 4.0
"""Least torque at a turn, over the scatter of the free motion after it."""
RUNNING_PROFILE_RAD = 10e-3
PLACE_M = 1e-4
"""Unit of the places' corrections in the least squares."""


@dataclass(frozen=True)
class Guess:
    """Response and mean fracture energy (J/m), with the ratio of its peak to the mean.

    ``mean_energy`` is what running costs on average; a crack starts at ``peak_ratio`` times that.
    ``load`` is the share of the torque that friction takes off while the blades open.
    """

    response: Response
    mean_energy: float
    peak_ratio: float = 1.14
    load: float = 0.0

    def critical_depth(self, slope: Array, moving_blades: int) -> Array:
        """Indentation (m) at which a crack starts where the edge has a slope."""
        tangent = np.maximum(slope, 1e-6)
        return self.response.indentation_at(
            self.mean_energy * self.peak_ratio / (moving_blades * tangent)
        )

    def cut_off_tooth(self, geometry: Geometry, opening: Array) -> float:
        """Standard deviation (J) of the work in a part of a tooth, less the part's mean work.

        A sawtooth of height H and period p: H p / sqrt(720), from the variance of (u^2 - 1/4) / 2
        over a cycle. It is evaluated at the guess and held fixed, so that no variance informs
        kappa.
        """
        height, period = self.tooth(geometry, opening)
        return height * period / float(np.sqrt(720.0))

    def tooth(self, geometry: Geometry, opening: Array) -> tuple[float, float]:
        """Height (N m) and period (rad) of a tooth at the middle of some openings."""
        view = geometry.running(np.asarray([float(np.median(opening))]))
        peak = self.mean_energy * self.peak_ratio / (geometry.moving_blades * view.slope)
        kappa = 2.0 / self.peak_ratio - 1.0
        depth = self.response.indentation_at(peak) - self.response.indentation_at(kappa * peak)
        height, period = (
            (1.0 - kappa) * peak * view.lever,
            geometry.moving_blades * depth / view.lever,
        )
        return float(height[0]), float(period[0])

    def torque(self, geometry: Geometry, opening: Array, contact: Array) -> tuple[Array, Array]:
        """Torque (k,) that opening blades show of a standing crack, and its derivative by place."""
        depth, lever = geometry.depth_and_lever(geometry.edge, opening, contact)
        inside = depth > LEAST_DEPTH_M
        held = np.where(inside, depth, LEAST_DEPTH_M)
        force = np.where(inside, self.response.force_at(held), 0.0)
        slope = geometry.slope(opening, contact)
        stiffness = np.where(inside, self.response.stiffness_at(held), 0.0)
        by_place = -stiffness * slope * lever + force * (1.0 + slope**2)
        kept = 1.0 - self.load
        return kept * force * lever, kept * by_place

    def place_at_torque(
        self, geometry: Geometry, opening: float, advance: float, torque: float
    ) -> float:
        """Place (m, sheet's frame) of a crack that gives a torque (N m) at a turn."""
        theta = np.asarray(opening)
        contact = geometry.place(theta, 0.0)
        for _ in range(4):
            _, lever = geometry.depth_and_lever(geometry.edge, theta, contact)
            depth = self.response.indentation_at(
                torque / max(float(lever), 1e-4) / (1.0 - self.load)
            )
            contact = geometry.place(theta, depth)
        return float(contact) + advance


class NoUnloadingError(ValueError):
    """No stroke shows the blades unloading the material, so the response is not identifiable."""


class CoarseEncoderError(ValueError):
    """The blades load and unload the material within too few steps of the encoder."""


def first_guess(
    data: MaterialData, geometry: Geometry, *, cuts: bool, exponent: LogNormalPrior
) -> Guess:
    """Response from unloading alone, mean fracture energy from what closing costs.

    The place where the blades release the sheet needs no model and gives each crack's place;
    force and exponent follow by least squares with those places free. Where nothing is cut the
    place is the sheet's edge. Raises NoUnloadingError where none was seen.
    """
    runs = find_runs(data.motions)
    unloadings = [_unloading(data, run, geometry, cuts) for run in runs]
    pulls = [pull for pull in unloadings if pull is not None]
    if not pulls:
        raise NoUnloadingError("no unloading was seen")
    response = Response("power", *_power_law(pulls, geometry, cuts, exponent), geometry.reference_m)
    if not cuts:
        return Guess(response, np.inf)
    return Guess(response, _running_energy(data, runs, geometry))


@dataclass(frozen=True)
class _Pull:
    opening: Array
    advance: Array
    torque: Array
    place: float


def _profile(
    motion: PathMotion, material: Material, low: int, high: int, step: float
) -> tuple[Array, Array, Array]:
    """Opening, advance and mean torque over even steps of a run."""
    path = motion.opening
    sign = np.sign(path[high] - path[low])
    away = np.maximum.accumulate(sign * (path[low : high + 1] - path[low]))
    ends = low + np.unique(np.searchsorted(away, np.arange(0.0, away[-1], step)))
    if len(ends) < 2:
        return np.zeros(0), np.zeros(0), np.zeros(0)
    torque, _ = mean_torque(motion, material.work, ends)
    middle = 0.5 * (path[ends[1:]] + path[ends[:-1]])
    return middle, 0.5 * (motion.advance[ends[1:]] + motion.advance[ends[:-1]]), torque


def _unloading(data: MaterialData, run: Run, geometry: Geometry, cuts: bool) -> _Pull | None:
    motion = data.motions[run.motion]
    if motion.opening[run.high] <= motion.opening[run.low]:
        return None
    opening, advance, torque = _profile(
        motion, data.materials[run.motion], run.low, run.high, PROFILE_RAD
    )
    opening, advance, torque = (a[:LONGEST_PROFILE] for a in (opening, advance, torque))
    if len(torque) < 12:
        return None
    tail = torque[-len(torque) // 4 :]
    torque = torque - np.median(tail)
    top = float(torque[:2].mean())
    released = np.flatnonzero(torque < RELEASED * top)
    if top < LEAST_TORQUE * float(np.std(tail)) or len(released) == 0 or released[0] < 3:
        return None
    at = int(released[0])
    place = 0.0
    if cuts:
        place = float(geometry.place(opening[at], 0.0)) + float(advance[at])
    kept = slice(0, at + 3)
    return _Pull(opening[kept], advance[kept], torque[kept], place)


def _power_law(
    pulls: list[_Pull], geometry: Geometry, cuts: bool, prior: LogNormalPrior
) -> tuple[float, float]:
    from scipy.optimize import least_squares

    size = float(np.median([pull.torque[0] for pull in pulls]))
    noise = 0.02 * size
    exact = [geometry.depth_and_lever(geometry.edge, p.opening, p.place - p.advance) for p in pulls]
    slopes = [geometry.slope(p.opening, p.place - p.advance) for p in pulls]

    def rows(u: Array) -> tuple[list[Array], list[Array]]:
        """Residuals and, of each, derivatives by log force, log exponent and the pull's place."""
        exponent = np.exp(u[1])
        left, slopes_of = [], []
        for pull, (depth, lever), slope, move in zip(pulls, exact, slopes, u[2:], strict=True):
            by_move = -slope * PLACE_M * cuts
            inside = np.maximum(depth + by_move * move, 0.0)
            torque = np.exp(u[0]) * (inside / geometry.reference_m) ** exponent * lever
            held = np.where(inside > 0.0, inside, geometry.reference_m)
            by_log = torque * exponent * np.log(held / geometry.reference_m)
            by_place = np.where(inside > 0.0, torque * exponent / held * by_move, 0.0)
            left.append((torque - pull.torque) / noise)
            slopes_of.append(np.column_stack([torque, by_log, by_place]) / noise)
        return left, slopes_of

    def misfit(u: Array) -> Array:
        away = [u[2:] / 3.0, (u[1:2] - np.log(prior.median)) / prior.log_sd]
        return np.concatenate([*away, *rows(u)[0]])

    def jacobian(u: Array) -> Array:
        blocks, count = rows(u)[1], len(pulls)
        found = np.zeros((count + 1 + sum(map(len, blocks)), len(u)))
        found[:count, 2:] = np.eye(count) / 3.0
        found[count, 1] = 1.0 / prior.log_sd
        first = count + 1
        for place, block in enumerate(blocks, start=2):
            found[first : first + len(block), [0, 1, place]] = block
            first += len(block)
        return found

    lever = float(np.median([lever[0] for _, lever in exact]))
    starts = [np.log([max(size / lever, 1e-6), n]) for n in (0.7, 1.5, 3.0)]
    starts = [np.concatenate([start, np.zeros(len(pulls))]) for start in starts]
    fits = [
        least_squares(misfit, start, jac=jacobian, loss="soft_l1", max_nfev=40) for start in starts
    ]
    best = min(fits, key=lambda fit: float(fit.cost))
    return float(np.exp(best.x[0])), float(np.exp(best.x[1]))


def _running_energy(data: MaterialData, runs: Sequence[Run], geometry: Geometry) -> float:
    """Median of m t torque / lever over closing, where that is no small share of its largest."""
    energies = []
    for run in runs:
        motion = data.motions[run.motion]
        if motion.opening[run.high] >= motion.opening[run.low]:
            continue
        opening, _, torque = _profile(
            motion, data.materials[run.motion], run.low, run.high, RUNNING_PROFILE_RAD
        )
        if len(opening):
            view = geometry.running(opening)
            energies.append(geometry.moving_blades * view.slope / view.lever * torque)
    energy = np.concatenate(energies) if energies else np.zeros(1)
    large = energy[energy > 0.3 * np.quantile(energy, 0.9)]
    return float(max(np.median(large) if len(large) else 0.0, 1e-6))


ELASTIC_SEGMENTS = 8
"""Segments between touching and the deepest point of an elastic piece."""
PATH_ERROR = 0.06
"""Largest error (sd) of an elastic segment's length, as a share of it. Behind 8,192 counts a turn
the smoothed opening is off by 0.09 of a step, so a segment has 2; unloading paper there has 9."""
PLACING = 2.0
"""Length of the segments that place a crack, in those of a fit, which knows the error of each: with
shorter ones, behind 8,000 counts a turn, an unloading placed a crack 0.3 mm off."""
LEAST_RANGE_RAD, LEAST_SEGMENT_RAD = 1e-3, 3e-4
"""Least contact, and the least segment of one: at 0.3 rad/s a tick of 1 kHz."""
PLACED_AT = 0.75
"""Share of the critical indentation at which a loading shows where its crack rests: the torque of a
running crack tells the critical one whatever the response, and cracks start at 0.88 of it."""
TURN_SHARE, STANDING_SHARE = 0.03, 0.25
"""Shares of the contact's length that are left out after a turn: always, and where the blades
rest, since friction may have either sign there."""
LEAST_TORQUE_SDS = 5.0


@dataclass(frozen=True)
class Rest:
    """A crack at rest: ``place`` (m, sheet's frame) is a first estimate.

    ``opening`` and ``advance`` are where the blades turned; ``fresh`` marks a sheet that is not
    cut yet, whose crack is at 0. ``seen`` is false where the unloading has too few segments (of a
    coarse encoder, or a short contact) or invalid samples, so that the next loading has to show the
    place; ``placed`` where that did not, or the turn itself lies in invalid samples.
    """

    sheet: int
    fresh: bool
    place: float
    opening: float = float("nan")
    advance: float = float("nan")
    seen: bool = True
    placed: bool = True


def place_at_turn(
    motion: PathMotion, work: Array, run: Run, geometry: Geometry, guess: Guess, noise: TorqueNoise
) -> tuple[float, bool] | None:
    """The crack's place by the unloading alone, at the guessed response; whether it is seen.

    None where the torque after the turn is not told from its noise.
    """
    opening, low = motion.opening, run.low
    turn, advance = float(opening[low]), float(motion.advance[low])
    least = LEAST_TORQUE_SDS * float(np.hypot(noise.white_Nm, noise.slow_Nm))
    probe = split(opening, low, run.high, LEAST_RANGE_RAD)[:3]
    if len(probe) < 2:
        return None
    torque, _ = mean_torque(motion, work, probe)
    if torque[0] < least:
        return None
    place = guess.place_at_torque(geometry, turn, advance, float(torque[0]))
    for _ in range(10):
        contact = np.asarray(place - advance)
        depth, lever = geometry.depth_and_lever(geometry.edge, np.asarray(turn), contact)
        length = geometry.moving_blades * max(float(depth), 1e-6) / float(lever)
        span = slice(low, run.high + 1)
        begin = low + left_for_good(opening[span], motion.standing[span], length)
        shortest = max(LEAST_SEGMENT_RAD, PLACING * shortest_segment(motion, low, run.high))
        ends = split(opening, begin, run.high, max(length / ELASTIC_SEGMENTS, shortest))
        ends = ends[opening[ends] < turn + (1.0 + 0.3) * length]
        if len(ends) < 4 or not np.all(motion.usable[low : ends[-1] + 1]):
            return place, False
        measured, _ = mean_torque(motion, work, ends)
        middle = 0.5 * (opening[ends[1:]] + opening[ends[:-1]])
        at = place - 0.5 * (motion.advance[ends[1:]] + motion.advance[ends[:-1]])
        expected, by_place = guess.torque(geometry, middle, at)
        step = float(by_place @ (measured - expected)) / max(float(by_place @ by_place), 1e-12)
        place += float(np.clip(step, -2e-4, 2e-4))
        if abs(step) < 1e-7:
            break
    return place, True


def placed_by_loading(
    motion: PathMotion, work: Array, run: Run, rest: Rest, geometry: Geometry, guess: Guess
) -> Rest:
    """A rest whose crack is where the torque passes that of PLACED_AT of its critical depth.

    A loading that begins beyond, after blades that turned back a little, passes it unseen: where
    the torque comes up to it later, the crack has run in between, and so the rest is not placed.
    """
    shortest = max(LEAST_SEGMENT_RAD, PLACING * shortest_segment(motion, run.low, run.high))
    ends = split(motion.opening, run.low, run.high, shortest)
    if len(ends) < 3:
        return replace(rest, placed=False)
    torque, _ = mean_torque(motion, work, ends)
    opening = 0.5 * (motion.opening[ends[1:]] + motion.opening[ends[:-1]])
    advance = 0.5 * (motion.advance[ends[1:]] + motion.advance[ends[:-1]])
    slope = geometry.slope(opening, rest.place - advance)
    depth = PLACED_AT * guess.critical_depth(slope, geometry.moving_blades)
    reached = (1.0 + guess.load) * guess.response.force_at(depth)
    reached = reached * geometry.depth_and_lever(geometry.edge, opening, rest.place - advance)[1]
    above = np.flatnonzero(torque >= reached)
    if not len(above) or above[0] == 0:
        return replace(rest, placed=False)
    at = int(above[0]) - 1
    if not np.all(motion.usable[run.low : ends[at + 2] + 1]):
        return replace(rest, placed=False)
    short = reached[at : at + 2] - torque[at : at + 2]
    share = float(short[0] / (short[0] - short[1]))
    place = [
        float(geometry.place(np.asarray(opening[k]), float(depth[k]))) + float(advance[k])
        for k in (at, at + 1)
    ]
    return replace(rest, place=place[0] + share * (place[1] - place[0]), placed=True)


def shortest_segment(motion: PathMotion, low: int, high: int) -> float:
    """Least length (rad) of an elastic segment between two samples of a motion."""
    return float(np.sqrt(2.0) * np.median(motion.opening_sd[low : high + 1]) / PATH_ERROR)


def left_for_good(opening: Array, standing: Mask, length: float) -> int:
    """First sample from which blades that turned at the first one stay away from it.

    ``length`` (rad) is that of the contact; blades that rest within its first quarter are
    still at the turn.
    """
    stop = int(np.argmax(opening > opening[0] + length)) or None
    away = opening[:stop] - opening[0]
    there = (away < TURN_SHARE * length) | (standing[:stop] & (away < STANDING_SHARE * length))
    last = np.flatnonzero(there)
    return int(last[-1]) + 1 if len(last) else 0
