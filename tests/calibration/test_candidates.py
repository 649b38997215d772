"""What is said of a comparison is true of its rows."""

import pytest

from scissorcal.calibration.candidates import CandidateRow, comparison_sentence


def row(name: str, parameters: int, equivalent: bool = True, chosen: bool = False) -> CandidateRow:
    return CandidateRow(name, parameters, -10.0, 1.0, 0.5, equivalent, chosen)


def test_the_simplest_is_called_so():
    rows = (row("a", 3, chosen=True), row("b", 5), row("c", 2, equivalent=False))
    assert comparison_sentence(rows, "strokes") == (
        "a is used: the simplest of 2 candidates that hold-out strokes do not distinguish from "
        "the best. The other is b."
    )


@pytest.mark.parametrize("others", [1, 2])
def test_a_candidate_with_more_parameters_than_an_equivalent_one_is_not_called_simplest(others):
    rows = (row("a", 6, chosen=True), *(row(f"b{i}", 5 + i) for i in range(others)))
    sentence = comparison_sentence(rows, "strokes")
    assert sentence.startswith(f"a is used, one of {others + 1} candidates that hold-out strokes")
    assert "though not the simplest (see notes)" in sentence


def test_where_every_other_is_worse_nothing_is_said_of_equivalents():
    rows = (row("a", 6, chosen=True), row("b", 2, equivalent=False))
    expected = "a is used: every other candidate predicts hold-out strokes worse."
    assert comparison_sentence(rows, "strokes") == expected
