"""Tests that need a port in real time (marked ``realtime``), and what counts on a slow machine.

A rig goes on while a busy machine holds up the process that should answer it, so a test of the two
in real time can fail without a fault of scissorcal. While each such test runs, the machine's
hold-ups are measured (`tests.hold_up`). A test that passes passes. One that fails on a machine that
kept time has failed. One that fails after a hold-up beyond `MOST_HELD_ms` is *not evaluated*: it is
reported as skipped, with the figure, and is not run again. A run with ``--realtime-count`` fails
where more than `MOST_LEFT_OUT` of them were not evaluated. Decision 172 has the reasons.
"""

import os
from collections.abc import Generator
from dataclasses import dataclass, field
from pathlib import Path

import pytest
from _pytest.reports import TestReport
from _pytest.terminal import TerminalReporter

from scissorcal.device import CATCH_UP_TICKS, TICK_S
from tests.hold_up import HoldUps

MARK = "realtime"
MOST_HELD_ms = 1e3 * CATCH_UP_TICKS * TICK_S
"""The virtual rig makes up for that much. Held up for longer, its clock slips: it stands still, or
a real device would have gone on without the host for half of what it waits until it brakes."""
NOT_EVALUATED = "not evaluated"
MOST_LEFT_OUT = 0.25
"""Share of the tests beyond which a run shows too little. Of 33 tests on two cores that four times
as much other work kept busy 1 was not evaluated, so on such a machine at most 14 % are (95 %,
binomial), and even then more than a quarter in 3 runs of 100. Beyond it is a machine that cannot
answer, or a fault that a busy machine hides."""

TOO_LITTLE = (
    f"The run failed: more than {MOST_LEFT_OUT:.0%} were {NOT_EVALUATED}, so it shows too little. "
    "Run make test-realtime where nothing else runs."
)


@dataclass
class Evaluation:
    """What became of the realtime tests of a run, with the worst hold-up (ms) during each."""

    watcher: HoldUps | None = None
    held_ms: dict[str, float] = field(default_factory=dict)
    not_evaluated: list[str] = field(default_factory=list)

    def begin(self) -> None:
        """Measure anew, for a test that begins now."""
        self.watcher = self.watcher or HoldUps(os.getpid())
        self.watcher.begin()

    def take(self, report: TestReport) -> None:
        """Note the worst hold-up until this report, and apply the rule to it."""
        assert self.watcher is not None
        held_ms = max(self.watcher.worst_ms(), self.held_ms.get(report.nodeid, 0.0))
        self.held_ms[report.nodeid] = held_ms
        if evaluate(report, held_ms):
            self.not_evaluated.append(report.nodeid)

    @property
    def left_out(self) -> int:
        """How many were not evaluated."""
        return len(set(self.not_evaluated))

    @property
    def is_too_little(self) -> bool:
        """Whether so many were not evaluated that the run shows too little."""
        return self.left_out > MOST_LEFT_OUT * len(self.held_ms)

    @property
    def count(self) -> str:
        """How many there were, and how many of them were not evaluated."""
        return f"{len(self.held_ms)} tests in real time, {self.left_out} of them {NOT_EVALUATED}"

    def sentences(self) -> list[str]:
        """The end of a run: how many were not evaluated, and the worst hold-up."""
        worst = max(self.held_ms, key=self.held_ms.__getitem__)
        excused = sum(held > MOST_HELD_ms for held in self.held_ms.values())
        return [
            f"{self.count}: a failure counts only"
            f" where the machine held up no process for more than {MOST_HELD_ms:g} ms. It did"
            f" during {excused} of them.",
            f"Worst hold-up: {self.held_ms[worst]:.1f} ms, during {worst}.",
        ]


def evaluate(report: TestReport, held_ms: float) -> bool:
    """Apply the rule to a report; True where it was a failure that is not evaluated."""
    if not report.failed or held_ms <= MOST_HELD_ms:
        return False
    report.sections.append(("What failed", report.longreprtext))
    said = getattr(getattr(report.longrepr, "reprcrash", None), "message", "") or "it failed"
    reason = (
        f"{NOT_EVALUATED}: the machine held up a process for {held_ms:.1f} ms (more than "
        f"{MOST_HELD_ms:g} ms); {said.splitlines()[0]}"
    )
    path, line, _ = report.location
    report.outcome = "skipped"
    report.longrepr = (path, line or 0, reason)
    return True


COUNT = "--realtime-count"
_KEY = pytest.StashKey[Evaluation]()


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption(
        COUNT,
        type=Path,
        metavar="FILE",
        help="write how many realtime tests were not evaluated there; fail where too many",
    )


def pytest_configure(config: pytest.Config) -> None:
    config.stash[_KEY] = Evaluation()


@pytest.hookimpl(wrapper=True, tryfirst=True)
def pytest_runtest_setup(item: pytest.Item) -> Generator[None]:
    if item.get_closest_marker(MARK):
        item.config.stash[_KEY].begin()
    yield


@pytest.hookimpl(wrapper=True, tryfirst=True)
def pytest_runtest_makereport(item: pytest.Item) -> Generator[None, TestReport, TestReport]:
    report = yield
    if item.get_closest_marker(MARK):
        item.config.stash[_KEY].take(report)
    return report


@pytest.hookimpl(trylast=True)
def pytest_sessionfinish(session: pytest.Session) -> None:
    evaluation, file = session.config.stash[_KEY], session.config.getoption(COUNT)
    if file is not None and evaluation.held_ms:
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(f"{evaluation.count}\n", encoding="utf-8")
        if evaluation.is_too_little and session.exitstatus == pytest.ExitCode.OK:
            session.exitstatus = pytest.ExitCode.TESTS_FAILED


def pytest_terminal_summary(terminalreporter: TerminalReporter, config: pytest.Config) -> None:
    evaluation = config.stash[_KEY]
    if evaluation.held_ms:
        terminalreporter.section("realtime")
        for sentence in evaluation.sentences():
            terminalreporter.line(sentence)
        if config.getoption(COUNT) is not None and evaluation.is_too_little:
            terminalreporter.line(TOO_LITTLE)


def pytest_unconfigure(config: pytest.Config) -> None:
    watcher = config.stash[_KEY].watcher
    if watcher is not None:
        watcher.close()
