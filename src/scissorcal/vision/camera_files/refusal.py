"""Why a camera file is not read, in words that follow its path."""

from collections.abc import Sequence

MOST_NAMED = 8
"""Names in one sentence; a file of a megabyte may have thousands."""


class RefusedError(ValueError):
    """What stands after the file's path in the sentence that refuses it.

    ``place`` is the key of the value that it is about.
    """

    def __init__(self, sentence: str, place: str = "") -> None:
        super().__init__(sentence)
        self.sentence = sentence
        self.place = place


def shown(names: Sequence[str]) -> str:
    """Some names, separated by commas, each cut where it is long.

    >>> shown(["a"] * 10)
    'a, a, a, a, a, a, a, a and 2 more'
    """
    some = ", ".join(short(name) for name in names[:MOST_NAMED])
    more = len(names) - MOST_NAMED
    return f"{some} and {more} more" if more > 0 else some


def short(word: object) -> str:
    """A word of a file as it may stand in a sentence: one line of at most 40 characters."""
    return " ".join(str(word).split())[:40]
