"""A recipe shown with its defaults is a recipe with the same meaning."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from scissorcal.errors import InputError
from scissorcal.recipe.load import (
    as_toml,
    parse_recipe,
    read_text,
    recipe_names,
    recipe_path,
    recipe_settings,
)
from scissorcal.recipe.priors import JointPriors

TEXT = read_text(recipe_path("paper-80gsm"))


@pytest.mark.parametrize("name", recipe_names())
@pytest.mark.parametrize("defaults", [False, True])
def test_what_is_shown_is_a_recipe_with_the_same_meaning(name, defaults):
    text = read_text(recipe_path(name))
    recipe = parse_recipe(text)
    shown = as_toml(recipe_settings(recipe, text, defaults=defaults))
    assert parse_recipe(shown) == recipe


@settings(max_examples=10)
@given(
    median=st.floats(1e-9, 1e9),
    factor=st.floats(1.001, 1e6),
    mean=st.floats(-1e9, 1e9),
    share=st.floats(0.001, 0.999),
    words=st.text(st.characters(codec="utf-8", exclude_categories=["Cs"]), max_size=30),
)
def test_any_numbers_and_words_come_back(median, factor, mean, share, words):
    rows = f"""
        description = {_quoted(words)}
        [fit.friction.priors.rotary]
        coulomb_Nm = {{ median = {median!r}, factor_90 = {factor!r} }}
        offset_Nm = {{ mean = {mean!r}, sd = {median!r} }}
        presliding_share = {{ median = {share!r}, odds_factor_90 = {factor!r} }}
    """.splitlines()
    head = TEXT.replace(
        'description = "Office paper, 80 g/m^2, cut with office scissors."', rows[1]
    )
    text = head + "\n".join(rows[2:])
    recipe = parse_recipe(text)
    assert recipe.description == words
    shown = as_toml(recipe_settings(recipe, text))
    assert parse_recipe(shown) == recipe


def _quoted(words: str) -> str:
    return '"' + "".join(f"\\U{ord(one):08x}" for one in words) + '"'


def test_each_setting_says_where_it_is_from():
    recipe = parse_recipe(TEXT)
    shown = {one.key: one for one in recipe_settings(recipe, TEXT)}
    given_one = shown["fit.cut.toughness_J_per_m2"]
    assert given_one.value == {"median": 5000.0, "factor_90": 10.0}
    assert "toughness" in TEXT.splitlines()[given_one.line - 1]
    default = shown["fit.friction.priors.rotary.coulomb_Nm"]
    assert default.line is None
    assert default.origin.startswith("default: Coulomb friction: scissors that stay open")
    assert shown["material.thickness_sd_mm"].value is None
    assert {one.key for one in recipe_settings(recipe, TEXT, defaults=False)} == {
        key for key, one in shown.items() if one.line is not None
    }


def test_every_default_of_a_prior_gives_its_reason():
    priors = [one for one in recipe_settings(parse_recipe(TEXT), TEXT) if "priors" in one.table]
    assert {one.table[1] for one in priors} == {"camera", "blade", "plate", "friction", "cut"}
    assert all(one.origin.startswith("default: ") for one in priors)


def test_every_prior_has_a_default_that_is_proper():
    for kind in ("rotary", "linear"):
        priors = JointPriors().of(kind)
        for name in type(priors).model_fields:
            mean, sd = getattr(priors, name).normal()
            assert sd > 0.0, name
            assert abs(mean) < 100.0, name


@pytest.mark.parametrize(
    ("row", "says"),
    [
        ("colomb_Nm = { median = 1.0, factor_90 = 2.0 }", "Did you mean coulomb_Nm?"),
        ("coulomb_N = { median = 1.0, factor_90 = 2.0 }", "unknown key"),
        ("coulomb_Nm = { median = 1.0 }", r"coulomb_Nm\.factor_90 is missing"),
        ("coulomb_Nm = { median = -1.0, factor_90 = 2.0 }", "must be at least 1e-09"),
        ("coulomb_Nm = { median = 1.0, factor_90 = 1.0 }", "must be greater than 1"),
        ("coulomb_Nm = 0.01", "must be a table with the keys median, factor_90"),
        ("presliding_share = { median = 1.0, odds_factor_90 = 2.0 }", "must be less than 1"),
    ],
)
def test_a_wrong_prior_is_named_with_its_line(row, says):
    with pytest.raises(InputError, match=says) as refused:
        parse_recipe(f"{TEXT}\n[fit.friction.priors.rotary]\n{row}\n")
    assert f"line {len(TEXT.splitlines()) + 3}" in str(refused.value)
