"""The section of docs/trade.md: written from results alone, refreshed as a whole."""

from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path

import pytest
from benchmarks.draw_trade import draw, section_of

from scissorcal.bench.trade.assemble import curve_of, limit_of
from scissorcal.bench.trade.point import Spread
from scissorcal.bench.trade.result import FORMAT, Trade
from scissorcal.bench.trade.study import run_task, tasks_of
from scissorcal.errors import InputError
from tests.bench.made_trade import MADE, Steps, made_case

PAGE = "# Page\n\n<!-- TRADE_RECIPES -->\nold text\n<!-- end of TRADE_RECIPES -->\nthe end\n"


@pytest.fixture
def made(monkeypatch: pytest.MonkeyPatch) -> Trade:
    from scissorcal.bench.trade import knob as knobs

    monkeypatch.setattr(knobs, "KNOBS", {"steps": MADE["steps"]})
    case = made_case()
    records = [found for task in tasks_of(case, ["steps"]) if (found := run_task(case, task))]
    curve = curve_of(case, Steps(), records, limit_of(case))
    return Trade(
        format=FORMAT,
        created=datetime(2026, 1, 2, tzinfo=UTC),
        scissorcal_version="1.0",
        recipe_name="made",
        material="paper",
        simulated=True,
        machine="none",
        workers=1,
        seconds=3.0,
        budget_s=60.0,
        tolerance=0.07,
        limit=limit_of(case),
        baseline=Spread(20.0, 19.0, 21.0, "ms", 8),
        measured=8,
        measured_now=8,
        curves=(curve,),
        together=None,
        sentences=(f"{curve.title}: {curve.sentences[0]}",),
        notes=("A note.",),
    )


def test_the_marked_section_and_the_pictures_are_those_of_the_runs(
    made: Trade, tmp_path: Path
) -> None:
    (tmp_path / "pictures").mkdir()
    old = tmp_path / "pictures" / "trade-old-steps.svg"
    old.write_text("<svg/>", encoding="utf-8")
    page = tmp_path / "trade.md"
    page.write_text(PAGE, encoding="utf-8")
    draw([made], tmp_path)
    text = page.read_text(encoding="utf-8")
    assert text.startswith("# Page\n")
    assert text.endswith("the end\n")
    assert "old text" not in text
    assert "middle is enough" in text
    assert not old.exists()
    assert "](pictures/trade-made-steps.svg)" in text
    assert (tmp_path / "pictures" / "trade-made-steps.svg").is_file()
    draw([made], tmp_path)
    assert page.read_text(encoding="utf-8") == text


def test_what_a_budget_left_out_is_told(made: Trade) -> None:
    (curve,) = made.curves
    part = replace(made, curves=(replace(curve, unmeasured=("fine", "finer, much")),))
    assert "Steps: not measured within the budget: fine; finer, much." in section_of(part)
    assert "not measured" not in section_of(made)


def test_without_a_run_or_a_place_nothing_is_written(made: Trade, tmp_path: Path) -> None:
    page = tmp_path / "trade.md"
    page.write_text(PAGE, encoding="utf-8")
    with pytest.raises(InputError, match="no run"):
        draw([], tmp_path)
    assert page.read_text(encoding="utf-8") == PAGE
    page.write_text("# Page\n", encoding="utf-8")
    with pytest.raises(InputError, match="no place called TRADE_RECIPES"):
        draw([made], tmp_path)
