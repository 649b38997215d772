"""Run a parser that is written in C in a child process, which may crash or run out of anything.

A child is started with the first file that needs one, serves one file at a time, and is used again
by later ones, so that sixty photographs start one interpreter. One that dies, or does not answer in
time, is replaced. Each thread that reads at the same time has a separate child. Worker processes
have children of their process alone: what a fork inherits is closed unused.

Nothing is pickled: a request names a function of scissorcal, an answer is numbers, text and bytes
(:mod:`scissorcal.foreign.parser_process`).
"""

import atexit
import contextlib
import os
import signal
import subprocess
import sys
import threading
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from scissorcal.errors import InputError, MissingError, ScissorcalError
from scissorcal.foreign.formats import Format
from scissorcal.foreign.parser_process import FrameError, read_frame, write_frame

START_S = 120.0
"""Time to start an interpreter; it takes 0.05 s, on a loaded machine some seconds."""

MOST_HELD_BYTES = 4_000_000_000
"""A child that keeps more after its answer is replaced, since each file may add its own limit."""

_HEAD_BYTES = 1_000_000
_PROGRAM = (
    "import sys; sys.path[:] = sys.argv[1:]; "
    "from scissorcal.foreign.parser_process import serve; serve()"
)


class _DiedError(Exception):
    """The child ended or was ended; the message is a sentence on why."""


class _Child:
    """A child process that parses; ``alive`` until it died or was closed."""

    def __init__(self) -> None:
        source = str(Path(__file__).parents[2])
        paths = [source, *(path for path in sys.path if path and path != source)]
        environment = {**os.environ, **_QUIET}
        try:
            self._process = subprocess.Popen(
                [sys.executable, "-S", "-E", "-B", "-c", _PROGRAM, *paths],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                env=environment,
                bufsize=0,
            )
        except OSError as error:
            raise ScissorcalError(_not_started(str(error))) from error
        self.alive = True
        try:
            with self._within(START_S):
                self._receive(_HEAD_BYTES)
        except (EOFError, FrameError, OSError):
            code = self._end()
            raise ScissorcalError(_not_started(f"exit code {code}")) from None
        except BaseException:
            self._end()
            raise

    @property
    def pid(self) -> int:
        """The number of the process."""
        return self._process.pid

    @property
    def runs(self) -> bool:
        """Whether the process has not ended by itself, or by somebody's hand."""
        return self._process.poll() is None

    def ask(
        self, function: str, data: bytes, options: dict[str, Any], kind: Format
    ) -> dict[str, Any]:
        """The answer to one request; _DiedError where none came."""
        limits = {"memory": kind.memory_bytes, "processor_s": kind.processor_s}
        request = {"function": function, "options": options, "limits": limits, "data": data}
        try:
            with self._within(kind.wall_s) as watch:
                assert self._process.stdin is not None
                with contextlib.suppress(BrokenPipeError):  # why it ended is told by its exit code
                    write_frame(self._process.stdin, request)
                answer = self._receive(kind.memory_bytes)
        except (EOFError, FrameError, OSError):
            code = self._end()
            raise _DiedError(_why(code, watch.late, kind)) from None
        except MemoryError:
            self._end()
            raise _DiedError(f"it unpacks to {kind.memory}.") from None
        except BaseException:  # such as Ctrl-C: what the child still sends is nobody's answer
            self._end()
            raise
        if not isinstance(answer, dict):
            self._end()
            raise _DiedError("its parser gave no answer.")
        if answer.pop("held", 0) > MOST_HELD_BYTES:
            self.close()
        return answer

    def close(self) -> None:
        """End the process: it does so itself when its input ends."""
        self.alive = False
        for stream in (self._process.stdin, self._process.stdout):
            if stream is not None:
                stream.close()
        try:
            self._process.wait(2.0)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()

    def forget(self) -> None:
        """Close what a fork inherited; the process is the parent's, and goes on."""
        self.alive = False
        for stream in (self._process.stdin, self._process.stdout):
            if stream is not None:
                stream.close()
        self._process.returncode = 0  # not ours to wait for

    def _receive(self, most_bytes: int) -> Any:
        stream: Any = self._process.stdout
        return read_frame(stream.readinto, most_bytes)

    def _end(self) -> int:
        """Kill the process where it still runs; its exit code, -n where signal n ended it."""
        self.alive = False
        try:
            code = self._process.wait(0.2)
        except subprocess.TimeoutExpired:
            self._process.kill()
            code = self._process.wait()
        self.close()
        return code

    @contextlib.contextmanager
    def _within(self, seconds: float) -> "Iterator[_Watch]":
        """Kill the process where the block takes longer, which ends what the block waits for."""
        watch = _Watch(self._process)
        timer = threading.Timer(seconds, watch.end)
        timer.daemon = True
        timer.start()
        try:
            yield watch
        finally:
            timer.cancel()


class _Watch:
    """Whether a process was ended because it took too long."""

    def __init__(self, process: "subprocess.Popen[bytes]") -> None:
        self.process, self.late = process, False

    def end(self) -> None:
        self.late = True
        self.process.kill()


def _why(code: int, late: bool, kind: Format) -> str:
    """Why a child died, as a sentence."""
    if late:
        return f"its parser did not end within {kind.wall_s:g} s."
    if code == -getattr(signal, "SIGXCPU", 0):
        return f"its parser took more than {kind.processor_s} s of processor time."
    if code in (-getattr(signal, "SIGKILL", 0), 137):
        return "its parser was ended by the system, as it is where memory runs out."
    name = next((s.name for s in signal.Signals if s.value == -code), f"exit code {code}")
    return f"its parser crashed ({name})."


def _not_started(why: str) -> str:
    return (
        f"The process that parses foreign files cannot be started ({why}). Check that "
        f"{sys.executable} runs, and that the system has memory and processes left."
    )


_QUIET = {"OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1", "MKL_NUM_THREADS": "1"}
"""Threads of linear algebra would only reserve memory."""


def parse_isolated(
    function: str, data: bytes, path: Path | str, kind: Format, /, **options: Any
) -> Any:
    """What ``function`` of scissorcal makes of a file's bytes, in a child process with limits.

    ``function`` is "module:name" and takes the bytes and ``options`` (plain values, by name); it
    returns a plain value and imports what it needs. An InputError that it raises is raised here.
    Everything else that happens to it - another error, a crash, more than the format's memory or
    time - is an InputError that names ``path`` and the format's remedy.

    Raises ScissorcalError where no child process can be started, which is not the file's fault.
    """
    child = _waiting() or _Child()
    try:
        answer = child.ask(function, data, options, kind)
    except _DiedError as death:
        raise InputError(f"{path} is damaged: {death} {kind.remedy}") from None
    finally:
        if child.alive:
            _idle.append(child)
    if "value" in answer:
        return answer["value"]
    raise _reported(answer, path, kind)


def idle_children() -> tuple[_Child, ...]:
    """The children that wait for a file."""
    return tuple(_idle)


def close_children() -> None:
    """End all children that wait for a file; the next file starts one anew."""
    while _idle:
        _idle.pop().close()


def _waiting() -> _Child | None:
    """A child that waits for a file; None where there is none, or all have ended meanwhile."""
    while _idle:
        try:
            child = _idle.pop()
        except IndexError:  # another thread took the last one
            return None
        if child.runs:
            return child
        child.close()
    return None


def _reported(answer: dict[str, Any], path: Path | str, kind: Format) -> ScissorcalError:
    said = str(answer.get("said", ""))[:500]
    what = answer.get("error")
    if what == "input":
        return InputError(said)
    if what == "missing":
        return MissingError(said)
    if what == "memory":
        return InputError(f"{path} is damaged: it takes {kind.memory} to read. {kind.remedy}")
    return InputError(f"{path} is not {kind.name}, or it is damaged ({said}). {kind.remedy}")


_idle: list[_Child] = []


def _forget_all() -> None:
    while _idle:
        _idle.pop().forget()


atexit.register(close_children)
if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_forget_all)
