"""The old key ``rung`` of the fits of friction: what it means, and what stays as it was."""

import pytest

from scissorcal.errors import InputError, OldWordWarning
from scissorcal.recipe import parse_recipe, recipe_path

OLD = '\n[fit.friction]\nrung = "stribeck"\n\n[fit.friction_advance]\nrung = "coulomb"\n'


def test_an_old_key_means_what_the_new_one_does() -> None:
    text = recipe_path("paper-80gsm").read_text(encoding="utf-8")
    with pytest.warns(OldWordWarning, match="Version 0.2"):
        old = parse_recipe(text + OLD)
    assert old == parse_recipe(text + OLD.replace("rung", "law"))
    assert (old.fit.friction.law, old.fit.friction_advance.law) == ("stribeck", "coulomb")
    assert parse_recipe(text + OLD, judged=False) == old  # that of a recording: no note


def test_both_keys_are_refused() -> None:
    text = recipe_path("paper-80gsm").read_text(encoding="utf-8")
    both = '\n[fit.friction]\nlaw = "coulomb"\nrung = "stribeck"\n'
    with pytest.raises(InputError, match="has both law and rung, its old name"):
        parse_recipe(text + both)


def test_tables_of_another_kind_are_named_as_before() -> None:
    text = recipe_path("paper-80gsm").read_text(encoding="utf-8")
    for wrong in ("fit = 3\n" + text, text + '\n[fit]\nfriction = "stribeck"\n'):
        with pytest.raises(InputError, match="fit"):
            parse_recipe(wrong)
