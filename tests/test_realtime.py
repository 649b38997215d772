"""The rule for tests in real time: what a failure is worth on a machine that held them up."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from tests.guard import GUARD_S
from tests.hold_up import EVERY_S, HoldUps
from tests.realtime import TOO_LITTLE, Evaluation, MOST_HELD_ms

ROOT = Path(__file__).parents[1]
TRIAL = """
import pytest
@pytest.mark.realtime
def test_passes(): pass
@pytest.mark.realtime
def test_fails(): assert 1 == 2
@pytest.fixture
def port(): raise OSError("no answer")
@pytest.mark.realtime
def test_has_no_port(port): pass
def test_of_another_kind_fails(): assert 3 == 4
"""
HELD = """
from tests import realtime
class Held:
    def __init__(self, pid): pass
    def begin(self): pass
    def worst_ms(self): return {held_ms}
    def close(self): pass
realtime.HoldUps = Held
pytest_plugins = ("tests.realtime",)
"""


def trial(folder: Path, held_ms: float, *options: str) -> subprocess.CompletedProcess[str]:
    """Run the trial with a stated hold-up."""
    (folder / "conftest.py").write_text(HELD.format(held_ms=held_ms), encoding="utf-8")
    (folder / "test_trial.py").write_text(TRIAL, encoding="utf-8")
    (folder / "pytest.ini").write_text("[pytest]\nmarkers =\n    realtime: of a port\n")
    words = [sys.executable, "-m", "pytest", "-p", "no:xdist", "-p", "no:cacheprovider", "-rA"]
    path = os.pathsep.join([str(ROOT), *filter(None, sys.path)])
    return subprocess.run(
        [*words, str(folder), *options],
        cwd=folder,
        env={**os.environ, "PYTHONPATH": path},
        capture_output=True,
        text=True,
    )


def outcomes(folder: Path, held_ms: float) -> tuple[dict[str, str], str]:
    """Run the trial with a stated hold-up: the outcome of each test, and what was printed."""
    said = trial(folder, held_ms).stdout
    lines = said.splitlines()
    found = {
        line.split("::")[1].split()[0]: line.split()[0]
        for line in lines
        if line.startswith(("PASSED", "FAILED", "ERROR")) and "::" in line
    }
    return found, said


def test_a_failure_on_a_machine_that_kept_time_is_a_failure(tmp_path: Path) -> None:
    found, said = outcomes(tmp_path, MOST_HELD_ms)
    assert found == {
        "test_passes": "PASSED",
        "test_fails": "FAILED",
        "test_has_no_port": "ERROR",
        "test_of_another_kind_fails": "FAILED",
    }
    assert "3 tests in real time, 0 of them not evaluated" in said


def test_a_failure_on_a_machine_that_held_it_up_is_not_evaluated(tmp_path: Path) -> None:
    found, said = outcomes(tmp_path, 40.0)
    assert found == {"test_passes": "PASSED", "test_of_another_kind_fails": "FAILED"}
    why = "not evaluated: the machine held up a process for 40.0 ms (more than 5 ms)"
    assert said.count(why) == 2
    assert f"{why}; assert 1 == 2" in said
    assert f"{why}; OSError: no answer" in said
    assert "3 tests in real time, 2 of them not evaluated" in said
    assert "Worst hold-up: 40.0 ms, during test_trial.py::test_passes" in said


@pytest.mark.parametrize(
    ("chosen", "code", "count"),
    [
        ("not another", 1, "3 tests in real time, 2 of them not evaluated"),
        ("passes", 0, "1 tests in real time, 0 of them not evaluated"),
        ("another", 1, None),
    ],
)
def test_a_run_that_evaluates_too_few_fails_where_they_are_counted(
    tmp_path: Path, chosen: str, code: int, count: str | None
) -> None:
    file = tmp_path / "build" / "count.txt"
    done = trial(tmp_path, 40.0, "-k", chosen, f"--realtime-count={file}")
    assert done.returncode == code, done.stdout
    assert (file.read_text(encoding="utf-8") == f"{count}\n") if count else not file.exists()
    assert (TOO_LITTLE in done.stdout) == (chosen == "not another")


def test_few_that_were_not_evaluated_fail_no_run() -> None:
    held = {f"test {k}": 40.0 for k in range(8)}
    assert not Evaluation(held_ms=held, not_evaluated=["test 0", "test 0", "test 1"]).is_too_little
    assert Evaluation(held_ms=held, not_evaluated=["test 0", "test 1", "test 2"]).is_too_little


def test_a_watcher_that_wakes_late_says_so() -> None:
    with HoldUps(os.getpid()) as watcher:
        watcher.begin()
        os.kill(watcher.pid, signal.SIGSTOP)
        time.sleep(0.1)
        os.kill(watcher.pid, signal.SIGCONT)
        assert watcher.worst_ms() >= 1e3 * (0.1 - 2 * EVERY_S)


@pytest.mark.skipif(not Path("/proc/self/schedstat").exists(), reason="this system does not count")
def test_processes_that_wait_for_one_processor_are_held_up() -> None:
    """Three that are always ready share a processor: two of them wait at any moment."""
    spin = f"import os\nwhile os.getppid() == {os.getpid()}: pass"
    one = {min(os.sched_getaffinity(0))}
    crowd = [subprocess.Popen([sys.executable, "-c", spin]) for _ in range(3)]
    try:
        for process in crowd:
            os.sched_setaffinity(process.pid, one)
        with HoldUps(os.getpid()) as watcher:
            watcher.begin()
            end_s = time.monotonic() + GUARD_S
            while (worst_ms := watcher.worst_ms()) <= MOST_HELD_ms and time.monotonic() < end_s:
                time.sleep(EVERY_S)
        assert worst_ms > MOST_HELD_ms
    finally:
        for process in crowd:
            process.kill()
            process.wait()
