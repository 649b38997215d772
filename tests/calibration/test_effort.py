"""Which candidates each effort fits."""

from collections.abc import Sequence
from dataclasses import dataclass

import pytest

from scissorcal.calibration.fit_model import candidates_for, draft_note


@dataclass(frozen=True)
class Law:
    """A candidate with a name alone."""

    name: str


LADDER = (Law("coulomb"), Law("coulomb + viscous"), Law("stribeck"))


def simplest(candidates: Sequence[Law]) -> Law:
    return candidates[0]


def test_draft_takes_the_law_that_was_chosen_last() -> None:
    assert candidates_for("draft", LADDER, simplest, "coulomb + viscous") == (LADDER[1],)


def test_draft_takes_the_usual_law_where_nothing_was_chosen_or_the_ladder_lacks_it() -> None:
    assert candidates_for("draft", LADDER, simplest) == (LADDER[0],)
    assert candidates_for("draft", LADDER, simplest, "a law of another recipe") == (LADDER[0],)
    left = candidates_for("draft", LADDER, simplest, among=("stribeck", "coulomb + viscous"))
    assert left == (LADDER[1],)


@pytest.mark.parametrize("effort", ["standard", "thorough"])
def test_other_efforts_compare_all(effort: str) -> None:
    assert candidates_for(effort, LADDER, simplest, "stribeck") == LADDER
    assert draft_note(effort, LADDER, LADDER) == ()


def test_a_note_says_that_nothing_was_compared() -> None:
    (note,) = draft_note("draft", LADDER, candidates_for("draft", LADDER, simplest))
    assert "one law of 3, coulomb" in note
    assert draft_note("draft", LADDER[:1], LADDER[:1]) == ()


def test_an_empty_ladder_is_refused() -> None:
    with pytest.raises(ValueError, match="allows no law"):
        candidates_for("draft", (), simplest)
