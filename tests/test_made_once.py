"""Shared set-ups are made once, whole or not at all."""

from pathlib import Path

import pytest

from tests.made_once import copied, made_once


def test_it_is_made_by_the_first_and_given_to_all(tmp_path_factory: pytest.TempPathFactory) -> None:
    calls = []

    def make(folder: Path) -> None:
        calls.append(folder)
        (folder / "value.txt").write_text("1")

    first = made_once(tmp_path_factory, "a value, seed=1", make)
    again = made_once(tmp_path_factory, "a value, seed=1", make)
    assert first == again
    assert len(calls) == 1
    assert (first / "value.txt").read_text() == "1"
    other = made_once(tmp_path_factory, "a value, seed=2", make)
    assert other != first
    assert len(calls) == 2


def test_a_failed_one_is_made_again(tmp_path_factory: pytest.TempPathFactory) -> None:
    def fail(folder: Path) -> None:
        (folder / "half.txt").write_text("")
        raise RuntimeError("half way")

    with pytest.raises(RuntimeError, match="half way"):
        made_once(tmp_path_factory, "interrupted", fail)
    whole = made_once(tmp_path_factory, "interrupted", lambda folder: (folder / "whole").mkdir())
    assert [path.name for path in whole.iterdir()] == ["whole"]


def test_a_copy_may_be_changed(tmp_path_factory: pytest.TempPathFactory, tmp_path: Path) -> None:
    shared = made_once(tmp_path_factory, "shared", lambda folder: (folder / "a").write_text("1"))
    mine = copied(shared, tmp_path / "mine")
    (mine / "a").write_text("2")
    assert (shared / "a").read_text() == "1"
