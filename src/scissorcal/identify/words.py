"""Sentences of the fit in the words of any joint: it has a position, an effort and a load."""

import re
from collections.abc import Iterator
from contextlib import contextmanager

from scissorcal.errors import InputError

_WORDS = (
    (r"^Imported from", "Read from"),
    (r"(State it, for example )(?!-u)", r"\1-u "),
    (r"Set the joint to (\w+)", r"Give --joint \1"),
    (r"'scissorcal import'", "'scissorcal identify'"),
    (r"handle_force needs the handle radius.*", "load needs a column."),
    (r"(\d+) closing and (\d+) opening strokes", r"\1 backward and \2 forward strokes"),
    (r"the negative \(closing\) one", "the negative one"),
    (r"the positive \(opening\) one", "the positive one"),
    (r"the (negative|positive) \((?:closing|opening)\)", r"the \1"),
    (r"\bmotor_torque\b", "effort"),
    (r"\bhandle_force\b", "load"),
    (r"\bopening\b", "position"),
    (r"\bdrive torque\b", "effort"),
    (r"\bcapture sweeps\b", "record strokes"),
    (r"\bcapture empty sweeps\b", "record strokes"),
    (r"\bCapture sweeps\b", "Record strokes"),
    (r"fit\.friction\.cutoff_Hz", "--cutoff-hz"),
    (r"fit\.friction\.law", "the law"),
    (r"\bsweep more slowly", "move more slowly"),
    (r"\bsweeps\b", "strokes"),
    (r"\bsweep\b", "stroke"),
    (r"; --critic asks it", "; --effort standard asks it"),
    (r"\bswept\b", "recorded"),
    (r", and import them again", ", and read them again"),
    (
        r"Friction of scissors keeps a level for each direction unless hold-out strokes exclude "
        r"it: unequal levels are felt at the handles, and the symmetric law has an offset of the "
        r"sensor in their place\.",
        "A level for each direction and a constant offset explain this log alike: the law has "
        "the levels.",
    ),
    (r"; it belongs to the rig, so packages do not render it", ""),
    (
        r"Not in the file, and set to 0: [^.]*\.",
        "",
    ),
)
"""What a fit of the rig says, and what that is of any joint."""


def plain(sentence: str) -> str:
    """A sentence of the fit in the words of any joint.

    >>> plain("4 closing and 4 opening strokes were found.")
    '4 backward and 4 forward strokes were found.'
    """
    for pattern, words in _WORDS:
        sentence = re.sub(pattern, words, sentence)
    return sentence.strip()


@contextmanager
def as_of_a_joint() -> Iterator[None]:
    """Put what is refused within the block into the words of any joint."""
    try:
        yield
    except InputError as error:
        said = plain(str(error))
        if said == str(error):
            raise
        raise InputError(said) from error
