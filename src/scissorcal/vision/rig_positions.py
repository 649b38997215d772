"""Rig positions: advance and opening of the rig in each photograph of its card."""

import csv
import io
import math
import re
from collections.abc import Mapping
from pathlib import Path

from scissorcal.errors import InputError
from scissorcal.foreign import read_foreign_text
from scissorcal.foreign.formats import RIG_POSITIONS

RigPositions = Mapping[str, tuple[float, float]]
"""Position of the rig by the photograph's file name: advance in mm, opening in deg."""

COLUMNS = ("file", "advance_mm", "opening_deg")
LARGEST_MM = 10_000.0
"""Ten metres: no carriage of a bench is as long; what is more is in another unit."""
LARGEST_DEG = 180.0
"""Blades that point away from each other."""


def read_rig_positions(path: Path) -> RigPositions:
    """Read a CSV file with the columns file, advance_mm and opening_deg, in any order.

    Further columns are passed over, and so are folders before a file's name. Raises InputError with
    the file and line that is wrong: a column that is missing or there twice, a line with more or
    fewer cells than the first, what is no number, and a photograph with two positions.
    """
    text = io.StringIO(read_foreign_text(path, RIG_POSITIONS), newline="")
    rows = csv.reader(text, strict=True, skipinitialspace=True)
    try:
        head = [name.strip() for name in next(rows, [])]
        if any(head.count(name) != 1 for name in COLUMNS):
            raise InputError(
                f"{path} needs a first line 'file,advance_mm,opening_deg' and a line for each "
                "photograph below it."
            )
        found: dict[str, tuple[float, float]] = {}
        for row in rows:
            if not any(cell.strip() for cell in row):
                continue
            where = f"{path}, line {rows.line_num}"
            name, position = _position(row, head, where)
            if found.setdefault(name, position) != position:
                raise InputError(f"{where}: {name} has another position above. Keep the right one.")
    except csv.Error as error:
        raise InputError(
            f"{path}, line {rows.line_num}: this is no line of CSV ({error}). "
            f"{RIG_POSITIONS.remedy}"
        ) from None
    if not found:
        raise InputError(f"{path} has no line below its first. {RIG_POSITIONS.remedy}")
    return found


def _position(row: list[str], head: list[str], where: str) -> tuple[str, tuple[float, float]]:
    """A photograph's name and the rig's position in it."""
    if len(row) != len(head):
        raise InputError(
            f"{where}: the first line names {len(head)} columns, and this one has {len(row)}. "
            "Write numbers with a point, and names with a comma in quotes: 'rig-01.jpg,30.5,25'."
        )
    cells = dict(zip(head, row, strict=True))
    name = re.split(r"[/\\]", cells["file"].strip())[-1]
    position = _number(cells["advance_mm"]), _number(cells["opening_deg"])
    if not name:
        raise InputError(f"{where}: the name of its photograph is missing.")
    if not all(map(math.isfinite, position)):
        raise InputError(
            f"{where}: advance_mm and opening_deg must be numbers, such as 'rig-01.jpg,30,25'."
        )
    if abs(position[0]) > LARGEST_MM or abs(position[1]) > LARGEST_DEG:
        raise InputError(
            f"{where}: {position[0]:g} mm and {position[1]:g} deg are no position of a rig (at "
            f"most {LARGEST_MM:g} mm and {LARGEST_DEG:g} deg). Check the units."
        )
    return name, position


def _number(cell: str) -> float:
    """A plain decimal number; NaN for what is none, such as 1_000 and digits of other scripts."""
    try:
        return float(cell) if cell.isascii() and "_" not in cell else math.nan
    except ValueError:
        return math.nan


def position_of(path: Path, positions: RigPositions) -> tuple[float, float]:
    """The position of one photograph. Raises InputError where ``positions`` has no line for it."""
    if path.name not in positions:
        raise InputError(
            f"{path.name} has no position: add a line with its name, advance_mm and opening_deg."
        )
    return positions[path.name]
