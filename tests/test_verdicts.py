"""Verdicts say on which side of their limit a value is good, and what they guard."""

import ast
from pathlib import Path

import pytest

import scissorcal
from scissorcal.verdicts import MEANINGS, TORQUE, Verdict

BUILDERS = ("Verdict", "judge", "not_evaluated")
PACKAGE = Path(scissorcal.__file__).parent
DOCS = PACKAGE.parents[1] / "docs"


def checks_in_source() -> set[str]:
    """Names of checks that the source builds verdicts of, as far as they stand there in quotes."""
    found: set[str] = set()
    for path in PACKAGE.rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if not isinstance(node, ast.Call) or not isinstance(node.func, ast.Name):
                continue
            if node.func.id not in BUILDERS:
                continue
            words = [
                argument.value
                for argument in node.args[1:2]
                if isinstance(argument, ast.Constant) and isinstance(argument.value, str)
            ]
            if words:
                found.add(words[-1])
    return found


def test_every_check_in_the_source_has_a_direction_and_a_meaning():
    checks = checks_in_source()
    assert {"k-hat", "focal length", "round trip", "bound share"} <= checks
    known = {key.partition(" ")[2] for key in MEANINGS}
    assert checks <= known


@pytest.mark.parametrize(
    ("scope", "check", "limit"),
    [
        ("fit.cut", "hold-out", "at most"),
        ("fit.friction", "whiteness", "at least"),
        ("verify.cut", "halves", "at least"),
        ("fit.plate", "halves", "at most"),
        ("fit.blade.upper", "clear edge", "at most"),
    ],
)
def test_a_verdict_states_the_direction_of_its_limit(scope, check, limit):
    verdict = Verdict(scope, check, "pass", 0.5, 0.2, "Why.")
    assert verdict.limit == limit
    assert verdict.limited == f"0.5, {limit} 0.2"
    assert verdict.as_dict()["limit"] == limit
    assert verdict.guards


def test_verdicts_on_torque_are_told_from_the_others():
    assert Verdict("fit.cut", "hold-out", "pass", 0.1, 0.2, "").bounds_torque
    assert not Verdict("fit.cut", "k-hat", "pass", 0.1, 0.7, "").bounds_torque


def test_a_verdict_without_a_number_states_no_limit():
    assert Verdict("fit.cut", "hold-out", "not_evaluated", None, 0.2, "").limited == ""
    assert Verdict("elsewhere", "new", "pass", 1.0, 2.0, "").limited == "1"


def test_the_page_on_verdicts_has_a_row_for_every_check():
    if not DOCS.is_dir():
        pytest.skip("the documentation is not installed")
    page = (DOCS / "verdicts.md").read_text(encoding="utf-8")
    for key, (limit, guards) in MEANINGS.items():
        scope, _, check = key.partition(" ")
        said = guards.removeprefix(TORQUE)
        kind = "torque" if guards.startswith(TORQUE) else ""
        assert f"| {scope} | *{check}* | {limit} | {kind} | {said} |" in page, key
