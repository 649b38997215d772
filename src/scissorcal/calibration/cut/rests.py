"""Where cracks rest: by the unloading after a turn, or by the next loading."""

from dataclasses import dataclass, replace

import numpy as np

from scissorcal.aliases import Array, Mask
from scissorcal.calibration.cut.geometry import Geometry
from scissorcal.calibration.cut.guess import Guess
from scissorcal.calibration.cut.path_motion import PathMotion, Run, split
from scissorcal.calibration.cut.path_work import mean_torque
from scissorcal.calibration.signals.torque_noise import TorqueNoise

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
        seen, _ = mean_torque(motion, work, ends)
        middle = 0.5 * (opening[ends[1:]] + opening[ends[:-1]])
        at = place - 0.5 * (motion.advance[ends[1:]] + motion.advance[ends[:-1]])
        expected, by_place = guess.torque(geometry, middle, at)
        step = float(by_place @ (seen - expected)) / max(float(by_place @ by_place), 1e-12)
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
