"""What a package's tables cost, and how far they are from the exact model."""

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from statistics import median

import numpy as np

from scissorcal.aliases import Array
from scissorcal.kernel import Kernel
from scissorcal.kernel.compiled_step import (
    SLOW_STROKE_rad_per_s,
    StepCost,
    Target,
    compiled_step,
    missing_tools,
)
from scissorcal.package.average import AverageTorque
from scissorcal.package.bound import ExactTorque
from scissorcal.package.compile import Compiled, kernel_tables, scene_ranges
from scissorcal.package.exact import ExactModel
from scissorcal.package.grid import Points, spread_points
from scissorcal.package.tables import hermite
from scissorcal.recipe.schema import Recipe

GRID_POINTS = 8_009
"""Differs from the counts of the bound and of `package check`, so that the places differ."""
RANDOM_POINTS = 10_000
COUNTED_STATES = 300
STROKE_STEPS = 4_000

_BYTES = {"float32": 12, "float64": 24, "int16": 6}
_ROW_BYTES = 3 * 8
"""Offset and scale of three rows in 16 bits, two float32 each."""


@dataclass(frozen=True)
class Timing:
    """Repeats of one measurement: median, least and largest."""

    median: float
    low: float
    high: float


@dataclass(frozen=True)
class Instructions:
    """Executed instructions of a Cortex-M4F: ``loading`` the tables once, then of a step.

    ``stroke`` is the mean step of a slow closing stroke; ``typical`` and ``worst`` are median and
    largest of a step at random states of the scene.
    """

    loading: int
    stroke: int
    typical: int
    worst: int


@dataclass(frozen=True)
class TableCost:
    """Cost of one set of tables.

    ``bytes`` is what a program stores of them, ``ram_bytes`` what it needs besides to use them (a
    table in int16 is decoded once, see docs/decisions/124). ``stroke_ns`` is a step of a slow
    closing stroke on this computer, ``random_ns`` the settled torque at random states; None where
    ``not_timed`` says why. ``instructions`` likewise, with ``not_counted``.
    """

    knots: dict[str, int]
    bytes: int
    ram_bytes: int
    stroke_ns: Timing | None
    random_ns: Timing | None
    not_timed: str
    instructions: Instructions | None
    not_counted: str


@dataclass(frozen=True)
class TableError:
    """Deviation of the rendered mean torque from the exact model, in N m, over ``places``."""

    average_Nm: float
    worst_Nm: float
    places: int


@dataclass(frozen=True)
class CostAndError:
    """Cost of tables, and their error on an even grid of the scene and at random states.

    ``scene_torque_Nm`` is the largest torque of the exact model on the grid.
    """

    cost: TableCost
    grid: TableError | None
    random: TableError | None
    scene_torque_Nm: float


def cost_and_error(
    model: ExactModel,
    recipe: Recipe,
    compiled: Compiled,
    rng: np.random.Generator,
    *,
    repeats: int = 9,
    count_instructions: bool = True,
) -> CostAndError:
    """Measure tables: bytes, time of a step here, instructions on a Cortex-M4F, and error.

    ``compiled`` are tables of ``model`` as `compile_model` makes them, in any number format. Steps
    are timed in C, many states to a call, ``repeats`` times. Tables in float64 are evaluated by the
    same core compiled in double, which needs a C compiler; without one they have no time and no
    error. Instructions are counted under qemu (2 s), where it and its compiler are installed.
    The error's places are no place at which tables were fitted or their bound was measured.
    """
    scene = scene_ranges(recipe)
    friction = compiled.mechanics.friction
    slowest = friction.rate_eps_rad_per_s if friction else 0.0
    even = spread_points(scene, GRID_POINTS, slowest)
    drawn = _random_points(even, rng)
    limit = recipe.limits.torque_Nm
    exact = [ExactTorque.at(model, points, limit) for points in (even, drawn)]
    double = any(array.dtype == np.float64 for array in compiled.arrays.values())
    time_and_compare = _in_double if double else _in_float
    stroke, random, away, reason = time_and_compare(compiled, recipe, exact, repeats)
    instructions, not_counted = None, "not asked for"
    if count_instructions:
        instructions, not_counted = _instructions(compiled, recipe, drawn, double)
    cost = TableCost(
        knots={_name(file): array.shape[1] for file, array in compiled.arrays.items()},
        bytes=table_bytes(compiled),
        ram_bytes=sum(12 * compiled.arrays[file].shape[1] for file in compiled.rows),
        stroke_ns=stroke,
        random_ns=random,
        not_timed=reason,
        instructions=instructions,
        not_counted=not_counted,
    )
    grid, at_random = (_error(part) for part in away) if away else (None, None)
    return CostAndError(cost, grid, at_random, float(np.max(np.abs(exact[0].torque))))


def table_bytes(compiled: Compiled) -> int:
    """Bytes of the tables as a program stores them: 12 a knot, 6 and their rows in int16."""
    return sum(
        bytes_of(array.shape[1], "int16" if file in compiled.rows else str(array.dtype))
        for file, array in compiled.arrays.items()
    )


def bytes_of(knots: int, number_format: str) -> int:
    """Bytes of one table.

    >>> bytes_of(10, "float32"), bytes_of(10, "int16")
    (120, 84)
    """
    return _BYTES[number_format] * knots + (_ROW_BYTES if number_format == "int16" else 0)


Measured = tuple[Timing | None, Timing | None, list[Array], str]


def _in_float(
    compiled: Compiled, recipe: Recipe, exact: list[ExactTorque], repeats: int
) -> Measured:
    """Time and deviations of the package's own kernel."""
    scene = scene_ranges(recipe)
    kernel = Kernel(kernel_tables(compiled.mechanics, scene, compiled.arrays))
    low, high = scene.opening_rad
    opening = np.linspace(high, low, STROKE_STEPS).astype(np.float32)
    rate = np.full(STROKE_STEPS, -SLOW_STROKE_rad_per_s, dtype=np.float32)
    advance = np.zeros(STROKE_STEPS, dtype=np.float32)
    points = exact[-1].points

    def stroke() -> None:
        kernel.reset(scene.contact_m[0])
        kernel.step_many(opening, rate, advance)

    def random() -> None:
        kernel.torque(points.opening, points.opening_rate, points.contact)

    average = AverageTorque(compiled.mechanics, scene, compiled.arrays)
    away = [part.deviation(average) for part in exact]
    return (
        _timed(stroke, STROKE_STEPS, repeats),
        _timed(random, len(points.opening), repeats),
        away,
        "",
    )


def _in_double(
    compiled: Compiled, recipe: Recipe, exact: list[ExactTorque], repeats: int
) -> Measured:
    """Time and deviations of the core compiled in double for this computer."""
    if reason := missing_tools("host"):
        return None, None, [], reason
    even, drawn = (part.points for part in exact)
    found = _compiled(compiled, recipe, even.joined(drawn), "host", double=True, runs=repeats)
    parts = np.split(found.torque, [len(even.opening)])
    away = [one.away(torque) for one, torque in zip(exact, parts, strict=True)]
    return _spread(found.stroke), _spread(found.settled), away, ""


def _error(away: Array) -> TableError:
    return TableError(float(np.mean(away)), float(np.max(away)), len(away))


def _instructions(
    compiled: Compiled, recipe: Recipe, points: Points, double: bool
) -> tuple[Instructions | None, str]:
    if reason := missing_tools("cortex-m4f"):
        return None, reason
    first = points.at(np.arange(min(COUNTED_STATES, len(points.opening))))
    found = _compiled(compiled, recipe, first, "cortex-m4f", double=double)
    typical = int(np.median(found.states))
    return Instructions(found.loading, found.stroke[0], typical, int(found.states.max())), ""


def _compiled(
    compiled: Compiled,
    recipe: Recipe,
    points: Points,
    target: Target,
    *,
    double: bool,
    runs: int = 1,
) -> StepCost:
    tables = kernel_tables(compiled.mechanics, scene_ranges(recipe), compiled.arrays)
    mean = compiled.arrays.get("tables/mean_energy.npy")
    energy = np.full(len(points.opening), tables.fracture_energy)
    if mean is not None:
        held = np.clip(points.opening, mean[0, 0], mean[0, -1])
        knots, values, slopes = mean.astype(np.float64)
        energy = hermite(knots, values, slopes, held)
    states = np.column_stack([points.opening, points.opening_rate, points.contact, energy])
    arrays = {_name(file): array for file, array in compiled.arrays.items()}
    return compiled_step(
        tables,
        states,
        target=target,
        runs=runs,
        arrays=arrays if double else None,
        rows={_name(file): rows for file, rows in compiled.rows.items()},
    )


def _random_points(even: Points, rng: np.random.Generator) -> Points:
    """Places drawn between the ends of the even ones; half of the rates close, half open."""
    opening = rng.uniform(even.opening.min(), even.opening.max(), RANDOM_POINTS)
    speed = np.abs(even.opening_rate)
    rate = rng.uniform(speed.min(), speed.max(), RANDOM_POINTS)
    sign = np.where(rng.random(RANDOM_POINTS) < 0.5, -1.0, 1.0)
    contact = rng.uniform(even.contact.min(), even.contact.max(), RANDOM_POINTS)
    return Points(opening, sign * rate, contact)


def _timed(run: Callable[[], None], steps: int, repeats: int) -> Timing:
    """Processor time of a step in ns, over repeats of many steps each."""
    run()
    took = []
    for _ in range(repeats):
        start = time.thread_time_ns()
        run()
        took.append((time.thread_time_ns() - start) / steps)
    return _spread(took)


def _spread(took: Sequence[float]) -> Timing:
    return Timing(median(took), min(took), max(took))


def _name(file: str) -> str:
    return file.removeprefix("tables/").removesuffix(".npy")
