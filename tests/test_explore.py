"""Property tests: the same examples in every run, and a search with fresh ones."""

import shlex
import subprocess
import sys
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.errors import FlakyStrategyDefinition

from tests.explore import command_for, environment, explore, falsifying_example, summary
from tests.explore_plugin import Tried, until

DRAW = """
import sys
from hypothesis import core, given, settings, strategies as st
from tests.property_profiles import use_profiles

use_profiles()
settings.load_profile(sys.argv[1])
core.global_force_seed = 7
for name in sys.argv[2:]:
    __import__(name)

@given(st.lists(st.floats(0.0, 1.0)), st.text())
def draw(numbers, words):
    print(numbers, ascii(words))

draw()
"""
CONFTEST = "from tests.property_profiles import use_profiles\n\nuse_profiles()\n"
NEVER_LARGE = """
from hypothesis import given, strategies as st

@given(st.integers())
def test_no_number_is_large(number):
    assert number < 1000

@given(st.integers())
def test_every_number_is_its_own(number):
    assert number == number
"""
ENDS = """
import os
from hypothesis import given, strategies as st

@given(st.integers())
def test_the_process_goes_on(number):
    os._exit(3)
"""


@pytest.mark.parametrize("profile", ["suite", pytest.param("explore", marks=pytest.mark.slow)])
def test_examples_depend_on_no_loaded_module_and_no_hash_seed(profile: str, tmp_path: Path) -> None:
    (tmp_path / "draw.py").write_text(DRAW)
    (tmp_path / "constants.py").write_text(f"MANY = {[n / 997 for n in range(1, 900)]}\n")
    drawn = [
        subprocess.run(
            [sys.executable, "draw.py", profile, *loaded],
            cwd=tmp_path,
            env=environment() | {"PYTHONHASHSEED": seed},
            capture_output=True,
            text=True,
            check=True,
        ).stdout
        for seed, loaded in (("1", []), ("2", ["constants"]))
    ]
    assert len(drawn[0].splitlines()) == 100
    assert drawn[0] == drawn[1]


@pytest.mark.slow
def test_a_failure_is_stated_with_the_command_that_shows_it_again(tmp_path: Path) -> None:
    (tmp_path / "conftest.py").write_text(CONFTEST)
    (tmp_path / "test_numbers.py").write_text(NEVER_LARGE)
    (failure,), tried = explore(0.0, ["test_numbers.py"], root=tmp_path)
    assert failure.test == "test_numbers.py::test_no_number_is_large"
    assert "number=1000," in falsifying_example(failure.said)
    assert [one.test for one in tried] == [failure.test]
    _, *words = shlex.split(command_for(failure))  # a path from the checkout's own folder
    again = subprocess.run(
        [sys.executable, *words],
        cwd=tmp_path,
        env=environment(),
        capture_output=True,
        text=True,
        check=False,
    )
    assert again.returncode == 1
    assert "number=1000," in again.stdout
    assert command_for(failure) in summary([failure], tried)


@pytest.mark.slow
def test_a_test_that_ends_its_process_is_a_failure(tmp_path: Path) -> None:
    (tmp_path / "conftest.py").write_text(CONFTEST)
    (tmp_path / "test_ends.py").write_text(ENDS)
    (failure,), tried = explore(0.0, ["test_ends.py"], root=tmp_path)
    assert failure.said.startswith("the test's process ended with code 3")
    assert tried == []


@pytest.mark.slow
def test_a_search_without_any_test_is_an_error(tmp_path: Path) -> None:
    with pytest.raises(SystemExit, match="No test ran"):
        explore(0.0, ["test_missing.py"], root=tmp_path)


def test_a_test_whose_time_is_up_tries_one_example_and_fails_nowhere() -> None:
    tried: list[int] = []

    @given(st.data())
    def draws_as_it_goes(data: st.DataObject) -> None:
        tried.append(data.draw(st.integers()))
        data.draw(st.lists(st.booleans()))

    ends = (pytest.skip.Exception, FlakyStrategyDefinition)
    with until(draws_as_it_goes, 0.0) as counted, pytest.raises(ends):
        draws_as_it_goes()
    assert tried == [0]
    assert counted == Tried(examples=1, failed=False, cut_short=True)
    draws_as_it_goes()
    assert len(tried) > 50
