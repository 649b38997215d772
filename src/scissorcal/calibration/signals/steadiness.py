"""Sweeps in which the blades stuck: how long they rested, and from which speed on they slid."""

from dataclasses import dataclass, replace

import numpy as np

from scissorcal.aliases import Array
from scissorcal.calibration.signals.segments import by_label
from scissorcal.calibration.signals.weak_form import Windows
from scissorcal.recipe.pace import ADVANCE_ACCELERATION, TURN_ACCELERATION, ramp_time
from scissorcal.recording.recording import Joint, Recording
from scissorcal.recording.resolution import noise_of, resolution_of
from scissorcal.verdicts import Check, Verdict

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
