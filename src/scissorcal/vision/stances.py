"""Stances: advance and opening of the rig in each photograph of its card."""

import csv
import math
from collections.abc import Mapping
from pathlib import Path

from scissorcal.errors import InputError
from scissorcal.foreign import read_foreign_text, reading
from scissorcal.foreign.formats import STANCES

Stances = Mapping[str, tuple[float, float]]
"""Stance of the rig by the photograph's file name: advance in mm, opening in deg."""


def read_stances(path: Path) -> Stances:
    """Read a CSV file of stances with the columns file, advance_mm, opening_deg.

    Raises InputError with the file and line that is wrong.
    """
    text = read_foreign_text(path, STANCES)
    with reading(path, STANCES):
        rows = list(csv.DictReader(text.splitlines()))
    wanted = {"file", "advance_mm", "opening_deg"}
    if not rows or not wanted <= set(rows[0]):
        raise InputError(
            f"{path} needs a first line 'file,advance_mm,opening_deg' and a line for each "
            "photograph below it."
        )
    found: dict[str, tuple[float, float]] = {}
    for number, row in enumerate(rows, start=2):
        try:
            stance = float(row["advance_mm"]), float(row["opening_deg"])
        except (TypeError, ValueError):
            stance = (float("nan"), float("nan"))
        if not all(map(math.isfinite, stance)):
            raise InputError(
                f"{path}, line {number}: advance_mm and opening_deg must be numbers, such as "
                "'rig-01.jpg,30,25'."
            )
        found[Path(row["file"]).name] = stance
    return found


def stance_of(path: Path, stances: Stances) -> tuple[float, float]:
    """The stance of one photograph. Raises InputError where ``stances`` has no line for it."""
    if path.name not in stances:
        raise InputError(
            f"{path.name} has no stance: add a line with its name, advance_mm and opening_deg."
        )
    return stances[path.name]
