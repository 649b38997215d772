"""Runs of a motion: from one turn of the blades to the next, and even steps along them."""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from scissorcal.aliases import Array, Integers
from scissorcal.calibration.cut.path.motion import PathMotion, turning_points

TURN_RAD = 3e-3
"""A turn that is reversed within this angle is a tremor."""
FEWEST_SEGMENTS = 5


@dataclass(frozen=True)
class Run:
    """Samples ``low`` to ``high`` of a motion between two turns of the blades."""

    motion: int
    sheet: int
    low: int
    high: int

    def closing(self, motion: PathMotion) -> bool:
        return bool(motion.opening[self.high] < motion.opening[self.low])


def find_runs(motions: tuple[PathMotion, ...]) -> list[Run]:
    """Stretches between turns on each sheet, in order of time."""
    runs: list[Run] = []
    for index, motion in enumerate(motions):
        bounds = np.flatnonzero(np.diff(motion.sheet)) + 1
        edges = [0, *bounds.tolist(), len(motion.sheet)]
        for low, high in pairwise(edges):
            sheet = int(motion.sheet[low])
            if sheet < 0 or high - low < 2 * FEWEST_SEGMENTS:
                continue
            turns = [low + t for t in turning_points(motion.opening[low:high], TURN_RAD)]
            ends = [low, *turns, high - 1]
            runs += [
                Run(index, sheet, a, b) for a, b in pairwise(ends) if b - a >= 2 * FEWEST_SEGMENTS
            ]
    return sorted(runs, key=lambda run: (motions[run.motion].recording, run.motion, run.low))


def split(path: Array, low: int, high: int, step: float) -> Integers:
    """Samples from ``low`` on, each ``step`` further along the path than the last."""
    if not step > 0.0:
        raise ValueError(f"segments need a positive length, not {step}")
    away = np.sign(path[high] - path[low]) * (path[low : high + 1] - path[low])
    farthest = np.maximum.accumulate(away)
    ends, at = [low], 0.0
    while True:
        index = int(np.searchsorted(farthest, at + step))
        if index >= len(away):
            return np.array(ends, dtype=np.int64)
        ends.append(low + index)
        at = float(away[index])
