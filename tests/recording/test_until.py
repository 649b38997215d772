"""Marks of captures until the tolerance."""

import pytest

from scissorcal.recording.header import UNTIL_MARK, UntilMark

GOING = UntilMark("", 3, 2, 1.2, 0.4, 0.8, 0.04, 0.07, 0.95)


def test_the_last_mark_counts_and_comes_back_as_it_was() -> None:
    ended = UntilMark("tolerance", 4, 2, 1.4, 0.0, 0.96, 0.03, 0.07, 0.95)
    marks = [(UNTIL_MARK, GOING.as_text()), ("stop", "STUCK"), (UNTIL_MARK, ended.as_text())]
    assert UntilMark.last_of(marks) == ended
    assert UntilMark.last_of(marks[:2]) == GOING
    assert UntilMark.last_of([("stop", "STUCK")]) is None


@pytest.mark.parametrize("ended", ["", "time", "out of reach", "no fit"])
def test_only_the_tolerance_counts_as_reached(ended: str) -> None:
    mark = UntilMark(ended, 3, 2, 1.2, 0.4, 0.99, 0.04, 0.07, 0.95, why="Friction is widest.")
    assert not mark.reached
    assert "reached at" not in mark.sentence
    assert ("Friction is widest." in mark.sentence) == bool(ended)


def test_names_of_a_later_version_are_passed_over() -> None:
    assert UntilMark.of({**GOING.as_dict(), "colour": "blue"}) == GOING
