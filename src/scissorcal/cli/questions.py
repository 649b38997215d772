"""Questions of a command that another program answers, over pipes: the page of a prototype does.

With SCISSORCAL_QUESTIONS=pipe in the environment a command writes each question as a line on stderr
that begins with the character U+001E, and waits for a line "yes" on stdin. It ends, as by Ctrl-C,
where stdin ends: the program that answers is gone.
"""

import contextlib
import os
import queue
import signal
import sys
import threading
import time
from collections.abc import Iterator

import typer

from scissorcal.cli.terminal import printable

QUESTION = "\x1e"
"""No text that `terminal.echo` prints has this character, so that none can pass for a question."""
PATIENCE_s = 10.0
"""After the end of stdin until a command that does not end is terminated."""

answers: queue.Queue[bool] | None = None
"""What the program said, True for yes, False where it is gone; None where nobody listens."""


@contextlib.contextmanager
def asked_by_pipe() -> Iterator[None]:
    """Read answers from stdin while a command runs, and end the command where stdin ends."""
    global answers
    answers = queue.Queue()
    before = signal.signal(signal.SIGINT, signal.default_int_handler)  # a shell may ignore it
    threading.Thread(target=_listen, args=(answers,), name="answers", daemon=True).start()
    try:
        yield
    finally:
        answers = None
        signal.signal(signal.SIGINT, before)


def ask(request: str) -> None:
    """Ask, and wait until it is answered with yes. Raises typer.Abort where nobody is left."""
    assert answers is not None
    while not answers.empty():  # what was said before it was asked is no answer
        if not answers.get():
            raise typer.Abort
    sys.stderr.write(f"{QUESTION}{printable(request)}\n")
    sys.stderr.flush()
    if not answers.get():
        raise typer.Abort


def _listen(heard: queue.Queue[bool]) -> None:
    """Read the file itself: a thread that waits in a buffer of Python would hold up its end."""
    rest = b""
    while block := _read():
        *lines, rest = (rest + block).split(b"\n")
        for _ in range(lines.count(b"yes")):
            heard.put(True)
        rest = rest[-4096:]
    heard.put(False)
    if answers is heard:
        os.kill(os.getpid(), signal.SIGINT)
        time.sleep(PATIENCE_s)
    if answers is heard:
        os.kill(os.getpid(), signal.SIGTERM)


def _read() -> bytes:
    """What stdin gives next; nothing where it has ended, was closed or cannot be read."""
    try:
        return os.read(0, 4096)
    except OSError:
        return b""
