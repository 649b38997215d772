"""Segments of a recording of cuts: cracks at rest, and running cracks.

On each sheet the blades close and open again. While they open, and until they have closed far
enough again, the crack rests: the torque is elastic, and one place of the crack (a rest) holds for
unloading and loading. Beyond, the crack runs.
"""

from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np

from scissorcal.aliases import Array, Integers
from scissorcal.calibration.cut.geometry import Geometry
from scissorcal.calibration.cut.guess import (
    ELASTIC_SEGMENTS,
    LEAST_RANGE_RAD,
    Guess,
    Rest,
    left_for_good,
    place_at_turn,
    placed_by_loading,
    shortest_segment,
)
from scissorcal.calibration.cut.known import MaterialData
from scissorcal.calibration.cut.path_motion import (
    FEWEST_SEGMENTS,
    PathMotion,
    Run,
    find_runs,
    split,
)
from scissorcal.calibration.cut.path_work import (
    Material,
    mean_torque,
    sums_between,
    torque_covariance,
)

RUNNING_RAD, SEGMENT_CYCLES = 5e-3, 4.0
"""Least length and least teeth of running segments: in shorter ones the teeth are
fitted as short-range unevenness in place of the long-range one, and intervals get too narrow."""
LOADING_END = 0.88
"""Share of the critical indentation at which loading ends, since weak places crack earlier."""
RUNNING_FROM = 1.6
"""Indentation over the critical one, for a crack at rest, from which running segments count."""
FREE_SHARE = 0.4
"""Path without contact in a piece over its contact's length: it identifies the offset."""
COUNTS_A_TOOTH = 10.0
"""Encoder steps per tooth from which the motion within a tooth is resolved."""
SWINGING = 0.5
"""Standard deviation of the rate over its mean from which blades may turn back: 0.8 to 1 where they
did, 0.2 at most where they did not."""


@dataclass(frozen=True)
class Piece:
    """Elastic segments between the samples ``ends`` (k + 1,) of a motion, all at one rest.

    ``torque`` (k,) is the mean over the path, ``late`` its fall for one tick of delay,
    ``direction`` the mean direction by which friction acts, from -1 (closing) to 1.
    """

    kind: str
    rest: int
    motion: int
    ends: Integers
    torque: Array
    late: Array
    direction: Array
    covariance: Array


@dataclass(frozen=True)
class Stretch:
    """Segments between the samples ``ends`` (k + 1,) of a motion over which the crack runs.

    ``torque`` (k,) is the mean over the path that the carriage's motion leaves, ``path`` (k,) that
    path in rad; ``noise`` (k,) is the variance of the drive's noise in the mean torque.
    ``tooth_sd`` (J) is what a tooth that the segment's end cuts off leaves of its work.
    ``resolved`` is false where the blades may swing back unseen (:func:`swings_unseen`); ``noise``
    then keeps the mean torque from counting, and only the teeth do.
    """

    sheet: int
    motion: int
    ends: Integers
    torque: Array
    late: Array
    direction: Array
    path: Array
    noise: Array
    speed: float
    tooth_sd: float
    resolved: bool = True


@dataclass(frozen=True)
class Segments:
    """The data of a likelihood of cuts.

    ``longest`` (rad) is the loading or unloading with the most segments that an encoder shows,
    ``most_segments`` their number, ``steps`` those of the encoder.
    """

    motions: tuple[PathMotion, ...]
    rests: tuple[Rest, ...]
    pieces: tuple[Piece, ...]
    stretches: tuple[Stretch, ...]
    longest: float = 0.0
    steps: float = 0.0
    most_segments: float = 0.0


def cut_into_segments(
    data: MaterialData, geometry: Geometry, guess: Guess, cuts: bool, unseen: bool = True
) -> Segments:
    """Cut motions with what the material did into segments.

    ``guess`` says where cracks wait and how deep the edge may sink before they run; ``cuts`` is
    false where nothing is cut. A segment with an invalid sample is left out, and without ``unseen``
    so are loadings of cracks that no unloading placed.
    """
    motions, builder = data.motions, _Builder(data, geometry, guess, cuts, unseen)
    sheet: tuple[int, int] | None = None
    for run in find_runs(motions):
        here = (motions[run.motion].recording, run.sheet)
        if here != sheet:
            builder.new_sheet(run.sheet)
            sheet = here
        if run.closing(motions[run.motion]):
            builder.closing(run)
        else:
            builder.opening(run)
    return Segments(
        motions,
        tuple(builder.rests),
        tuple(builder.pieces),
        tuple(builder.stretches),
        builder.longest,
        builder.steps,
        builder.most_segments,
    )


@dataclass
class _Builder:
    """Collects rests, pieces and stretches, run by run."""

    data: MaterialData
    geometry: Geometry
    guess: Guess
    cuts: bool
    unseen: bool
    rests: list[Rest] = field(default_factory=list)
    pieces: list[Piece] = field(default_factory=list)
    stretches: list[Stretch] = field(default_factory=list)
    longest: float = 0.0
    steps: float = 0.0
    most_segments: float = 0.0
    sheets: int = 0
    sheet: int = -1

    def new_sheet(self, sheet: int) -> None:
        self.sheet = self.sheets
        self.sheets += 1
        self.rests.append(Rest(self.sheet, True, 0.0))

    def closing(self, run: Run) -> None:
        """Loading of the crack that waits, then what is cut further."""
        motion = self.data.motions[run.motion]
        span = slice(run.low, run.high + 1)
        if not self.rests[-1].seen and self.rests[-1].placed:
            work = self.data.materials[run.motion].work
            self.rests[-1] = placed_by_loading(
                motion, work, run, self.rests[-1], self.geometry, self.guess
            )
        opening, contact = motion.opening[span], self.rests[-1].place - motion.advance[span]
        depth, _ = self.geometry.depth_and_lever(self.geometry.edge, opening, contact)
        critical = np.full(len(depth), np.inf)
        if self.cuts:
            critical = self.guess.critical_depth(
                self.geometry.slope(opening, contact), self.geometry.moving_blades
            )
        touching = np.flatnonzero(depth > 0.0)
        if len(touching) == 0:
            return
        first = int(touching[0])
        beyond = np.flatnonzero(depth > LOADING_END * critical)
        last = int(beyond[0]) if len(beyond) else len(depth) - 1
        length = abs(float(opening[last] - opening[first]))
        rest = self.rests[-1]
        if length > LEAST_RANGE_RAD and (rest.seen or (self.unseen and rest.placed)):
            begin = first
            while begin > 0 and abs(opening[begin] - opening[first]) < FREE_SHARE * length:
                begin -= 1
            kind = "fresh" if self.rests[-1].fresh else "loading"
            self._piece(kind, run.motion, run.low + begin, run.low + last, length)
        beyond = np.flatnonzero(depth > RUNNING_FROM * critical)
        if len(beyond):
            self._stretch(run, run.low + int(beyond[0]))

    def opening(self, run: Run) -> None:
        """Unloading from where the blades turned; a crack may have come to rest there."""
        motion = self.data.motions[run.motion]
        if self.cuts:
            at_turn = place_at_turn(
                motion,
                self.data.materials[run.motion].work,
                run,
                self.geometry,
                self.guess,
                self.data.noise,
            )
            if at_turn is None:
                return
            turn = float(motion.opening[run.low]), float(motion.advance[run.low])
            place, seen = at_turn
            turned = bool(motion.usable[run.low])
            self.rests.append(Rest(self.sheet, False, place, *turn, seen and turned, turned))
            if not turned:
                return
        span = slice(run.low, run.high + 1)
        opening, contact = motion.opening[span], self.rests[-1].place - motion.advance[span]
        depth, _ = self.geometry.depth_and_lever(self.geometry.edge, opening, contact)
        free = np.flatnonzero(depth < 0.0)
        if len(free) == 0 or depth[0] <= 0.0:
            return
        length = float(opening[free[0]] - opening[0])
        if length < LEAST_RANGE_RAD:
            return
        begin = left_for_good(opening, motion.standing[span], length)
        end = int(free[0])
        while end < len(opening) - 1 and opening[end] < opening[free[0]] + FREE_SHARE * length:
            end += 1
        self._piece("unloading", run.motion, run.low + begin, run.low + end, length)

    def _piece(self, kind: str, index: int, low: int, high: int, length: float) -> None:
        motion = self.data.motions[index]
        way = abs(float(motion.opening[high] - motion.opening[low]))
        shortest = shortest_segment(motion, low, high)
        if way > self.most_segments * shortest:
            self.longest, self.most_segments = way, way / shortest
            self.steps = way / motion.resolution
        ends = split(motion.opening, low, high, max(length / ELASTIC_SEGMENTS, shortest))
        if len(ends) - 1 < FEWEST_SEGMENTS or not np.all(motion.usable[ends[0] : ends[-1] + 1]):
            return
        material = self.data.materials[index]
        torque, late = mean_torque(motion, material.work, ends)
        covariance = torque_covariance(motion, ends, self.data.noise, self.data.offset_sd)
        rest = len(self.rests) - 1
        covariance += material.torque_doubt(motion, ends)
        covariance += np.diag(self._by_opening(motion, ends, self.rests[rest].place) ** 2)
        direction = _mean_direction(motion, material, ends)
        self.pieces.append(Piece(kind, rest, index, ends, torque, late, direction, covariance))

    def _by_opening(self, motion: PathMotion, ends: Integers, place: float) -> Array:
        """Error (k,) in N m of the mean torques by that of the opening, one within a segment."""
        error = np.array([motion.opening_sd[a:b].mean() for a, b in pairwise(ends)])
        middle = 0.5 * (motion.opening[ends[1:]] + motion.opening[ends[:-1]])
        contact = place - 0.5 * (motion.advance[ends[1:]] + motion.advance[ends[:-1]])
        there, back = (
            self.guess.torque(self.geometry, middle + sign * error, contact)[0] for sign in (1, -1)
        )
        return np.asarray(0.5 * (there - back))

    def _stretch(self, run: Run, low: int) -> None:
        """Running segments; one with an invalid sample splits a stretch in two."""
        motion, geometry = self.data.motions[run.motion], self.geometry
        _, period = self.guess.tooth(geometry, motion.opening[low : run.high + 1])
        step = max(RUNNING_RAD, SEGMENT_CYCLES * period)
        all_ends = split(motion.opening, low, run.high, step)
        invalid = np.concatenate([[0], np.cumsum(~motion.usable)])
        for ends in _parts(all_ends, invalid):
            material = self.data.materials[run.motion]
            path, work = free_path(motion, material, geometry, ends)
            turned = np.diff(motion.opening[ends])
            _, late = mean_torque(motion, material.work, ends)
            ticks = np.diff(ends).astype(np.float64)
            noise = np.array(
                [self.data.noise.variance_of_mean(int(n), motion.tick_s) for n in ticks]
            )
            noise += np.diag(material.torque_doubt(motion, ends)) * (turned / path) ** 2
            unseen = swings_unseen(motion, ends, period)
            self.stretches.append(
                Stretch(
                    sheet=self.sheet,
                    motion=run.motion,
                    ends=ends,
                    torque=work / path,
                    late=late * turned / path,
                    direction=_mean_direction(motion, material, ends, by_torque=True),
                    path=path,
                    noise=noise + (work / path) ** 2 if unseen else noise,
                    speed=float(np.median(np.abs(turned) / (ticks * motion.tick_s))),
                    tooth_sd=self.guess.cut_off_tooth(geometry, motion.opening[ends]),
                    resolved=not unseen,
                )
            )


def _parts(ends: Integers, invalid: Integers) -> list[Integers]:
    good = invalid[ends[1:] + 1] == invalid[ends[:-1]]
    parts: list[Integers] = []
    begin = 0
    for index in range(len(good) + 1):
        if index == len(good) or not good[index]:
            if index - begin >= FEWEST_SEGMENTS:
                parts.append(ends[begin : index + 1])
            begin = index + 1
    return parts


def free_path(
    motion: PathMotion, material: Material, geometry: Geometry, ends: Integers
) -> tuple[Array, Array]:
    """Path (k,) in rad between samples ``ends`` with the carriage's share, and the work over it.

    A tooth loads by d(delta) = -(lever d(theta) - m t d(advance)) / m, whether blades close or the
    carriage moves on, so the path of a running crack is d(eta) = d(theta) - (m t / lever)
    d(advance). The torque times the carriage's part of that path is not part of the opening's work.
    """
    low, high = int(ends[0]), int(ends[-1])
    share = carriage_share(motion, geometry, low, high)
    moved = np.diff(motion.advance[low : high + 1]) * share
    path = np.concatenate([[0.0], np.cumsum(np.diff(motion.opening[low : high + 1]) - moved)])
    torque = material.torque[low : high + 1]
    extra = np.concatenate([[0.0], np.cumsum(0.5 * (torque[1:] + torque[:-1]) * moved)])
    at = ends - low
    return np.diff(path[at]), np.diff(material.work[ends]) - np.diff(extra[at])


def _mean_direction(
    motion: PathMotion, material: Material, ends: Integers, by_torque: bool = False
) -> Array:
    """Mean direction (k,) of friction between samples ``ends`` (k + 1,), weighed by the path.

    With ``by_torque`` also by the material's torque: blades move back while it is high.
    """
    low, high = int(ends[0]), int(ends[-1])
    step = np.diff(motion.opening[low : high + 1])
    if by_torque:
        torque = material.torque[low : high + 1]
        step = step * 0.5 * (torque[1:] + torque[:-1])
    signed = sums_between(step * material.direction[low:high], ends - low)
    return np.clip(signed / sums_between(step, ends - low), -1.0, 1.0)


def carriage_share(motion: PathMotion, geometry: Geometry, low: int, high: int) -> Array:
    """Opening (rad) that loads a running crack as one metre of advance does, (high - low,)."""
    knots = np.unique(np.linspace(low, high, max(2, (high - low) // 50 + 2)).astype(np.int64))
    view = geometry.running(motion.opening[knots])
    share = geometry.moving_blades * view.slope / view.lever
    return np.asarray(np.interp(np.arange(low, high), knots, share))


def swings_unseen(motion: PathMotion, ends: Integers, period: float) -> bool:
    """Whether blades may move back between teeth by less than the encoder resolves.

    Slow blades stop or turn at each tooth. Friction then acts over a longer path than the net one:
    with 4 counts a tooth (``period``, rad) it was 0.7 to 1.0 mN m, or 4 %, more than smoothed
    positions say.
    """
    if period > COUNTS_A_TOOTH * motion.resolution:
        return False
    rate = motion.rate[ends[0] : ends[-1] + 1]
    return bool(np.std(rate) > SWINGING * abs(float(np.mean(rate))))
