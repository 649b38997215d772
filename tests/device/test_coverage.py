"""The coverage grid counts what moved, where, how fast; blocks and gaps make no difference."""

import io

import numpy as np
import pytest
from numpy.typing import NDArray

from scissorcal.device.coverage import CoverageGrid, coverage_of, even_cells
from scissorcal.device.cut_trajectory import cut_openings, cut_plan
from scissorcal.device.trajectory import friction_plan
from scissorcal.recipe import builtin_recipe
from scissorcal.recording import SAMPLE_DTYPE
from tests.device.conftest import IDENTITY


def samples_of(opening: NDArray[np.float64], start_us: int = 0) -> NDArray[np.void]:
    samples = np.zeros(len(opening), SAMPLE_DTYPE)
    samples["opening"] = opening
    samples["device_time_us"] = start_us + 1000 * np.arange(len(opening))
    return samples


def closing(speed: float, top: float = 0.8, bottom: float = 0.2) -> NDArray[np.float64]:
    return np.arange(top, bottom, -speed * 1e-3)


def test_one_sweep_fills_one_row_evenly() -> None:
    grid = CoverageGrid((0.1, 0.4), even_cells((0.2, 0.8), 6))
    grid.add(samples_of(closing(0.1)))
    assert grid.seconds[0, 0] == pytest.approx(np.full(6, 1.0), abs=0.03)
    assert grid.seconds[1].sum() == grid.seconds[0, 1].sum() == 0
    assert grid.filled[0, 0].all()
    assert grid.share == pytest.approx(6 / 24)
    assert grid.filled.all(axis=2).tolist() == [[True, False], [False, False]]
    assert grid.sentence().endswith("thin: closing at 0.4 rad/s; opening at 0.1, 0.4 rad/s")


def test_blocks_make_no_difference() -> None:
    whole, parts = (CoverageGrid((0.1, 0.4), even_cells((0.2, 0.8))) for _ in range(2))
    samples = samples_of(np.concatenate([closing(0.1), closing(0.4)[::-1]]))
    whole.add(samples)
    for start in range(0, len(samples), 37):
        parts.add(samples[start : start + 37])
    assert np.allclose(whole.seconds, parts.seconds)


def test_a_gap_is_not_counted_as_motion() -> None:
    grid = CoverageGrid((0.1, 0.4), even_cells((0.2, 0.8)))
    rest = np.full(500, 0.7)
    grid.add(samples_of(rest))
    grid.add(samples_of(rest - 0.4, start_us=2_000_000))
    assert grid.seconds.sum() == 0
    grid.add(samples_of(rest[:0]))
    assert grid.seconds.sum() == 0


def test_a_friction_plan_fills_every_cell() -> None:
    recipe = builtin_recipe("paper-80gsm")
    reference = friction_plan(recipe, IDENTITY).segments[0].reference
    grid = coverage_of(recipe, IDENTITY, "friction")
    grid.add(samples_of(reference.opening))
    assert grid.share == 1.0, grid.sentence()
    assert grid.sentence() == "80 of 80 cells filled"


@pytest.mark.parametrize("name", ["paper-80gsm", "cotton-cloth", "press-only"])
def test_a_cut_plan_fills_every_cell(name: str) -> None:
    recipe = builtin_recipe(name)
    grid = coverage_of(recipe, IDENTITY, "cut")
    for number, segment in enumerate(cut_plan(recipe, IDENTITY).segments):
        grid.add(samples_of(segment.reference.opening, start_us=number * 10**9))
    assert grid.share == 1.0, grid.sentence()


def test_a_cut_plan_fills_every_cell_of_blades_that_cross_the_sheet_in_part_of_the_scene() -> None:
    recipe = builtin_recipe("paper-80gsm")
    edge = recipe.rig.edge.model_copy(
        update={"family": "arc", "offset_mm": -6.0, "taper_deg": 1.5, "curvature_per_m": 0.12}
    )
    recipe = recipe.model_copy(update={"rig": recipe.rig.model_copy(update={"edge": edge})})
    assert cut_openings(recipe, IDENTITY)[1] < recipe.scene.opening_rad[1] - 0.05
    grid = coverage_of(recipe, IDENTITY, "cut")
    for number, segment in enumerate(cut_plan(recipe, IDENTITY).segments):
        grid.add(samples_of(segment.reference.opening, start_us=number * 10**9))
    assert grid.share == 1.0, grid.sentence()


def test_the_table_is_small_and_readable() -> None:
    from rich.console import Console

    grid = CoverageGrid((0.1, 0.4), even_cells((0.2, 0.8)))
    grid.add(samples_of(closing(0.1)))
    text = io.StringIO()
    Console(file=text, width=100, color_system=None).print(grid)
    lines = text.getvalue().splitlines()
    assert "coverage 25 %" in lines[0]
    assert len(lines) < 12
    assert "closing 0.1" in text.getvalue()
    assert text.getvalue().count("█") == 8
