"""A check is a row beside what measures it: only rows give verdicts, files keep what they hold."""

import ast
from dataclasses import asdict
from pathlib import Path
from typing import Any

import pytest

import scissorcal
from scissorcal.calibration import HALVES, HOLD_OUT, K_HAT
from scissorcal.verdicts import Check, Verdict

PACKAGE = Path(scissorcal.__file__).parent
MAKERS = {"verdicts.py", "recording/probe.py"}
"""The row's own method, and what reads verdicts of a file."""


def calls(tree: ast.AST, name: str) -> set[int]:
    """Lines on which a name is called."""
    nodes = (node for node in ast.walk(tree) if isinstance(node, ast.Call))
    return {n.lineno for n in nodes if isinstance(n.func, ast.Name) and n.func.id == name}


def test_rows_are_constants_and_nothing_else_makes_a_verdict() -> None:
    wrong = []
    for path in PACKAGE.rglob("*.py"):
        tree = ast.parse(path.read_text(encoding="utf-8"))
        inside = [node for node in tree.body if isinstance(node, ast.FunctionDef | ast.ClassDef)]
        lines = {line for node in inside for line in calls(node, "Check")}
        if path.relative_to(PACKAGE).as_posix() not in MAKERS:
            lines |= calls(tree, "Verdict")
        wrong += [f"{path}:{line}" for line in sorted(lines)]
    assert not wrong, "\n".join(wrong)


def test_a_row_judges_by_its_limit_or_the_one_that_is_stated() -> None:
    assert HOLD_OUT.judge(0.2, "Good.").status == "pass"
    assert HOLD_OUT.judge(0.3, "Good.", "Bad.").why == "Bad."
    assert HOLD_OUT.judge(float("nan"), "Good.").status == "fail"
    assert K_HAT.judge(0.8, "Good.", threshold=0.7).limited == "0.8, at most 0.7"
    least = Check("fit strokes", "ratio of speeds", at_least=1.5)
    assert least.judge(1.5, "Good.").limited == "1.5, at least 1.5"
    for without in (K_HAT, Check("probe enable", "whether motors follow")):
        with pytest.raises(ValueError, match="no limit to judge by"):
            without.judge(0.3, "Good.")
        assert without.not_evaluated("Why.").threshold is None


def test_a_verdict_takes_all_but_its_outcome_from_the_row() -> None:
    verdict = HALVES.not_evaluated("Too few corners.", threshold=22)
    assert verdict.as_dict() == {
        "scope": "fit.plate",
        "check": "halves",
        "status": "not_evaluated",
        "value": None,
        "threshold": 22.0,
        "why": "Too few corners.",
        "limit": "at most",
        "guards": HALVES.guards,
    }


def test_a_verdict_is_of_a_part_of_its_scope_and_of_no_other() -> None:
    assert K_HAT.not_evaluated("Why.").of("fit.cut").scope == "fit.cut"
    with pytest.raises(ValueError, match=r"k-hat is of fit, not of verify\.cut"):
        K_HAT.not_evaluated("Why.").of("verify.cut")


@pytest.mark.parametrize(
    ("field", "wrong"),
    [
        ("scope", 3),
        ("check", None),
        ("why", b"bytes"),
        ("guards", ["text"]),
        ("status", "passed"),
        ("status", True),
        ("limit", "below"),
        ("value", "0.3"),
        ("threshold", [0.3]),
    ],
)
def test_a_field_of_another_type_is_refused(field: str, wrong: Any) -> None:
    with pytest.raises(TypeError):
        Verdict(**{**asdict(HOLD_OUT.judge(0.1, "Good.")), field: wrong})


def test_a_file_with_a_check_that_no_row_has_is_read_as_it_is() -> None:
    held = {"scope": "elsewhere", "check": "new", "status": "pass", "value": 1, "threshold": 2}
    assert Verdict(**held, why="").limited == "1"
    assert Verdict(**held, why="", limit="at most", guards="N").limited == "1, at most 2"
