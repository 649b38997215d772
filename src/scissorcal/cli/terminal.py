"""The way to the terminal: what is printed cannot command it, and a reader who left is no fault.

Names and notes in packages, recordings and recipes come from elsewhere. A terminal obeys escape
sequences in them: they could hide lines, set its title or type for the user. So every text is
printed with its control characters spelled out; only styles that `style` made stay.
"""

import os
import re
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any, cast

import typer

_CONTROL = re.compile(
    "[\x00-\x08\x0b-\x1f\x7f-\x9f\u061c\u200e\u200f\u2028-\u202e\u2066-\u2069]|\r\n?"
)
"""Control characters of ASCII and Latin-1 but tab and newline, and those that turn the direction of
writing or break lines (Unicode 16, UAX #9; such names pass for others)."""

_OWN_ESCAPE = f"<{os.urandom(16).hex()}>"
"""Stands for the escape character in our own styles until they are printed; nobody can guess it."""


def echo(text: str, *, err: bool = False) -> None:
    """Print text and a newline, on stdout or stderr; its control characters are spelled out."""
    typer.echo(printable(text).replace(_OWN_ESCAPE, "\x1b"), err=err)


def printable(text: str) -> str:
    r"""The text with control characters spelled out.

    >>> print(printable("paper\x1b]0;root\x07"))
    paper\x1b]0;root\x07
    """
    return _CONTROL.sub(_spelled, text)


def printable_json(text: str) -> str:
    """JSON of the same value, with the control characters that JSON allows in strings escaped."""
    return _CONTROL.sub(lambda found: "".join(f"\\u{ord(one):04x}" for one in found[0]), text)


def style(text: str, *, fg: str) -> str:
    """Text in a colour; `echo` leaves that colour in it."""
    return kept(typer.style(printable(text), fg=fg))


def kept(drawn: str) -> str:
    """What we drew for the terminal ourselves, of printable text: `echo` leaves it as it is."""
    return drawn.replace("\x1b", _OWN_ESCAPE)


def drawn(text: str) -> str:
    """Text with our styles as the terminal takes them, all else spelled out."""
    return printable(text).replace(_OWN_ESCAPE, "\x1b")


def _spelled(found: re.Match[str]) -> str:
    return found[0].encode("unicode_escape").decode()


@contextmanager
def patient_output() -> Iterator[None]:
    """Let stdout and stderr go nowhere once their reader has left, as with ``| head``.

    A reader who leaves has all that it wanted, so the command ends with its own exit code.
    """
    before = sys.stdout, sys.stderr
    sys.stdout, sys.stderr = (
        cast(Any, _Patient(stream)) if stream is not None else stream for stream in before
    )
    try:
        yield
    finally:
        for stream in (sys.stdout, sys.stderr):
            if stream is not None:
                stream.flush()
        sys.stdout, sys.stderr = before


class _Patient:
    """A stream whose writes go nowhere after a broken pipe."""

    def __init__(self, stream: Any) -> None:
        self._stream = stream

    def __getattr__(self, name: str) -> Any:
        return getattr(self._stream, name)

    def write(self, text: str) -> int:
        try:
            return int(self._stream.write(text))
        except BrokenPipeError:
            return self._gone(len(text))

    def flush(self) -> None:
        try:
            self._stream.flush()
        except BrokenPipeError:
            self._gone(0)

    def _gone(self, count: int) -> int:
        nowhere = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nowhere, self._stream.fileno())
        os.close(nowhere)
        return count
