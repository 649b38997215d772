"""A path on a plate's surface, read from a CSV file."""

import csv
import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from scissorcal.aliases import Array
from scissorcal.errors import InputError
from scissorcal.foreign import read_foreign_text
from scissorcal.foreign.formats import PATH

COLUMNS = ("x_mm", "y_mm", "force_N", "speed_mm_per_s")
LARGEST_MM = 10_000.0


@dataclass(frozen=True, eq=False)
class SurfacePoints:
    """Points of a path in order, in the plate's frame: all arrays (n,), SI.

    ``x`` and ``y`` (m) lie on the surface, ``y`` NaN where the path does not state it. ``force``
    (N) is wanted at each point, ``speed`` (m/s) on the way to it; NaN where the path leaves them to
    the command. ``lines`` are those of the file.
    """

    x: Array
    y: Array
    force: Array
    speed: Array
    lines: NDArray[np.int64]
    source: str

    def line(self, index: int) -> str:
        """File and line of a point, as the beginning of a message."""
        return f"{self.source}, line {int(self.lines[index])}"

    def stated(self, force: float, speed: float) -> "SurfacePoints":
        """The same with force (N) and speed (m/s) where the path leaves them open."""
        return SurfacePoints(
            self.x,
            self.y,
            np.where(np.isnan(self.force), force, self.force),
            np.where(np.isnan(self.speed), speed, self.speed),
            self.lines,
            self.source,
        )


def read_path(path: Path) -> SurfacePoints:
    """Read a path: a head line with x_mm, and y_mm, force_N, speed_mm_per_s where they are stated.

    One point a line, in the order in which they are passed. Raises InputError with file and line
    for a column or a number that is none, and where fewer than two points are left.
    """
    rows = csv.reader(read_foreign_text(path, PATH).splitlines(), quoting=csv.QUOTE_NONE)
    try:
        head = [name.strip() for name in next(rows, [])]
    except csv.Error:
        raise InputError(f"{path}, line 1: no column has so long a name.") from None
    unknown = [name for name in head if name not in COLUMNS]
    if unknown or "x_mm" not in head or len(set(head)) != len(head):
        raise InputError(
            f"{path}, line 1: the columns must be x_mm and, where they are stated, "
            f"{', '.join(COLUMNS[1:])}, not '{','.join(head)[:60]}'."
        )
    table: list[list[float]] = []
    lines: list[int] = []
    try:
        for row in rows:
            if row and any(cell.strip() for cell in row):
                table.append(_numbers(row, head, f"{path}, line {rows.line_num}"))
                lines.append(rows.line_num)
    except csv.Error:
        raise InputError(
            f"{path}, line {rows.line_num}: no number has so many characters."
        ) from None
    if len(table) < 2:
        raise InputError(f"{path} has {len(table)} points: a path needs two or more.")
    values = np.array(table)
    return SurfacePoints(
        1e-3 * values[:, 0],
        1e-3 * values[:, 1],
        values[:, 2],
        1e-3 * values[:, 3],
        np.array(lines),
        str(path),
    )


def _numbers(row: list[str], head: list[str], where: str) -> list[float]:
    """x_mm, y_mm, force_N and speed_mm_per_s of one line; NaN where there is no such column."""
    if len(row) != len(head):
        raise InputError(f"{where}: {len(row)} numbers where line 1 names {len(head)} columns.")
    found = dict.fromkeys(COLUMNS, math.nan)
    for name, cell in zip(head, row, strict=True):
        try:
            value = float(cell)
        except ValueError:
            value = math.nan
        if not math.isfinite(value):
            raise InputError(f"{where}: {name} is '{cell.strip()[:40]}', and must be a number.")
        found[name] = value
    if max(abs(found["x_mm"]), abs(found["y_mm"]) if "y_mm" in head else 0.0) > LARGEST_MM:
        raise InputError(f"{where}: no plate is larger than {LARGEST_MM:g} mm.")
    for name in ("force_N", "speed_mm_per_s"):
        if name in head and not found[name] > 0.0:
            raise InputError(f"{where}: {name} = {found[name]:g} must be above 0.")
    return [found[name] for name in COLUMNS]
