"""A workspace under commands in any order, killed, refused, two at once: always a way on."""

import shutil
import tempfile
import threading
from pathlib import Path

import pytest
from hypothesis import HealthCheck, settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, initialize, invariant, rule

from scissorcal.workday.workspace import Workspace
from tests.workday.faults import Fault, Outcome, run
from tests.workday.interrupted import (
    SIGN,
    WHOLE_DAY,
    commands_that_write,
    faults_of,
    finished_day,
    left_behind,
)

MEANT = {0, 2, 3, 5, -9}
"""Done, refused, a verdict failed, another command first, killed: never 1, a fault."""

NAMES = ("recording exclude", "fit", "report", "report sign", "package build", "render")


class AnyOrder(RuleBasedStateMachine):
    """Commands with faults; after each one every file is whole and `plan` ends well."""

    @initialize()
    def begin(self) -> None:
        self.scratch = Path(tempfile.mkdtemp())
        self.root = finished_day(self.scratch / "paper").root
        self.before = self.scratch / "before"
        self.commands = {
            **commands_that_write(Workspace(self.root)),
            "recording include": ("recording", "include", self._cut()),
        }

    @rule(
        name=st.sampled_from((*NAMES, "recording include")),
        kind=st.sampled_from(("none", "kill", "full")),
        at=st.integers(0, 25),
    )
    def a_command(self, name: str, kind: str, at: int) -> None:
        self._keep()
        fault = None if kind == "none" else Fault(kind, at)  # type: ignore[arg-type]
        self._hold(run(self.commands[name], self.root, fault))

    @rule(one=st.sampled_from(NAMES), other=st.sampled_from(NAMES))
    def two_at_once(self, one: str, other: str) -> None:
        self._keep()
        ended: list[Outcome] = []
        both = [
            threading.Thread(target=lambda n=name: ended.append(run(self.commands[n], self.root)))
            for name in (one, other)
        ]
        for thread in both:
            thread.start()
        for thread in both:
            thread.join()
        for outcome in ended:
            self._hold(outcome)

    @invariant()
    def every_file_is_whole(self) -> None:
        if hasattr(self, "before") and self.before.exists():
            assert faults_of(self.root, self.before) == []

    def teardown(self) -> None:
        """From wherever it stands, the day can be finished."""
        if not hasattr(self, "root"):
            return
        run(("recording", "include", self._cut()), self.root)
        for words in WHOLE_DAY:
            anew = (*words, "--anew") if words == ("report",) else words
            done = run(anew, self.root)
            assert done.code == 0, (words, done.err)
        assert left_behind(self.root) == []
        shutil.rmtree(self.scratch)

    def _cut(self) -> str:
        return Workspace(self.root).recordings("cut")[0].name

    def _keep(self) -> None:
        shutil.rmtree(self.before, ignore_errors=True)
        shutil.copytree(self.root, self.before)

    def _hold(self, outcome: Outcome) -> None:
        assert outcome.code in MEANT, (outcome.code, outcome.err)


assert SIGN in WHOLE_DAY
TestAnyOrder = pytest.mark.slow(AnyOrder.TestCase)
TestAnyOrder.settings = settings(
    max_examples=3,
    stateful_step_count=6,
    suppress_health_check=list(HealthCheck),
)
