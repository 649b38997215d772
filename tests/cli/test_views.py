"""Progress is drawn on a terminal and printed as lines elsewhere; questions need a terminal."""

import io
import itertools
import re
from collections import deque
from pathlib import Path

import numpy as np
import pytest
from rich.console import Console

from scissorcal.cli import live_view
from scissorcal.cli import progress as progress_module
from scissorcal.cli.live_view import LiveView, effort_plot
from scissorcal.cli.output import table
from scissorcal.cli.progress import progress
from scissorcal.cli.terminal import drawn
from scissorcal.device import ADVANCE, OPENING, CoverageGrid, Recorder
from scissorcal.errors import InputError, VerdictError
from scissorcal.recording import SAMPLE_DTYPE, RecordingWriter


def test_lines_are_printed_now_and_then(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    looks = (0.0, *(second for second in (0.0, 3.0, 4.0, 5.0, 6.0, 11.0) for _ in range(2)))
    clock = iter(looks)
    monkeypatch.setattr(progress_module.time, "monotonic", lambda: next(clock))
    with progress() as tell:
        for done, sentence in (
            (0.0, "reading"),
            (0.1, "reading"),
            (0.5, "fitting"),
            (0.6, "sampling"),
            (0.7, "judging"),
            (1.7, "judging"),
        ):
            tell(done, sentence)
    captured = capsys.readouterr()
    assert captured.out == ""
    assert captured.err.splitlines() == [
        "  0 %  reading (0 s)",
        " 50 %  fitting (4 s, about 4 s left)",
        " 70 %  judging (6 s, about 3 s left)",
        "100 %  judging (11 s)",
    ]


def test_work_far_beyond_its_limit_ends_with_a_sentence(monkeypatch: pytest.MonkeyPatch) -> None:
    clock = iter([0.0, 50.0, 50.0, 95.0, 95.0])
    monkeypatch.setattr(progress_module.time, "monotonic", lambda: next(clock))
    with progress(limit_s=60.0) as tell:
        tell(0.3, "reading")
        with pytest.raises(VerdictError, match=r"1 min 0 s.* 40 % .*blade.*--max-minutes"):
            tell(0.4, "blade: searching")


def cells_of(low: float, high: float, count: int = 8) -> tuple[tuple[float, float], ...]:
    return tuple(itertools.pairwise(np.linspace(low, high, count + 1).tolist()))


def recorded(tmp_path: Path, grid: CoverageGrid | None = None) -> Recorder:
    """Give a recorder that took half a second of closing at 2 mN m."""
    samples = np.zeros(500, dtype=SAMPLE_DTYPE)
    samples["sequence"] = np.arange(500)
    samples["device_time_us"] = 1000 * np.arange(500)
    samples["opening"] = np.linspace(0.4, 0.2, 500)
    samples["motor_torque"] = 0.002
    grid = grid or CoverageGrid((0.1, 0.4), ((0.2, 0.3), (0.3, 0.4)))
    with RecordingWriter(tmp_path / "a.mcap", "friction") as writer:
        recorder = Recorder(writer, grid)
        recorder.take(samples)
    return recorder


def test_a_capture_shows_opening_torque_and_coverage(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(live_view.time, "monotonic", lambda: 7.0)
    recorder = recorded(tmp_path)
    with LiveView() as view:
        view.show(0.0, "closing", recorder)
        view.show(0.1, "closing", recorder)
        view.show(1.0, "done", recorder)
        view.show(1.0, "done", recorder)
    lines = capsys.readouterr().err.splitlines()
    assert len(lines) == 2
    assert "opening 11.5 deg, motor torque 2.0 mN m" in lines[0]
    assert "2 of 8 cells filled" in lines[0]
    assert lines[1].startswith("100 %  done")


def test_a_terminal_shows_torque_over_opening_with_units(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("sys.stderr.isatty", lambda: True)
    monkeypatch.setenv("COLUMNS", "120")
    with LiveView() as view:
        view.show(0.5, "closing", recorded(tmp_path))
    said = capsys.readouterr().err
    assert "motor torque (mN m)" in said
    assert "opening (deg)" in said
    assert "(rad/s)" in said


@pytest.mark.parametrize("along", ["opening", "advance"])
@pytest.mark.parametrize("width", [60, 80, 100, 120])
def test_no_line_of_the_live_view_is_broken(
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
    width: int,
    along: str,
) -> None:
    monkeypatch.setattr("sys.stderr.isatty", lambda: True)
    monkeypatch.setenv("COLUMNS", str(width))
    speeds = (0.0125, 0.05, 0.2, 0.8)
    axis = OPENING if along == "opening" else ADVANCE
    if axis is OPENING:
        grid = CoverageGrid(speeds, cells_of(0.1, 0.9))
    else:
        grid = CoverageGrid(speeds, cells_of(-0.12, 0.04), ("backward", "forward"), axis=axis)
    with LiveView() as view:
        view.show(0.35, "stroke 3 of 20", recorded(tmp_path, grid))
    frames = re.split(r"(?:\x1b\[1A|\r)?\x1b\[2K", capsys.readouterr().err)
    frame = max(frames, key=len)
    plain = re.sub(r"\x1b\[[0-9;?]*[A-Za-z]|\r", "", frame)
    lines = [line.rstrip() for line in plain.splitlines() if line.strip()]
    assert max(map(len, lines)) <= width
    head, values, bar, name, *plot = lines[:13]
    assert head.startswith(" 35 %  stroke 3 of 20")
    assert values.startswith(f"{axis.channel} ")
    assert set(bar) <= set("━╸╺")
    assert name == f"{axis.effort_name} ({axis.effort_unit})"
    assert all(" |" in line for line in plot[:8])
    assert f"{axis.channel} ({axis.unit})" in plot[8]
    title, *table = lines[13:]
    assert title.startswith("coverage ")
    assert len({len(line) for line in table}) == 1
    assert len([line for line in table if line.count("│") >= 9]) == 2 * len(speeds)
    assert not any("…" in line for line in lines)


def test_a_grid_without_place_for_its_table_is_a_sentence() -> None:
    text = io.StringIO()
    Console(file=text, width=60).print(CoverageGrid((0.1,), cells_of(0.1, 0.9, count=40)))
    assert text.getvalue().startswith("0 of 80 cells filled; thin: closing at 0.1")


def test_the_newest_point_of_the_plot_is_marked() -> None:
    plot = effort_plot(deque([(10.0, -5.0), (30.0, 5.0), (20.0, 0.0)]), OPENING).splitlines()
    assert plot[0] == "motor torque (mN m)"
    assert plot[1].startswith("      5.0 |")
    assert plot[1].endswith(".")
    assert sum(line.count("o") for line in plot[1:9]) == 1
    assert plot[-1].split() == ["10.0", "opening", "(deg)", "30.0"]


def test_a_table_on_a_terminal_is_set_by_rich(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sys.stdout.isatty", lambda: True)
    monkeypatch.setenv("COLUMNS", "24")
    lines = drawn(table([["name", "why"], ["kappa", "a sentence that does not fit"]])).splitlines()
    assert len(lines) > 2
    assert "\x1b[1m" in lines[0]


def test_questions_need_a_terminal(capsys: pytest.CaptureFixture[str]) -> None:
    with LiveView() as view, pytest.raises(InputError, match=r"Clear the blades\. .*--yes"):
        view.confirm("Clear the blades.")
    with LiveView(ask=False) as view:
        view.confirm("Clear the blades.")
    assert "Clear the blades. (--yes: taken as done)" in capsys.readouterr().err
