"""Estimates of the demo beside the truth, as its panel shows them."""

from pathlib import Path
from types import SimpleNamespace

import pytest

from scissorcal.cli import demo
from scissorcal.report import panel_text
from scissorcal.workday.demo.day import DemoResult
from scissorcal.workday.demo.photographs import Judged

WITHIN = Judged("coulomb_pos", "N m", 0.01331, 0.01334, 0.01327, 0.01341)
BESIDE = Judged("plate x", "mm", 12.0, 10.0, 9.0, 11.0)
UNKNOWN = Judged("response_exponent", "1", None, 1.5, 1.2, 1.8)


def test_an_estimate_without_a_truth_is_neither_inside_nor_outside() -> None:
    assert [row.inside for row in (WITHIN, BESIDE, UNKNOWN)] == [True, False, None]


def test_the_panel_counts_intervals_and_marks_what_lies_outside() -> None:
    rendering = SimpleNamespace(
        strokes=3, seconds=30.0, admission=SimpleNamespace(summary="All places admitted.")
    )
    day = DemoResult(
        workspace=Path("day"),
        specimen="office-paper",
        judged=(WITHIN, BESIDE, UNKNOWN),
        torque_error=0.0123,
        candidates=(),
        rendering=rendering,  # type: ignore[arg-type]
        verified=(),
        verdicts=(),
        files=(),
    )
    assert day.share_inside == pytest.approx(0.5)
    panel = demo._panel(day)
    assert panel.sentence == "1 of 2 intervals (90 %) contain the truth."
    assert [row.name for row in panel.rows if row.marked] == ["plate x"]
    text = panel_text(panel)
    assert "0.013340 (0.013270 to 0.013410)" in text
    assert "Torque error of the package: 1.23 % (rms over the scene)." in text
