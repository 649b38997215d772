"""Arming, starting, answering, stopping: with programs that do what a command may do."""

import asyncio
import os
import signal
import sys
import textwrap
from collections.abc import Callable, Coroutine
from pathlib import Path
from typing import Any

import pytest

from scissorcal.prototype.rig_commands import (
    LONGEST_LINE,
    QUESTION,
    RefusedError,
    RigCommand,
    RigCommands,
    State,
)
from tests.guard import GUARD_S

REQUEST = "Take everything out."
RENDER = RigCommand("render", ("render",), REQUEST)
CUT = RigCommand("capture cut", ("capture", "cut"), REQUEST)
PAGE, OTHER = "a page", "another page"


class Told:
    """States in the order in which they were told, and a way to wait for one."""

    def __init__(self) -> None:
        self.states: list[State] = []
        self._news = asyncio.Event()

    def __call__(self, state: State) -> None:
        self.states.append(state)
        self._news.set()

    async def wait_for(self, is_it: Callable[[State], bool]) -> State:
        async with asyncio.timeout(GUARD_S):
            while not (self.states and is_it(self.states[-1])):
                self._news.clear()
                await self._news.wait()
        return self.states[-1]

    async def end(self) -> State:
        return await self.wait_for(lambda state: state.state == "idle" and state.code is not None)


def program(text: str) -> dict[str, Any]:
    """A program in the place of ``scissorcal``."""
    head = "import signal, sys, time\n"
    return {"program": (sys.executable, "-c", head + textwrap.dedent(text))}


def trial(
    tmp_path: Path, act: Callable[[RigCommands, Told], Coroutine[Any, Any, None]], **how: Any
) -> None:
    """Act with commands, and close them in any case."""

    async def run() -> None:
        told = Told()
        commands = RigCommands([RENDER, CUT], tmp_path, told, **how)
        try:
            await act(commands, told)
        finally:
            async with asyncio.timeout(GUARD_S):
                await commands.close()
        assert not commands.runs

    asyncio.run(run())


def test_a_command_starts_once_it_was_armed_by_this_page_and_not_twice(tmp_path: Path) -> None:
    async def act(commands: RigCommands, told: Told) -> None:
        with pytest.raises(RefusedError, match="not armed"):
            commands.start("render", PAGE)
        with pytest.raises(RefusedError, match=r"no such command .*'render', 'capture cut'"):
            commands.arm("rm -rf", PAGE)
        commands.arm("render", PAGE)
        assert told.states[-1] == State("idle", "render", "", None, REQUEST)
        with pytest.raises(RefusedError, match="another page"):
            commands.start("render", OTHER)
        with pytest.raises(RefusedError, match="'render' was armed"):
            commands.start("capture cut", PAGE)
        commands.start("render", PAGE)
        for refused in (commands.arm, commands.start):
            with pytest.raises(RefusedError, match="is running"):
                refused("render", PAGE)
            with pytest.raises(RefusedError, match="'render' is running"):
                refused("capture cut", OTHER)
        ended = await told.end()
        assert ended == State("idle", "render", "rendered ['render']", 0)
        with pytest.raises(RefusedError, match="not armed"):
            commands.start("render", PAGE)

    trial(tmp_path, act, **program("print('rendered', sys.argv[1:])\nprint('more')"))


def test_what_is_armed_is_forgotten_in_time_by_a_stop_and_with_its_page(tmp_path: Path) -> None:
    async def act(commands: RigCommands, told: Told) -> None:
        commands.arm("render", PAGE)
        said = await told.wait_for(lambda state: state.request is None)
        assert "not confirmed within 0.05 s" in said.sentence
        for forget in (commands.stop, lambda: commands.leave(PAGE)):
            commands.arm("render", PAGE)
            forget()
            assert told.states[-1].request is None
            with pytest.raises(RefusedError, match="not armed"):
                commands.start("render", PAGE)
        commands.arm("render", PAGE)
        commands.leave(OTHER)
        commands.start("render", PAGE)
        assert (await told.end()).code == 0

    trial(tmp_path, act, armed_s=0.05, **program(""))


def test_arming_another_command_takes_the_place_of_the_first(tmp_path: Path) -> None:
    async def act(commands: RigCommands, told: Told) -> None:
        commands.arm("render", PAGE)
        commands.arm("capture cut", PAGE)
        with pytest.raises(RefusedError, match="'capture cut' was armed"):
            commands.start("render", PAGE)
        commands.start("capture cut", PAGE)
        assert (await told.end()).sentence == "['capture', 'cut']"

    trial(tmp_path, act, **program("print(sys.argv[1:])"))


WAITS = """
try:
    print('ready', file=sys.stderr, flush=True)
    while True:
        time.sleep(0.02)
except KeyboardInterrupt:
    print(' 50 %  half of it (3 s)', file=sys.stderr)
    print('The samples are kept.', file=sys.stderr)
    print('Error: Interrupted.', file=sys.stderr)
    sys.exit(130)
"""
"""It sleeps for moments: a signal that comes just before a sleep begins does not end it."""


def test_any_page_stops_it_as_ctrl_c_does(tmp_path: Path) -> None:
    async def act(commands: RigCommands, told: Told) -> None:
        commands.arm("render", PAGE)
        commands.start("render", PAGE)
        await told.wait_for(lambda state: state.sentence == "ready")
        commands.stop()
        commands.stop()
        assert told.states[-1].state == "ending"
        with pytest.raises(RefusedError, match="is running"):
            commands.arm("render", PAGE)
        ended = await told.end()
        assert (ended.code, ended.sentence) == (130, "Stopped. The samples are kept.")
        commands.stop()
        assert told.states[-1].sentence == "Nothing is running."

    trial(tmp_path, act, **program(WAITS))


@pytest.mark.parametrize(
    ("deaf", "code"),
    [(("SIGINT",), -signal.SIGTERM), (("SIGINT", "SIGTERM"), -signal.SIGKILL)],
)
def test_one_that_does_not_end_is_made_to(deaf: tuple[str, ...], code: int, tmp_path: Path) -> None:
    async def act(commands: RigCommands, told: Told) -> None:
        commands.arm("render", PAGE)
        commands.start("render", PAGE)
        await told.wait_for(lambda state: state.sentence == "ready")
        commands.stop()
        assert (await told.end()).code == code

    ignores = "".join(f"signal.signal(signal.{name}, signal.SIG_IGN)\n" for name in deaf)
    how = program(ignores + textwrap.dedent(WAITS))
    trial(tmp_path, act, patience_s=(0.1, 0.1), **how)


def test_a_stop_before_the_process_is_there_ends_it_too(tmp_path: Path) -> None:
    async def act(commands: RigCommands, told: Told) -> None:
        commands.arm("render", PAGE)
        commands.start("render", PAGE)
        commands.stop()
        assert (await told.end()).code != 0
        assert told.states[-1].sentence.startswith("Stopped.")

    trial(tmp_path, act, patience_s=(2.0, 1.0), **program(WAITS))


def test_closing_ends_what_runs_and_what_it_started(tmp_path: Path) -> None:
    found: list[int] = []

    async def act(commands: RigCommands, told: Told) -> None:
        commands.arm("render", PAGE)
        commands.start("render", PAGE)
        said = await told.wait_for(lambda state: state.sentence.isdigit())
        found.append(int(said.sentence))

    child = "signal.signal(signal.SIGINT, signal.SIG_IGN); time.sleep(60)"
    trial(
        tmp_path,
        act,
        **program(
            f"""
            import subprocess
            words = [sys.executable, "-c", "import signal, time; {child}"]
            child = subprocess.Popen(words)
            print(child.pid, file=sys.stderr, flush=True)
            time.sleep(60)
            """
        ),
    )
    (pid,) = found
    with pytest.raises(ProcessLookupError):
        _until_gone(pid)


def _until_gone(pid: int) -> None:
    """Raises ProcessLookupError once nothing has that number, or only a body to be buried."""
    import time

    for _ in range(int(GUARD_S / 0.01)):
        os.kill(pid, 0)
        state = Path(f"/proc/{pid}/stat")
        if state.exists() and state.read_text().rpartition(")")[2].split()[0] == "Z":
            raise ProcessLookupError
        time.sleep(0.01)


ASKS = """
def ask(what):
    print(chr(0x1e) + what, file=sys.stderr, flush=True)
    return sys.stdin.readline()
"""


def test_the_confirmed_question_is_answered_and_each_other_one_waits(tmp_path: Path) -> None:
    async def act(commands: RigCommands, told: Told) -> None:
        commands.arm("render", PAGE)
        commands.start("render", PAGE)
        asked = await told.wait_for(lambda state: state.request is not None)
        assert asked.request == "Put a fresh sheet in."
        with pytest.raises(RefusedError, match="stop it first"):
            commands.start("capture cut", OTHER)
        commands.start("render", OTHER, asked.question)
        again = await told.wait_for(lambda state: state.request is not None)
        assert again.request == REQUEST  # the same words once more are another question
        with pytest.raises(RefusedError, match="answered already"):
            commands.start("render", PAGE, asked.question)
        commands.start("render", PAGE, again.question)
        assert (await told.end()).sentence == "['yes\\n', 'yes\\n', 'yes\\n']"

    asks = f"print([ask(one) for one in ({REQUEST!r}, 'Put a fresh sheet in.', {REQUEST!r})])"
    trial(tmp_path, act, **program(ASKS + asks))


def test_a_first_question_that_was_not_confirmed_waits(tmp_path: Path) -> None:
    async def act(commands: RigCommands, told: Told) -> None:
        commands.arm("render", PAGE)
        commands.start("render", PAGE)
        asked = await told.wait_for(lambda state: state.request is not None)
        assert asked.request == "Keep clear of the carriage."
        commands.stop()
        assert (await told.end()).request is None

    trial(tmp_path, act, **program(ASKS + "ask('Keep clear of the carriage.')"))


def test_progress_is_told_and_lines_of_any_length_and_bytes_are_borne(tmp_path: Path) -> None:
    async def act(commands: RigCommands, told: Told) -> None:
        commands.arm("render", PAGE)
        commands.start("render", PAGE)
        ended = await told.end()
        assert ended.code == 4
        assert ended.sentence == "The rig was unplugged."
        sentences = [state.sentence for state in told.states]
        assert "10 %  rendering (1 s)" in sentences
        assert max(map(len, sentences)) <= LONGEST_LINE
        assert any("\ufffd" in sentence for sentence in sentences)
        assert not any(QUESTION in sentence for sentence in sentences)

    text = r"""
    out = sys.stderr.buffer
    out.write(b"x" * 1000000 + b"\n" + b"\xff\xfe\n" + b"10 %  rendering (1 s)\n\n")
    out.write(b"Error: The rig was unplugged.\n")
    out.flush()
    sys.exit(4)
    """
    trial(tmp_path, act, **program(text))


def test_an_exit_code_of_three_names_the_checks_that_failed(tmp_path: Path) -> None:
    async def act(commands: RigCommands, told: Told) -> None:
        commands.arm("render", PAGE)
        commands.start("render", PAGE)
        ended = await told.end()
        assert (ended.code, ended.sentence) == (3, "rendered 2 strokes FAIL  lag  9, at most 3")

    text = """
    print("rendered 2 strokes", "pass  x", "FAIL  lag  9, at most 3", sep=chr(10))
    sys.exit(3)
    """
    trial(tmp_path, act, **program(text))


def test_a_program_that_is_not_there_is_a_sentence(tmp_path: Path) -> None:
    async def act(commands: RigCommands, told: Told) -> None:
        commands.arm("render", PAGE)
        commands.start("render", PAGE)
        ended = await told.end()
        assert ended.code == 1
        assert "cannot be started: No such file" in ended.sentence

    trial(tmp_path, act, program=(str(tmp_path / "nothing"),))


def test_one_that_leaves_its_pipes_to_another_is_over_all_the_same(tmp_path: Path) -> None:
    async def act(commands: RigCommands, told: Told) -> None:
        commands.arm("render", PAGE)
        commands.start("render", PAGE)
        assert (await told.end()).sentence == "done"

    text = """
    import subprocess
    subprocess.Popen([sys.executable, "-c", "import time; time.sleep(60)"])
    print("done", flush=True)
    """
    trial(tmp_path, act, **program(text))
