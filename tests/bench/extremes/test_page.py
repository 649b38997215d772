"""docs/extremes.md against a fresh run of reduced size."""

import re
from pathlib import Path

import numpy as np
import pytest
from _pytest.mark import ParameterSet
from benchmarks.extremes.cells import all_cells, try_cell
from benchmarks.extremes.quantities import QUANTITIES
from benchmarks.extremes.states import everyday_state
from benchmarks.extremes.study import try_state

from scissorcal.bench.extremes.compare import PLACE_ROUNDINGS
from scissorcal.report import short

DRAWN = ("inference", "signals")
"""Parts whose cells fit: their answers are draws, and most take long."""
QUICK = (
    "everyday line", "no data", "singular information", "two hills", "a datum that is NaN",
    "everyday sweeps", "one torque 1e9 sd off", "no recording", "0 samples of friction",
    "1 sample of friction", "one torque NaN", "one opening NaN", "one torque 1e300",
    "dead band throughout",
)  # fmt: skip
"""Cells of draws that every run of the tests tries; the slow suite tries the others."""
PAGE = (Path(__file__).parents[3] / "docs" / "extremes.md").read_text(encoding="utf-8")


CELLS = {cell.name: cell for cell in all_cells()}


def table(name: str) -> list[list[str]]:
    """Rows of a marked table, less its head."""
    found = re.search(rf"<!-- {name} -->\n(.*?)<!-- end of {name} -->", PAGE, re.DOTALL)
    assert found
    rows = [line for line in found[1].splitlines() if line.startswith("|")]
    return [[cell.strip() for cell in row.strip("|").split("|")] for row in rows[2:]]


def test_its_ranges_are_those_of_the_code():
    stated = {row[0]: row[2:4] for row in table("EXTREMES_RANGES")}
    spans = {
        name.replace("_", " "): [
            f"{short(low)} to {short(high)}" for low, high in (q.everyday, q.extreme)
        ]
        for name, q in QUANTITIES.items()
    }
    assert stated == spans


def test_nothing_on_it_is_wrong():
    totals = table("EXTREMES_TOTALS")
    assert {row[0] for row in totals} == {
        f"{subject}, {band}"
        for subject in ("model", "kernel", "tables")
        for band in ("everyday", "extreme")
    }
    for name, states, right, refused, flagged, uncompared, wrong, *_, roundings in totals:
        assert wrong == "0", name
        counts = (right, refused, flagged, uncompared)
        assert int(states) == sum(map(int, counts)) > 20, name
        assert float(roundings) <= max(PLACE_ROUNDINGS), name


def test_everyday_errors_of_a_fresh_run_are_those_that_it_states():
    """Medians vary by a factor of two or so among a dozen states; ten allows none by chance."""
    rng = np.random.default_rng(20261123)
    found = [try_state(everyday_state(rng)) for _ in range(12)]
    stated = {row[0]: float(row[7]) for row in table("EXTREMES_TOTALS")}
    for place, subject in enumerate(("model", "kernel")):
        own = [one[place] for one in found]
        assert {one.outcome for one in own} == {"right"}
        fresh = float(np.nanmedian([answer.error for answer in own]))
        assert fresh < 10.0 * stated[f"{subject}, everyday"]


def test_it_names_every_cell():
    assert {row[0] for row in table("EXTREMES_CELLS")} == set(CELLS)


def marked(row: list[str]) -> ParameterSet:
    """A row of the table of cells, slow where it takes draws."""
    slow = CELLS[row[0]].part in DRAWN and row[0] not in QUICK
    return pytest.param(row, id=row[0], marks=[pytest.mark.slow] if slow else [])


@pytest.mark.parametrize("row", [marked(row) for row in table("EXTREMES_CELLS")])
def test_a_cell_is_found_as_it_states(row):
    cell = CELLS[row[0]]
    assert row[1:3] == [cell.extreme, cell.stated]
    allowed = {row[3]}
    if "or flagged" in cell.stated:  # then which of them it is depends on the seed
        allowed |= {"right", "flagged"}
    if "or refused" in cell.stated:
        allowed |= {"right", "refused"}
    if not cell.slow:
        found = try_cell(cell, 7)
        assert found.outcome in allowed, found.sentence
