"""Commands of the rig that a page starts and stops: each is the command line itself, in a process.

So every check, limit and question of the command line holds for the page as well. What a command
asks of a person is asked on the page, and the command waits until it is answered there.
"""

import asyncio
import contextlib
import os
import re
import signal
import sys
from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal, NamedTuple

ARMED_s = 60.0
"""After which a start that was not confirmed is forgotten."""
PATIENCE_s = (15.0, 5.0)
"""After Ctrl-C until the command is asked to terminate, and from then until it is killed."""
LONGEST_LINE = 500
QUESTION = "\x1e"
"""Begins a line on stderr that is a question. Nothing else that the command line prints can have
it: control characters in texts are spelled out."""
ENVIRONMENT = {"SCISSORCAL_QUESTIONS": "pipe"}
"""Has a command ask by such lines, wait for a line "yes" on stdin, and end where stdin ends."""

_PROGRESS = re.compile(r"^\s*\d+ %  ")
_FIRST_LINES, _LAST_LINES = 100, 3
_ASK_EVERY_s = 0.03
LEFT_s = 2.0
"""For the last words of a command that has ended."""


class RigCommand(NamedTuple):
    """A command that a page may start: its name, the words after ``scissorcal``, and what a person
    is asked before anything moves."""

    name: str
    words: tuple[str, ...]
    request: str


@dataclass(frozen=True)
class State:
    """What a page is told of commands.

    ``request`` is the sentence that waits for an answer, ``question`` its number while a command
    runs: an answer names it, so that it answers nothing that its page did not show.
    """

    state: Literal["idle", "running", "ending"] = "idle"
    command: str | None = None
    sentence: str = ""
    code: int | None = None
    request: str | None = None
    question: int = 0


class RefusedError(Exception):
    """What a page asked for is not done; the message says why, as a sentence."""


class RigCommands:
    """Arms, starts and stops the ``commands``, one at a time, in the folder ``root``.

    ``tell`` is called with the state whenever it changes. ``who`` names the page that asks: the
    page that armed a command is the one that confirms it, and any page may stop it.
    """

    def __init__(
        self,
        commands: Sequence[RigCommand],
        root: Path,
        tell: Callable[[State], None],
        *,
        armed_s: float = ARMED_s,
        patience_s: tuple[float, float] = PATIENCE_s,
        program: Sequence[str] = (sys.executable, "-m", "scissorcal"),
    ) -> None:
        self.commands = {command.name: command for command in commands}
        self.state = State()
        self._root = root
        self._tell = tell
        self._armed_s = armed_s
        self._patience_s = patience_s
        self._program = program
        self._armed: tuple[RigCommand, object] | None = None
        self._expiry: asyncio.TimerHandle | None = None
        self._process: asyncio.subprocess.Process | None = None
        self._watch: asyncio.Task[None] | None = None
        self._insisting: asyncio.Task[None] | None = None
        self._unasked = False
        self._questions = 0
        self._stopped = False
        self._lines: deque[str] = deque(maxlen=_LAST_LINES)

    def arm(self, name: str, who: object) -> None:
        """Ask what has to be confirmed before ``name`` is started."""
        command = self._known(name)
        if self.runs:
            raise RefusedError(f"'{self.state.command}' is running: stop it first.")
        self._disarm()
        self._armed = (command, who)
        self._expiry = asyncio.get_running_loop().call_later(self._armed_s, self._expire)
        self._set(State("idle", name, "", None, command.request))

    def start(self, name: str, who: object, question: int = 0) -> None:
        """Start what this page armed; or, while it runs, answer this question with yes."""
        command = self._known(name)
        if self.runs:
            self._answer(name, question)
            return
        if self._armed is None:
            raise RefusedError(f"'{name}' was not armed, or more than {self._armed_s:g} s ago.")
        if self._armed != (command, who):
            armed = self._armed[0].name
            raise RefusedError(f"'{armed}' was armed, or by another page: arm '{name}' first.")
        self._disarm()
        self._lines.clear()
        self._unasked, self._stopped = True, False
        self._set(State("running", command.name, "Starting."))
        self._watch = asyncio.create_task(self._run(command))

    def stop(self) -> None:
        """End what runs, as Ctrl-C does; forget what is armed."""
        self._disarm()
        if not self.runs:
            self._set(State(sentence="Nothing is running."))
        elif not self._stopped:
            self._stopped = True
            self._lines.clear()
            self._set(replace(self.state, state="ending", sentence="Stopping.", request=None))
            if self._process is not None:
                self._end(self._process)

    @property
    def runs(self) -> bool:
        """Whether a command is starting, running or ending."""
        return self._watch is not None and not self._watch.done()

    async def close(self) -> None:
        """Stop what runs and wait until it has ended."""
        if self._watch is not None and self.runs:
            self.stop()
            await self._watch
        self._disarm()

    def leave(self, who: object) -> None:
        """A page is gone: what it armed is forgotten, what runs goes on."""
        if self._armed is not None and self._armed[1] == who:
            self._disarm()
            self._set(State())

    def _known(self, name: str) -> RigCommand:
        if name not in self.commands:
            names = ", ".join(f"'{known}'" for known in self.commands) or "none"
            raise RefusedError(f"There is no such command here (there are: {names}).")
        return self.commands[name]

    async def _run(self, command: RigCommand) -> None:
        pipe = asyncio.subprocess.PIPE
        words = (*self._program, *command.words)
        if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
            # as in a background job of a shell; the command would ignore the stop, too
            signal.signal(signal.SIGINT, signal.default_int_handler)
        try:
            process = await asyncio.create_subprocess_exec(
                *words,
                stdin=pipe,
                stdout=pipe,
                stderr=pipe,
                cwd=self._root,
                env={**os.environ, **ENVIRONMENT},
                start_new_session=True,
            )
        except OSError as error:
            sentence = f"'{command.name}' cannot be started: {error.strerror}."
            self._set(State("idle", command.name, sentence, 1))
            return
        self._process = process
        if self._stopped:
            self._end(process)
        assert process.stdout is not None
        assert process.stderr is not None
        said: list[str] = []
        readers = asyncio.gather(
            _each_line(process.stdout, lambda line: _keep(said, line)),
            _each_line(process.stderr, self._heard),
        )
        try:
            code = await _ended(process)
            await asyncio.wait({readers}, timeout=LEFT_s)  # what it left may hold the pipes
        finally:
            self._signal(signal.SIGKILL)
            await asyncio.wait({readers}, timeout=LEFT_s)
            readers.cancel()
            self._process = None
        self._set(State("idle", command.name, self._end_sentence(said, code), code))

    def _heard(self, line: str) -> None:
        if line.startswith(QUESTION):
            self._asked(line.removeprefix(QUESTION))
            return
        if not line.strip():
            return
        if _PROGRESS.match(line):
            self._lines.clear()
        else:
            self._lines.append(line)
        if self.state.state == "running":
            self._set(replace(self.state, sentence=line.strip()))

    def _asked(self, question: str) -> None:
        """The first question is answered already, where it is what was confirmed on the page."""
        command = self.commands.get(self.state.command or "")
        first, self._unasked = self._unasked, False
        if first and command is not None and question == command.request:
            self._say_yes()
        elif self.state.state == "running":
            self._questions += 1
            self._set(replace(self.state, request=question, question=self._questions))

    def _answer(self, name: str, question: int) -> None:
        if self.state.state != "running" or self.state.request is None:
            raise RefusedError(f"'{self.state.command}' is running already.")
        if name != self.state.command:
            raise RefusedError(f"'{self.state.command}' is running: stop it first.")
        if question != self.state.question:
            raise RefusedError("That was answered already: read the question that is shown now.")
        self._set(replace(self.state, request=None))
        self._say_yes()

    def _say_yes(self) -> None:
        assert self._process is not None
        assert self._process.stdin is not None
        with contextlib.suppress(ConnectionError):  # it has ended: that is told anyway
            self._process.stdin.write(b"yes\n")

    def _end(self, process: asyncio.subprocess.Process) -> None:
        self._signal(signal.SIGINT)
        self._insisting = asyncio.create_task(self._insist(process))

    def _signal(self, number: signal.Signals) -> None:
        """To the command's whole group, as a terminal does."""
        if self._process is not None:
            with contextlib.suppress(ProcessLookupError):
                os.killpg(self._process.pid, number)

    async def _insist(self, process: asyncio.subprocess.Process) -> None:
        for patience_s, number in zip(
            self._patience_s, (signal.SIGTERM, signal.SIGKILL), strict=True
        ):
            with contextlib.suppress(TimeoutError):
                await asyncio.wait_for(_ended(process), patience_s)
                return
            self._signal(number)

    def _end_sentence(self, said: list[str], code: int) -> str:
        """What the command answered; where it failed, what it said last on stderr."""
        if code == 0 or (code > 0 and said):
            lines = [*said[:1], *(line for line in said[1:] if line.startswith("FAIL"))]
        elif any(line.startswith("Traceback") for line in self._lines):
            lines = [self._lines[-1]]
        else:
            lines = [line.removeprefix("Error: ") for line in self._lines]
        if self._stopped:
            lines = ["Stopped.", *(line for line in lines if line != "Interrupted.")]
        return " ".join(line.strip() for line in lines)[: 2 * LONGEST_LINE]

    def _disarm(self) -> None:
        self._armed = None
        if self._expiry is not None:
            self._expiry.cancel()
        self._expiry = None

    def _expire(self) -> None:
        if self._armed is not None:
            name = self._armed[0].name
            self._disarm()
            self._set(State(sentence=f"'{name}' was not confirmed within {self._armed_s:g} s."))

    def _set(self, state: State) -> None:
        self.state = state
        self._tell(state)


def _keep(lines: list[str], line: str) -> None:
    if line.strip() and len(lines) < _FIRST_LINES:
        lines.append(line)


async def _ended(process: asyncio.subprocess.Process) -> int:
    """The exit code; ``process.wait()`` waits for who else holds the pipes, too."""
    while process.returncode is None:
        await asyncio.sleep(_ASK_EVERY_s)
    return process.returncode


async def _each_line(stream: asyncio.StreamReader, take: Callable[[str], None]) -> None:
    """Pass on each line, cut to `LONGEST_LINE` characters; a line may be of any length."""
    rest = b""
    while block := await stream.read(8192):
        *lines, rest = (rest + block).split(b"\n")
        for line in lines:
            take(line.decode("utf-8", "replace").rstrip("\r")[:LONGEST_LINE])
        rest = rest[: 4 * LONGEST_LINE]
    if rest:
        take(rest.decode("utf-8", "replace")[:LONGEST_LINE])
