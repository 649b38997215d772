"""Sentences in the source use the words of the glossary: errors, verdicts, help, docstrings."""

import ast
import re
from functools import cache
from pathlib import Path

import pytest

import scissorcal
from tests.test_docs import ROOT, words_not_used

PACKAGE = Path(scissorcal.__file__).parent
NAME = re.compile(r"`+[^`]*`+|\w+ = |\w+(?:\.\w+)+")
HELD = sorted(PACKAGE.rglob("*.py"))
STORED = {("report/subjects/decision.py", "trust check")}
"""Names of values in files that were written before the word changed: the column of report.json."""


def sentences_of(source: str) -> list[tuple[int, str]]:
    """Line and text of every string that has a space and is no key of a dict.

    Left out are names of code and of settings (in backticks, dotted, or before an equals sign),
    and what an f-string inserts.
    """
    tree = ast.parse(source)
    texts: list[tuple[int, str]] = []
    inner: set[ast.AST] = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.JoinedStr):
            inner |= set(node.values)
            parts = [part.value for part in node.values if isinstance(part, ast.Constant)]
            texts.append((node.lineno, "{}".join(str(part) for part in parts)))
        elif isinstance(node, ast.Dict):
            inner |= {key for key in node.keys if key is not None}
        elif isinstance(node, ast.Constant) and isinstance(node.value, str) and node not in inner:
            texts.append((node.lineno, node.value))
    return [(line, NAME.sub(" ", text)) for line, text in texts if " " in text.strip()]


@cache
def not_used() -> re.Pattern[str]:
    words = "|".join(map(re.escape, words_not_used()))
    return re.compile(rf"\b(?:{words})\b", re.IGNORECASE)


def words_found(path: Path) -> list[str]:
    """The words that are not used, with the places of the sentences that use them."""
    place, found = path.relative_to(PACKAGE).as_posix(), []
    for line, text in sentences_of(path.read_text(encoding="utf-8")):
        flat = " ".join(text.split())
        if (place, flat) not in STORED:
            found += [f"{place}:{line}: {word}" for word in not_used().findall(flat)]
    return found


def test_sentences_are_told_from_keys():
    source = '''def f(rung):
    """A candidate, with ``rung`` in backticks."""
    raise ValueError(f"The rung {rung} " f"is not there: set rung = 1")
    return {"rung": 1, "fit rung": 2}
'''
    assert [text for _, text in sentences_of(source) if "rung" in text] == [
        "The rung {} is not there: set  1"
    ]


ROOMS = sorted({path.relative_to(PACKAGE).parts[0] for path in HELD})


@pytest.mark.parametrize("room", ROOMS)
def test_sentences_use_the_words_of_the_glossary(room):
    if not (ROOT / "docs" / "glossary.md").is_file():
        pytest.skip("the documentation is not installed")
    files = [path for path in HELD if path.relative_to(PACKAGE).parts[0] == room]
    assert not [word for path in files for word in words_found(path)]


OLD_NAMES = ("believed", "belief", "rung", "sledge", "stance", "told", "untold")
STILL_READ = {"stances"}
"""Names of options that version 0.2 no longer reads."""


def names_of(source: str) -> set[str]:
    """Names that a module gives: functions, classes, parameters, fields and variables."""
    names: set[str] = set()
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef):
            names.add(node.name)
        elif isinstance(node, ast.arg):
            names.add(node.arg)
        elif isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store):
            names.add(node.id)
        elif isinstance(node, ast.Attribute) and isinstance(node.ctx, ast.Store):
            names.add(node.attr)
    return names


def parts_of(name: str) -> set[str]:
    """The words of a name, in small letters, without a plural's s."""
    words = re.findall(r"[A-Z]+(?![a-z])|[A-Z]?[a-z]+", name)
    return {form for word in words for form in (word.lower(), word.lower().removesuffix("s"))}


def test_a_name_has_words():
    assert {"edge", "belief"} <= parts_of("EdgeBelief")
    assert "rung" in parts_of("RUNGS") & parts_of("best_rung")
    assert not parts_of("isinstance") & {"stance"}


@pytest.mark.parametrize("room", ROOMS)
def test_names_are_the_fields_nouns(room):
    files = [path for path in HELD if path.relative_to(PACKAGE).parts[0] == room]
    old = set(OLD_NAMES)
    named = {
        f"{path.relative_to(PACKAGE)}: {name}"
        for path in files
        for name in names_of(path.read_text(encoding="utf-8")) - STILL_READ
        if parts_of(name) & old and name != "OLD_LAW_KEY"
    }
    assert not named
