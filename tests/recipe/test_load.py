"""A wrong recipe is refused with file, line, key, what is allowed, and what was meant."""

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from scissorcal.errors import InputError
from scissorcal.recipe.explain import key_lines
from scissorcal.recipe.load import (
    builtin_recipe,
    load_recipe,
    parse_recipe,
    recipe_names,
    recipe_path,
)

PAPER = recipe_path("paper-80gsm").read_text(encoding="utf-8")


def line_of(text: str, start: str) -> int:
    return next(n for n, line in enumerate(text.splitlines(), 1) if line.startswith(start))


def refused(text: str) -> str:
    with pytest.raises(InputError) as caught:
        parse_recipe(text, "recipe.toml")
    assert caught.value.exit_code == 2
    return str(caught.value)


@pytest.mark.parametrize("name", recipe_names())
def test_builtin_recipes_load(name: str) -> None:
    assert builtin_recipe(name).name == name


@pytest.mark.parametrize(
    ("old", "new", "expected"),
    [
        (
            "thickness_mm = 0.10",
            "thickness_cm = 0.01",
            "material.thickness_cm: unknown key. Did you mean thickness_mm? 1 cm = 10 mm, so write "
            "thickness_mm = 0.1.",
        ),
        (
            "thickness_mm = 0.10",
            "thickness = 0.10",
            "material.thickness: unknown key. Did you mean thickness_mm? The unit stands in the "
            "name: mm.",
        ),
        (
            "thickness_mm = 0.10",
            "thicknes_mm = 0.10",
            "material.thicknes_mm: unknown key. Did you mean thickness_mm?",
        ),
        (
            "opening_deg = [12.0, 50.0]",
            "opening_rad = [0.2, 0.8]",
            "scene.opening_rad: unknown key. Did you mean opening_deg? 1 rad = 57.2958 deg, so "
            "write opening_deg = [11.4592, 45.8366].",
        ),
        (
            "toughness_J_per_m2 = { median = 5000.0, factor_90 = 10.0 }",
            "toughness_kJ_per_m2 = { median = 5.0, factor_90 = 10.0 }",
            "fit.cut.toughness_kJ_per_m2: unknown key. Did you mean toughness_J_per_m2? 1 kJ/m2 = "
            "1000 J/m2, so write toughness_J_per_m2 = { median = 5000, factor_90 = 10 }.",
        ),
        (
            "thickness_mm = 0.10",
            "thickness_mm = nan",
            "material.thickness_mm: nan is not a finite number; write the value, or leave the key "
            "out.",
        ),
        (
            "thickness_mm = 0.10",
            "thickness_mm = -inf",
            "material.thickness_mm: -inf is not a finite number; write the value, or leave the key "
            "out.",
        ),
        (
            "thickness_mm = 0.10",
            "thickness_mm = 0.0",
            "material.thickness_mm: 0.0 must be greater than 0.",
        ),
        (
            "thickness_mm = 0.10",
            "thickness_mm = 1e300",
            "material.thickness_mm: 1e+300 must be at most 100.",
        ),
        (
            "thickness_mm = 0.10",
            "thickness_mm = 0.10\nthickness_sd_mm = 0.2",
            "material.thickness_sd_mm: thickness_sd_mm = 0.2 is more than half of thickness_mm = "
            "0.1: measure the plate better, or leave thickness_sd_mm out.",
        ),
        (
            "length_mm = 75.0",
            "length_mm = 75000.0",
            "rig.edge.length_mm: 75000.0 must be at most 1000. Was it in um? 75000 um = 75 mm, so "
            "write length_mm = 75.",
        ),
        (
            "contact_mm = [15.0, 60.0]",
            "contact_mm = [15.0, 60000.0]",
            "scene.contact_mm: contact_mm must not exceed 1000: it is a place along the blades. "
            "Was it in um? 60000 um = 60 mm, so write contact_mm = [0.015, 60].",
        ),
        (
            "force_N = 30.0",
            "force_N = 1e300",
            "limits.force_N: 1e+300 must be at most 100000.",
        ),
        (
            "repeats = 2",
            "repeats = 1000000000",
            "capture.friction.repeats: 1000000000 must be at most 1000.",
        ),
        (
            "thickness_mm = 0.10",
            'thickness_mm = "0.10"',
            'material.thickness_mm: "0.10" is text, but this must be a number such as 0.1. Write '
            "0.10 without quotes.",
        ),
        (
            "thickness_mm = 0.10",
            "thickness_mm = true",
            "material.thickness_mm: true is true or false, but this must be a number such as 0.1.",
        ),
        (
            'family = "line"',
            'family = "lien"',
            'rig.edge.family: "lien" is not allowed here; allowed: "line", "arc", "points". Did '
            'you mean "line"?',
        ),
        (
            "contact_mm = [15.0, 60.0]",
            "contact_mm = [15.0, 60.0, 70.0]",
            "scene.contact_mm: [15.0, 60.0, 70.0] has 3 items, but at most 2 are allowed.",
        ),
        (
            "contact_mm = [15.0, 60.0]",
            "contact_mm = [15.0]",
            "scene.contact_mm: the list is too short; it needs 2 numbers or more.",
        ),
        (
            "contact_mm = [15.0, 60.0]",
            "contact_mm = [60.0, 15.0]",
            "scene.contact_mm: contact_mm must be [low, high] with 0 <= low < high.",
        ),
        (
            "cut = true",
            "cut = false",
            "fit.cut.toughness_J_per_m2 is set, but scene.cut = false: nothing is cut, so remove "
            "the prior or set scene.cut = true.",
        ),
        (
            "moving = ",
            "sheet_length_mm = 3.0\nmoving = ",
            "rig.sheet_length_mm: unknown key. It belongs in [material]. Allowed here: joint, "
            "moving, handle_radius_mm, opening_zero_sd_deg, hand_damping_N_s_per_m, edge, control, "
            "line, motor_sign, probe.",
        ),
    ],
)
def test_one_mistake_is_one_sentence_with_its_line(old: str, new: str, expected: str) -> None:
    assert old in PAPER
    text = PAPER.replace(old, new)
    message = refused(text)
    prefix, _, sentence = message.partition(", ")
    assert prefix == "recipe.toml"
    line, _, said = sentence.partition(", ")
    assert said == expected
    key = said.split(":", 1)[0].split(" is set")[0].split(".")[-1].split("[")[0]
    assert line == f"line {line_of(text, key)}"


def test_a_missing_key_is_asked_for_in_its_table() -> None:
    text = PAPER.replace("thickness_mm = 0.10\n", "")
    table = line_of(text, "[material]")
    assert refused(text) == (
        f"recipe.toml, line {table}, material.thickness_mm is missing: "
        "add thickness_mm in [material]."
    )


def test_all_mistakes_are_told_at_once_in_the_order_of_the_file() -> None:
    text = PAPER.replace('name = "paper-80gsm"', 'name = "a b"').replace(
        "length_mm = 75.0", "length_cm = 7.5"
    )
    message = refused(text)
    first, second = message.splitlines()[1:]
    assert message.startswith("recipe.toml has 2 mistakes:")
    assert ", name:" in first
    assert "rig.edge.length_cm" in second


def test_twenty_mistakes_are_told_and_all_are_counted() -> None:
    """In the message's size; the time is that of twenty mistakes, too."""
    many = "".join(f"unknown_{number} = 1\n" for number in range(20_000))
    for text in (many + PAPER, PAPER.replace("[material]\n", "[material]\n" + many)):
        message = refused(text)
        head, *told = message.splitlines()
        assert head == "recipe.toml has 20000 mistakes; 20 of them:"
        assert len(told) == 20
        assert len(message) < 10_000


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("a: 3", "recipe.toml, line 1, column 2: this is not valid TOML"),
        ("\nx = True", "Write true or false in lower case."),
        ("name = paper", "Text stands in quotes"),
        ("x = 0,1", "numbers have a decimal point"),
        ('a = 1\nb = """\nfoo', "in what begins on line 2"),
        ("[a]\nb = 1\nb = 2\n", "line 3"),
        ("[a]\nb = 1\nb = 2\n", "It was given before; keep one of the two."),
        ("a = " + "[" * 5000, "nested too deeply"),
    ],
)
def test_what_is_not_toml_is_shown_with_its_place(text: str, expected: str) -> None:
    assert expected in refused(text)


def test_files_that_cannot_be_read_are_named(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"nowhere\.toml does not exist"):
        load_recipe(tmp_path / "nowhere.toml")
    latin = tmp_path / "latin.toml"
    latin.write_bytes(b'name = "\xe4"')
    with pytest.raises(InputError, match="byte 8: this is not UTF-8"):
        load_recipe(latin)
    huge = tmp_path / "huge.toml"
    huge.write_bytes(b"#" * 1_000_001)
    with pytest.raises(InputError, match="has more than 1 MB, too much for a recipe"):
        load_recipe(huge)
    with pytest.raises(InputError, match="cannot be read"):
        load_recipe(tmp_path)


def test_lines_are_found_across_multi_line_values_and_dotted_keys() -> None:
    text = 'a.b = 1\n\n# note\n[c]\nd = [\n  1,\n  2,\n]\n"e f" = """\nx\n"""\n[[g]]\nh = 1\n'
    paths = [("a", "b"), ("c", "d", 1), ("c", "e f"), ("g", 0, "h"), ("nope",)]
    assert key_lines(text, paths) == [1, 5, 9, 13, None]


@given(st.text(max_size=200))
def test_no_text_is_met_with_anything_but_a_sentence(text: str) -> None:
    with pytest.raises(InputError) as caught:
        parse_recipe(text, "recipe.toml")
    assert str(caught.value).startswith("recipe.toml")


VALUES = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=5),
    lambda inner: st.lists(inner, max_size=3),
    max_leaves=4,
).filter(lambda value: value is not None)


@given(
    key=st.sampled_from(["thickness_mm = 0.10", "cut = true", "opening_deg = [12.0, 50.0]"]),
    value=VALUES,
)
def test_any_value_is_taken_or_refused_with_its_key(key: str, value: object) -> None:
    name = key.partition(" = ")[0]
    text = PAPER.replace(key, f"{name} = {toml(value)}")
    said = name
    try:
        parse_recipe(text, "recipe.toml")
    except InputError as error:
        said = str(error)
    assert name in said or "not valid TOML" in said


def toml(value: object) -> str:
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, list):
        return f"[{', '.join(toml(item) for item in value)}]"
    if isinstance(value, str):
        return f"'{value}'"
    return repr(value)


def test_a_share_is_at_most_all_of_it() -> None:
    text = PAPER + "\n[fit.blade.priors]\ngrain_percent = 120.0\n"
    assert "grain_percent" in refused(text)


@pytest.mark.parametrize(
    "text",
    [
        "a_" * 200_000 + "b = 1\n" + PAPER,
        "a_m" + "1" * 5000 + " = 1\n" + PAPER,
        ".".join(["a"] * 3000) + " = 1\n" + PAPER,
        'x = "' + "y" * 100_000 + '"\n' + PAPER,
    ],
    ids=["long key", "power of 5000 digits", "deep table", "long value"],
)
def test_long_names_give_short_messages(text: str) -> None:
    message = refused(text)
    assert "line 1, " in message
    assert "unknown key" in message
    assert len(message) < 400
