"""Refuse values that are no measurement; interruptions; sweeps in which the blades stuck."""

import hashlib
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from scissorcal.aliases import Array
from scissorcal.calibration.signals.segments import by_label
from scissorcal.calibration.signals.torque_source import refuse_commanded_torque
from scissorcal.calibration.signals.weak_form import Windows
from scissorcal.errors import InputError
from scissorcal.kernel import StateFlag
from scissorcal.recipe.requirements import ADVANCE_ACCELERATION, TURN_ACCELERATION, ramp_time
from scissorcal.recording.recording import Joint, Recording
from scissorcal.recording.strokes import noise_of, resolution_of
from scissorcal.verdicts import Check, Verdict

LARGEST = 1e100
"""Magnitude from which a value is none of a measurement: the sum of squares of such values may
overflow."""
FEWEST_LEVELS = 20
"""Different torques from which equal strokes are copies: coarse steps alone may repeat."""

_CHANNELS = ("opening", "motor_torque", "handle_force", "advance")


def refuse_unsound(recordings: tuple[Recording, ...]) -> None:
    """Raise InputError for values that are no numbers or absurd, for copies and for two rigs.

    A sensor has noise, so two strokes or recordings never agree to the last digit. A copy would
    count as a second observation, and intervals would come out too narrow by the root of two.
    A torque that a device does not measure is its own command, which says nothing of the load.
    Recordings of joints of two kinds, with handles of two lengths, or of devices with unlike serial
    numbers are not of one rig.
    """
    if not recordings:
        raise InputError("There is no recording to fit: capture or import one first.")
    for recording in recordings:
        if len(recording.samples) < 2:
            raise InputError(
                f"{_name(recording)} holds {len(recording.samples)} samples, in which nothing can "
                "move: record again, or name another file."
            )
        _refuse_values(recording)
        refuse_commanded_torque(recording)
    _refuse_two_rigs(recordings)
    _refuse_copied_recordings(recordings)
    _refuse_copies(recordings)


def farthest_torque(recordings: tuple[Recording, ...]) -> str:
    """The sample whose torque lies farthest from the median of its recording, in words."""
    torques = []
    for recording in recordings:
        torque = np.asarray(recording.samples["motor_torque"], dtype=np.float64)
        away = np.abs(torque - np.median(torque))
        at = int(np.argmax(away))
        words = f"{_name(recording)}, sample {at}: {torque[at]:.4g} N m"
        torques.append((float(away[at]), words))
    return max(torques)[1]


def _refuse_values(recording: Recording) -> None:
    for name in _CHANNELS:
        values = np.asarray(recording.samples[name], dtype=np.float64)
        with np.errstate(invalid="ignore"):
            bad = np.flatnonzero(~(np.abs(values) < LARGEST))
        if len(bad):
            raise InputError(
                f"{_name(recording)}, sample {bad[0]}: {name} is {values[bad[0]]:g}, which is no "
                f"measurement ({len(bad)} such samples in all). Check the sensor and record again, "
                "or export the recording, remove those rows and import the table with gaps allowed."
            )


def _refuse_two_rigs(recordings: tuple[Recording, ...]) -> None:
    """Refuse recordings of two joints, two handles, or devices with unlike serial numbers."""
    first = recordings[0]
    for other in recordings[1:]:
        if other.joint.kind != first.joint.kind:
            raise InputError(
                f"{_name(first)} is of a {first.joint.kind} joint and {_name(other)} of a "
                f"{other.joint.kind} one: one fit is of one rig. Remove the recordings of the "
                "other joint, or keep them in a separate workspace."
            )
        lengths = first.handle_radius_m, other.handle_radius_m
        if np.all(np.isfinite(lengths)) and not np.isclose(*lengths):
            raise InputError(
                f"{_name(first)} has a handle radius of {1e3 * lengths[0]:.4g} mm and "
                f"{_name(other)} of {1e3 * lengths[1]:.4g} mm: one fit is of one rig. Keep the "
                "recordings of each rig in a separate workspace; if it is one rig, import the "
                "log again with --handle-radius-mm."
            )
    rigs = {
        str(
            recording.device["serial"]
        ): f"{_name(recording)} ({recording.device.get('name', 'rig')}, serial number "
        f"{recording.device['serial']})"
        for recording in reversed(recordings)
        if recording.device.get("serial")
    }
    if len(rigs) > 1:
        one, another, *_ = reversed(rigs.values())
        raise InputError(
            f"{one} and {another} are of two rigs, and one fit is of one rig: fit the recordings "
            "of each rig in another workspace, or exclude those of one."
        )


def _refuse_copied_recordings(recordings: tuple[Recording, ...]) -> None:
    sources: dict[bytes, str] = {}
    for recording in recordings:
        motion = [np.asarray(recording.samples[name], dtype=np.float64) for name in _CHANNELS[:3]]
        if len(np.unique(motion[1])) < FEWEST_LEVELS:
            continue
        key = hashlib.sha256(b"".join(channel.tobytes() for channel in motion)).digest()
        if key in sources:
            raise InputError(
                f"{_name(recording)} and {sources[key]} are the same recording: every opening and "
                "torque is equal to the last digit. Remove one of them; it would count as a second "
                "measurement."
            )
        sources[key] = _name(recording)


def _refuse_copies(recordings: tuple[Recording, ...]) -> None:
    keys: dict[bytes, str] = {}
    for recording in recordings:
        stroke = np.asarray(recording.samples["stroke"], dtype=np.int64)
        edges = np.flatnonzero(np.diff(stroke)) + 1
        for low, high in zip([0, *edges], [*edges, len(stroke)], strict=True):
            torque = np.asarray(recording.samples["motor_torque"][low:high], dtype=np.float64)
            if low == high or stroke[low] < 0 or len(np.unique(torque)) < FEWEST_LEVELS:
                continue
            opening = np.asarray(recording.samples["opening"][low:high], dtype=np.float64)
            force = np.asarray(recording.samples["handle_force"][low:high], dtype=np.float64)
            key = hashlib.sha256(opening.tobytes() + torque.tobytes() + force.tobytes()).digest()
            here = f"stroke {stroke[low]} of {_name(recording)}"
            if key in keys:
                raise InputError(
                    f"{here} is a copy of {keys[key]}: every opening and torque is the same to the "
                    "last digit, which no sensor with noise gives twice. Remove the copy; it would "
                    "count as a second measurement."
                )
            keys[key] = here


def _name(recording: Recording) -> str:
    return recording.source or "the recording"


INTERRUPTED = Check(
    "fit interrupted strokes",
    "that strokes are as planned: share of those of one speed in which motors were let go",
    at_most=0.999,
)
"""Share of the strokes of one speed that may be interrupted: one whole stroke shows that speed, and
no plan has a thousand of one."""


@dataclass(frozen=True)
class Interruptions:
    """``interrupted`` of ``strokes`` were, ``worst`` is the largest share of those of one speed.

    ``late`` of them were interrupted because no command came in time.
    """

    strokes: int
    interrupted: int
    worst: float
    late: int

    @property
    def sentence(self) -> str:
        """What happened and what to do; empty where no stroke was interrupted."""
        if not self.interrupted:
            return ""
        remedies = []
        if self.late:
            remedies.append("close programs that load this computer, or give it a faster port")
        if self.late < self.interrupted:
            remedies.append("look up the faults with 'scissorcal recording show'")
        remedy = "; ".join(remedies)
        return (
            f"The device let go of its motors in {self.interrupted} of {self.strokes} strokes, in "
            f"{self.late} of them since commands came late: {remedy}, and record those speeds "
            "again."
        )

    @property
    def decide(self) -> bool:
        """Whether some speed was never recorded as planned."""
        return self.worst > INTERRUPTED.threshold

    def verdict(self, scope: str) -> Verdict:
        """Fails where every stroke of some speed was interrupted; some are *not evaluated*."""
        if self.decide:
            return INTERRUPTED.judge(self.worst, self.sentence).of(scope)
        return INTERRUPTED.not_evaluated(self.sentence, self.worst).of(scope)


def interruptions(recordings: tuple[Recording, ...]) -> Interruptions:
    """Count the strokes of captures during which a fault latched."""
    kinds: dict[tuple[str, float], list[bool]] = {}
    strokes = interrupted = late = 0
    for recording in recordings:
        if not recording.device:
            continue
        hit = _interrupted(recording)
        for stroke in recording.strokes:
            if np.isfinite(stroke.speed):
                kinds.setdefault((stroke.kind, stroke.speed), []).append(stroke.index in hit)
        strokes += len(recording.strokes)
        interrupted += len(hit)
        late += sum(hit.values())
    worst = max((float(np.mean(hits)) for hits in kinds.values()), default=0.0)
    return Interruptions(strokes, interrupted, worst, late)


def _interrupted(recording: Recording) -> dict[int, bool]:
    """Numbers of the strokes in which a fault latched, and whether for want of commands.

    A fault latches in the stroke that goes on after it, or whose sample came last before it.
    """
    label = np.asarray(recording.samples["stroke"], dtype=np.int64)
    flags = np.asarray(recording.samples["flags"], dtype=np.int64)
    faulty = (flags & int(StateFlag.FAULT_LATCHED)) != 0
    latched: NDArray[np.intp] = np.flatnonzero(faulty[1:] & ~faulty[:-1]) + 1
    planned = np.flatnonzero(label >= 0)
    late_strokes: dict[int, bool] = {}
    for at in latched:
        place = int(np.searchsorted(planned, at))
        before = int(label[planned[place - 1]]) if place else -1
        later = int(label[planned[place]]) if place < len(planned) else -1
        if before >= 0 and (before == later or label[at - 1] == before):
            late = bool(flags[at] & int(StateFlag.COMMANDS_LOST))
            late_strokes[before] = late_strokes.get(before, True) and late
    return late_strokes


ENDS = 0.1
"""Share of a stroke's time at either end that is not judged, or the time of its ramp: there blades
speed up, or wait for the torque."""
RESTS_BELOW = 0.25
"""A joint that makes less than this share of its stroke's mean way counts as resting."""
CERTAIN = 8.0
"""Least way over which that is judged, in errors of a difference of two readings: the error is half
of what tells rest from motion."""
LEAST_S = 0.005
"""Least time over which it is judged: half a period of the fastest swings that a fit sees."""
STUCK = 0.05
"""Share of rest from which a stroke counts as stuck. Below it the joint slides, on average, at the
stroke's speed to within so much, and friction is measured there."""
STEADY_SWEEPS = Check(
    "fit.friction steady sweeps",
    "friction at the slowest rates: share of time at rest in the sweeps that rested most",
    at_most=STUCK,
)


@dataclass(frozen=True)
class SpeedSteadiness:
    """Strokes of one speed (rad/s or m/s) together: the share of time that the joint rested."""

    speed: float
    at_rest: float

    @property
    def stuck(self) -> bool:
        """Whether it rested for more than what a steady motion shows."""
        return self.at_rest > STUCK


@dataclass(frozen=True)
class Steadiness:
    """How steadily each speed was slid at, slowest first; empty where no stroke has a speed.

    ``stuck`` are the strokes of stuck speeds, numbered across recordings.
    """

    rows: tuple[SpeedSteadiness, ...]
    stuck: tuple[int, ...]
    joint: Joint

    @property
    def steady_from(self) -> float:
        """Slowest speed above all at which the joint stuck; infinite where there is none."""
        last = max((place for place, row in enumerate(self.rows) if row.stuck), default=-1)
        return self.rows[last + 1].speed if last + 1 < len(self.rows) else float("inf")

    def kept(self, every: Windows) -> Windows:
        """The windows without those of stuck strokes that are slower than ``steady_from``.

        What such strokes show at slower rates is the end of a slip, not sliding. Where no speed was
        steady, all windows are kept, and the verdict fails.
        """
        if not self.stuck or np.isinf(self.steady_from):
            return every
        bins = every.bins
        slips = np.isin(bins.stroke, self.stuck) & (np.abs(bins.rate) < self.steady_from)
        return replace(every, bins=replace(bins, moving=bins.moving & ~slips))

    def verdict(self) -> Verdict:
        """Whether friction was measured at every speed that was swept."""
        worst = max((row.at_rest for row in self.rows), default=0.0)
        if not self.stuck:
            from_speed = min((row.speed for row in self.rows), default=float("nan"))
            good = f"The joint slid in every sweep, from {from_speed:.2g} {self._unit} on."
            return STEADY_SWEEPS.judge(worst, good)
        shares = "; ".join(
            f"{row.at_rest:.0%} at rest: friction at {row.speed:.2g} {self._unit} is not measured"
            for row in self.rows
            if row.stuck
        )
        remedy = (
            "Probe the rig, so that the gains follow from it, and shorten its delay; or leave "
            "these speeds out of the recipe"
        )
        if np.isinf(self.steady_from):
            why = f"{shares}; no faster sweep was steady. {remedy}, and sweep faster."
            return STEADY_SWEEPS.judge(worst, why)
        why = f"{shares}; steady from {self.steady_from:.2g}. {remedy}."
        return STEADY_SWEEPS.not_evaluated(why)

    @property
    def _unit(self) -> str:
        return f"{self.joint.position_unit}/s"


def steadiness(recordings: tuple[Recording, ...]) -> Steadiness:
    """Judge every stroke that a capture planned at a speed by how long the joint rested in it.

    Imported motion has no planned speed and is not judged.

    It rests while it makes less than a quarter of the stroke's mean way, over a time in which that
    way is eight times the error of a difference of two readings (a step of the encoder, or three
    sd of its noise). Shorter rests are not seen.
    """
    rests: dict[float, list[float]] = {}
    numbers: dict[float, list[int]] = {}
    offset = 0
    for recording in recordings:
        inside = by_label(np.asarray(recording.samples["stroke"], dtype=np.int64))
        opening = np.asarray(recording.samples["opening"], dtype=np.float64)
        time = recording.device_time_s
        kind = recording.joint.kind
        for place, stroke in enumerate(recording.strokes if recording.device else ()):
            if np.isfinite(stroke.speed) and stroke.speed > 0.0:
                here = inside.get(stroke.index, np.zeros(0, dtype=np.int64))
                share = _rest_share(opening[here], time[here], kind, stroke.speed)
                if np.isfinite(share):
                    speed = round(stroke.speed, 9)
                    rests.setdefault(speed, []).append(share)
                    numbers.setdefault(speed, []).append(offset + place)
        offset += len(recording.strokes)
    rows = tuple(SpeedSteadiness(speed, float(np.mean(rests[speed]))) for speed in sorted(rests))
    stuck = tuple(number for row in rows if row.stuck for number in numbers[row.speed])
    return Steadiness(rows, stuck, recordings[0].joint if recordings else Joint())


def _rest_share(opening: Array, time: Array, kind: str, speed: float) -> float:
    """Share of a stroke's inner time in which the joint rested; NaN where it is too short.

    ``opening`` and ``time`` (k,) are those of the stroke.
    """
    if len(time) < 3:
        return float("nan")
    tick = float(np.median(np.diff(time)))
    step = resolution_of(opening)
    error = max(step if np.isfinite(step) else 0.0, 3.0 * np.sqrt(2.0) * noise_of(opening))
    lasting = max(LEAST_S, CERTAIN * error / speed)
    if tick <= 0.0:
        return float("nan")
    apart = max(1, int(np.ceil(lasting / tick)))
    acceleration = TURN_ACCELERATION if kind == "rotary" else ADVANCE_ACCELERATION
    left_out = max(ENDS * len(time), ramp_time(speed, acceleration) / tick)
    low, high = round(left_out), len(time) - round(left_out)
    if high - low <= 2 * apart:
        return float("nan")
    sense = 1.0 if opening[-1] >= opening[0] else -1.0
    way = sense * (opening[low + apart : high] - opening[low : high - apart])
    passed = time[low + apart : high] - time[low : high - apart]
    return float(np.mean(way < RESTS_BELOW * speed * passed))
