"""Examples in docstrings print what they say.

They run in an empty folder. Commands are left out: their examples are shown, not run.
"""

import doctest
import importlib
import pkgutil
from pathlib import Path

import pytest

import scissorcal

SKIPPED = ("scissorcal.cli", "scissorcal.kernel._kernel", "scissorcal.kernel._firmware")
MODULES = [
    "scissorcal",
    *(
        module.name
        for module in pkgutil.walk_packages(scissorcal.__path__, "scissorcal.")
        if not module.name.startswith(SKIPPED)
    ),
]


def examples_of(name: str) -> list[doctest.DocTest]:
    """Every docstring of a module that holds an example."""
    found = doctest.DocTestFinder().find(importlib.import_module(name))
    return [test for test in found if test.examples]


EXAMPLES = [test for name in MODULES for test in examples_of(name)]


def test_the_pure_rooms_have_examples():
    rooms = {test.name.split(".")[1] for test in EXAMPLES if "." in test.name}
    assert {"model", "recording", "recipe", "verdicts"} <= rooms


@pytest.mark.parametrize("test", EXAMPLES, ids=[test.name for test in EXAMPLES])
def test_example_prints_what_it_says(
    test: doctest.DocTest, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    monkeypatch.chdir(tmp_path)
    told: list[str] = []
    result = doctest.DocTestRunner(verbose=False).run(test, out=told.append)
    assert result.failed == 0, "".join(told)
