"""How long a step of the kernel takes with several sets of tables, measured side by side."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from scissorcal.kernel import Kernel
from scissorcal.package.compile import Compiled, kernel_tables, scene_ranges
from scissorcal.recipe.schema import Recipe

STEPS = 4_000
REPEATS = 21


@dataclass(frozen=True)
class StepTime:
    """Nanoseconds of a step: median, and both quartiles of the repeats.

    ``ratio`` is the median over the repeats of these tables' time over that of the first ones,
    which were timed just before: other work on the computer slows both.
    """

    median: float
    low: float
    high: float
    ratio: float


def step_times(
    tables: Sequence[Compiled], recipe: Recipe, repeats: int = REPEATS
) -> tuple[StepTime, ...]:
    """Time the kernel's step with each, over a stroke that closes and opens the scene's range.

    All take the same steps, many in one call of C, one after the other in each repeat.
    Times are of the processor, on this computer, in this run.
    """
    scene = recipe.scene
    low, high = scene.opening_rad
    half = np.linspace(high, low, STEPS // 2)
    opening = np.concatenate([half, half[::-1]])
    speed = np.sqrt(max(scene.opening_rate_rad_per_s[0], 1e-3) * scene.opening_rate_rad_per_s[1])
    rate = np.concatenate([np.full(STEPS // 2, -speed), np.full(STEPS // 2, speed)])
    advance = np.zeros(STEPS)
    took: list[list[float]] = [[] for _ in tables]
    kernels = [_kernel(table, recipe) for table in tables]
    for _ in range(repeats + 1):
        for kernel, times in zip(kernels, took, strict=True):
            kernel.reset(scene.contact_m[0])
            start = time.thread_time_ns()
            kernel.step_many(opening, rate, advance)
            times.append((time.thread_time_ns() - start) / STEPS)
    found = np.array(took)[:, 1:]
    return tuple(_summary(times, found[0]) for times in found)


def _kernel(compiled: Compiled, recipe: Recipe) -> Kernel:
    return Kernel(kernel_tables(compiled.mechanics, scene_ranges(recipe), compiled.arrays))


def _summary(times: NDArray[np.float64], first: NDArray[np.float64]) -> StepTime:
    ratio = float(np.median(times / first))
    low, median, high = (float(value) for value in np.quantile(times, [0.25, 0.5, 0.75]))
    return StepTime(median, low, high, ratio)
