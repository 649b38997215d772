"""What a row costs the filter of a plate's pose, beside a plain yardstick in the same run.

    python -m benchmarks.tracking_rows

The yardstick is NumPy's solution of 24 equations. Both are timed in turns, by the processor's time
of this process, and the medians of many turns are compared, so that a busy machine changes the
ratio little.
"""

import time
from collections.abc import Callable
from itertools import cycle

import numpy as np
from benchmarks.control.plates import probed_surface

from scissorcal.model.surface import Cylinder, Plane, Surface
from scissorcal.tracking.rows import CameraPose
from scissorcal.tracking.tracker import PoseTracker

TURNS, ROWS = 40, 100
LATE_ROWS = 8
"""Contacts at 100 Hz that come between a picture's exposure and its arrival 80 ms later."""


def main() -> None:
    """Print microseconds and ratios."""
    numbers = np.random.default_rng(0).standard_normal((24, 24)) + 24.0 * np.eye(24)
    right = np.ones(24)

    def yardstick() -> None:
        np.linalg.solve(numbers, right)

    print("| row | us | times the solution of 24 equations |")
    print("|---|---|---|")
    surfaces: dict[str, Surface] = {
        "plane": Plane(),
        "cylinder": Cylinder(0.03),
        "probed": probed_surface(),
    }
    for name, surface in surfaces.items():
        print(_line(f"contact, {name}", Fed(surface).contact, yardstick))
    for late in (0, LATE_ROWS):
        fed = Fed(Plane(), late)
        print(_line(f"picture, {late} contacts late", fed.picture, yardstick, fed.between))


class Fed:
    """A tracker with half a second of rows, and the next ones."""

    def __init__(self, surface: Surface, late: int = 0) -> None:
        self._tracker = PoseTracker(surface)
        points = np.random.default_rng(1).uniform(-5e-3, 5e-3, (1000, 3))
        points[:, 2] = -2.5e-4
        self._points = cycle(points)
        self._late, self._time = late, 0.0
        self._tracker.picture(self._pose(0.0))
        for _ in range(60):
            self.contact()

    def _pose(self, time_s: float) -> CameraPose:
        return CameraPose(time_s, np.eye(3), np.zeros(3), 1e-6 * np.eye(6))

    def contact(self) -> None:
        self._time += 0.01
        self._tracker.contact(self._time, next(self._points), 2.5)

    def between(self) -> None:
        """Three contacts: pictures come 33 times a second."""
        for _ in range(3):
            self.contact()

    def picture(self) -> None:
        self._tracker.picture(self._pose(self._time - 0.01 * self._late + 1e-3))


def _line(
    name: str,
    row: Callable[[], None],
    yardstick: Callable[[], None],
    between: Callable[[], None] | None = None,
) -> str:
    timed = [(_seconds(row, between), _seconds(yardstick, None)) for _ in range(TURNS)]
    took, plain = (float(np.median(part)) for part in zip(*timed, strict=True))
    return f"| {name} | {1e6 * took:.0f} | {took / plain:.1f} |"


def _seconds(call: Callable[[], None], between: Callable[[], None] | None) -> float:
    """Processor seconds of one call, without what is done between calls."""
    total = 0.0
    for _ in range(ROWS):
        if between is not None:
            between()
        began = time.process_time_ns()
        call()
        total += time.process_time_ns() - began
    return 1e-9 * total / ROWS


if __name__ == "__main__":
    main()
