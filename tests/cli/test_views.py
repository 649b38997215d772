"""Progress is plain lines where nobody watches, and nobody is asked where nobody is there."""

import pytest

from scissorcal.cli import progress as progress_module
from scissorcal.cli.live_view import LiveView
from scissorcal.cli.progress import progress
from scissorcal.device.coverage import CoverageGrid
from scissorcal.errors import InputError, VerdictError


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


def test_a_capture_says_what_it_covers(capsys: pytest.CaptureFixture[str]) -> None:
    grid = CoverageGrid((0.1,), ((0.2, 0.3), (0.3, 0.4)))
    with LiveView() as view:
        view.show(0.0, "closing", grid)
        view.show(0.1, "closing", grid)
        view.show(1.0, "done", grid)
        view.show(1.0, "done", grid)
    lines = capsys.readouterr().err.splitlines()
    assert len(lines) == 2
    assert "0 of 4 cells filled" in lines[0]
    assert lines[1].startswith("100 %  done")


def test_nobody_is_asked_where_nobody_is_there(capsys: pytest.CaptureFixture[str]) -> None:
    with LiveView() as view, pytest.raises(InputError, match=r"Clear the blades\. .*--yes"):
        view.confirm("Clear the blades.")
    with LiveView(ask=False) as view:
        view.confirm("Clear the blades.")
    assert "Clear the blades. (--yes: taken as done)" in capsys.readouterr().err
