"""Dataclasses of options as parameters of commands."""

from dataclasses import dataclass
from typing import Any

import pytest
import typer

from scissorcal.cli.options import gathered, options_of, parameters_of


@dataclass(frozen=True)
class Cooking:
    dish: str
    minutes: float = 10.0
    salt: bool = True


WORDS = {"dish": typer.Argument(help="What."), "minutes": typer.Option("--min", help="How long.")}


@options_of(WORDS)
def cook(how: Cooking, stove: int = 2) -> Any:
    return how, stove


def test_each_field_with_words_is_an_option_of_its_type_and_default() -> None:
    dish, minutes, stove = parameters_of(cook)
    assert (dish.name, dish.default) == ("dish", dish.empty)
    assert dish.annotation.__metadata__ == (WORDS["dish"],)
    assert (minutes.name, minutes.default) == ("minutes", 10.0)
    assert minutes.annotation.__origin__ is float
    assert (stove.name, stove.default) == ("stove", 2)


def test_the_command_gets_the_dataclass_and_fields_without_words_keep_their_default() -> None:
    given = gathered(cook, {"dish": "rice", "minutes": 12.0, "stove": 1})
    assert cook(**given) == (Cooking("rice", 12.0, salt=True), 1)


def test_words_of_a_field_that_is_not_there_are_refused() -> None:
    with pytest.raises(TypeError, match="takes no dataclass with pepper"):
        options_of({**WORDS, "pepper": typer.Option()})(cook)
