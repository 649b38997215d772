"""Which candidates each effort fits."""

from dataclasses import dataclass

import pytest

from scissorcal.calibration.effort import candidates_for, draft_note


@dataclass(frozen=True)
class Law:
    """A candidate with a name alone."""

    name: str


LADDER = (Law("coulomb"), Law("coulomb + viscous"), Law("stribeck"))


def test_draft_takes_the_law_that_was_chosen_last() -> None:
    assert candidates_for("draft", LADDER, "coulomb + viscous", "coulomb") == (LADDER[1],)


def test_draft_takes_the_default_where_nothing_was_chosen_or_the_ladder_lacks_it() -> None:
    assert candidates_for("draft", LADDER, None, "coulomb") == (LADDER[0],)
    assert candidates_for("draft", LADDER, "a law of another recipe", "coulomb") == (LADDER[0],)


def test_draft_takes_the_richest_where_nothing_is_known() -> None:
    assert candidates_for("draft", LADDER) == (LADDER[2],)


@pytest.mark.parametrize("effort", ["standard", "thorough"])
def test_other_efforts_compare_all(effort: str) -> None:
    assert candidates_for(effort, LADDER, "stribeck") == LADDER
    assert draft_note(effort, LADDER, LADDER) == ()


def test_a_note_says_that_nothing_was_compared() -> None:
    (note,) = draft_note("draft", LADDER, candidates_for("draft", LADDER))
    assert "one law of 3, stribeck" in note
    assert draft_note("draft", LADDER[:1], LADDER[:1]) == ()


def test_an_empty_ladder_is_refused() -> None:
    with pytest.raises(ValueError, match="allows no law"):
        candidates_for("draft", ())
