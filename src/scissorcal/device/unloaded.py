"""Closing strokes in which nothing was cut: told while the capture runs, by its own strokes."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from scissorcal.kernel import StateFlag
from scissorcal.recording import Stroke

LEAST_SHARE = 0.1
"""Of the friction of the return stroke, or of the largest load so far: less cuts nothing. The fit
judges a stroke by the same share (calibration.cut.checks)."""
CUTTING = 0.5
"""Share of a closing stroke, from its end, in which the blades are in the material."""


class LoadWatch:
    """Compares each closing stroke of a cut with the return stroke that follows it.

    A stroke cuts where closing takes more torque than friction alone. Friction is what the blades
    take to open again, over the later half of the return, where they are free of the material.
    Nothing of the rig has to be known: the zeros of its sensors are taken from samples at rest.
    """

    def __init__(self, strokes: Sequence[Stroke], handle_radius_m: float) -> None:
        self._strokes = strokes
        self._radius = handle_radius_m
        self._at = -1
        self._rests: list[NDArray[np.float64]] = []
        self._zero = 0.0
        self._drives: list[NDArray[np.float64]] = []
        self._closing: tuple[Stroke, float] | None = None
        self._largest = 0.0

    def rest(self, samples: NDArray[np.void]) -> None:
        """Take samples with the motors off and nobody at the handles: what they show is zero."""
        off = (samples["flags"] & StateFlag.MOTOR_ENABLED) == 0
        drive = self._drive(samples[off])
        self._rests.append(drive[np.isfinite(drive)])
        known = np.concatenate(self._rests)
        self._zero = float(np.mean(known)) if len(known) else 0.0

    def take(self, samples: NDArray[np.void]) -> list[Stroke]:
        """Take a block of samples; returns closing strokes that turn out to have cut nothing."""
        found = []
        labels = samples["stroke"]
        drive = self._drive(samples) - self._zero
        for part in np.split(np.arange(len(labels)), np.flatnonzero(np.diff(labels)) + 1):
            if len(part) == 0:
                continue
            label = int(labels[part[0]])
            if label != self._at:
                found += self._end()
                self._at = label
            self._drives.append(drive[part])
        return found

    def _drive(self, samples: NDArray[np.void]) -> NDArray[np.float64]:
        drive = samples["motor_torque"] - self._radius * samples["handle_force"]
        return np.asarray(drive, dtype=np.float64)

    def _end(self) -> list[Stroke]:
        """The stroke that was running is over."""
        drives, self._drives = self._drives, []
        if self._at < 0 or not drives:
            return []
        stroke, drive = self._strokes[self._at], np.concatenate(drives)
        later = drive[round((1.0 - CUTTING) * len(drive)) :]
        level = float(np.mean(later)) if len(later) else float("nan")
        if stroke.kind == "closing":
            self._closing = (stroke, -level)
            return []
        if stroke.kind != "opening" or self._closing is None:
            return []
        (closing, resisted), self._closing = self._closing, None
        load = resisted - level
        self._largest = max(self._largest, load)
        return [closing] if load < LEAST_SHARE * max(abs(level), self._largest) else []
