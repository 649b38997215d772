"""The longest cells of estimation: none is wrong; and a cell can find something wrong."""

import pytest
from benchmarks.extremes import cut_cells, vision_cells
from benchmarks.extremes.cells import try_cell
from benchmarks.extremes.inference_cells import cells as inference

FITTED = [cell for module in (cut_cells, vision_cells) for cell in module.cells() if cell.slow]
"""The longest cells of these two rooms; test_page tries all cells that are not slow."""


@pytest.mark.slow
@pytest.mark.parametrize("cell", FITTED, ids=lambda cell: cell.name)
def test_no_fitted_cell_is_wrong(cell) -> None:
    """Four or more standard errors of margin each: a false alarm in 1,000 runs."""
    found = try_cell(cell, 11)
    assert found.outcome != "wrong", found.sentence


def test_a_silent_error_is_found(monkeypatch) -> None:
    """Draws shifted by a standard deviation are wrong, whatever their status says."""
    from benchmarks.extremes import inference_cells

    honest = inference_cells.infer

    def shifted(problem, effort, rng):
        from dataclasses import replace

        found = honest(problem, effort, rng)
        return replace(found, draws=found.draws + found.draws.std(axis=0))

    monkeypatch.setattr(inference_cells, "infer", shifted)
    assert try_cell(inference()[0], 11).outcome == "wrong"
