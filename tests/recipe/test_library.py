"""Recipes and schemas are found, and a wrong name is met with the right ones."""

import pytest

from scissorcal.errors import InputError
from scissorcal.recipe.load import (
    builtin_recipe,
    recipe_names,
    recipe_path,
    schemas_dir,
    specimen_path,
)


def test_the_three_recipes_are_there() -> None:
    assert recipe_names() == (
        "cotton-cloth",
        "paper-80gsm",
        "paper-photographed",
        "paper-with-hole",
        "press-only",
    )


def test_every_recipe_names_a_specimen_that_exists() -> None:
    for name in recipe_names():
        specimen = builtin_recipe(name).specimen
        assert specimen_path(str(specimen)).is_file()


def test_a_wrong_name_is_met_with_the_right_ones() -> None:
    expected = 'There is no recipe called "paper-80".* Did you mean "paper-80gsm"'
    with pytest.raises(InputError, match=expected):
        recipe_path("paper-80")


def test_schemas_lie_in_one_folder() -> None:
    assert (schemas_dir() / "recipe.schema.json").is_file()
