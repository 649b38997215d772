"""Old words of options and recipes are read for one version, with a note of the new ones."""

from pathlib import Path

import pytest

from scissorcal.errors import OLD_WORDS_UNTIL, OldWordWarning
from scissorcal.identity import VERSION, digest
from scissorcal.package.manifest import FitRecord
from scissorcal.recipe.friction import as_first_named
from scissorcal.recipe.load import parse_recipe
from scissorcal.workday.engine import Engine
from scissorcal.workday.steps import BY_NAME
from scissorcal.workday.workspace import Workspace
from tests.cli.conftest import Cli

OLD = '\n[fit.friction]\nrung = "stribeck"\n\n[fit.friction_advance]\nrung = "coulomb"\n'


def test_old_words_are_read_in_this_version_only() -> None:
    assert VERSION.split(".")[:2] < OLD_WORDS_UNTIL.split("."), "take the old words away"


def test_the_old_key_of_a_recipe_is_read_with_a_note(cli: Cli, workspace: Path) -> None:
    recipe = workspace / "recipe.toml"
    text = recipe.read_text(encoding="utf-8")
    recipe.write_text(text + OLD, encoding="utf-8")
    said = cli("recipe", "show", "--json")
    assert said.code == 0
    assert said.envelope["ok"]  # stdout has the object alone
    note = "fit.friction.rung is now called fit.friction.law. Version 0.2 reads fit.friction.law"
    assert said.err.count(note) == 1
    assert "fit.friction_advance.rung is now called fit.friction_advance.law" in said.err
    recipe.write_text(text + OLD.replace("rung", "law"), encoding="utf-8")
    assert "is now called" not in cli("recipe", "show").err


def test_an_old_key_means_what_the_new_one_does(workspace: Path) -> None:
    text = (workspace / "recipe.toml").read_text(encoding="utf-8")
    with pytest.warns(OldWordWarning, match="Version 0.2"):
        old = parse_recipe(text + OLD)
    assert old == parse_recipe(text + OLD.replace("rung", "law"))
    assert (old.fit.friction.law, old.fit.friction_advance.law) == ("stribeck", "coulomb")
    assert parse_recipe(text + OLD, judged=False) == old  # that of a recording: no note


def test_stored_fits_stay_current(workspace: Path) -> None:
    """The identity of settings is that of the version that called the key ``rung``."""
    made = Engine.of(Workspace(workspace))
    settings = BY_NAME["fit friction"].settings(made.recipe)
    assert "rung" in as_first_named(settings)
    assert digest(as_first_named(settings)) == (
        "434e6cdb2461d0db3e90fa43482ef7afc4a1fe39e11d832c3f11b203e87681a1"
    )


def test_a_package_with_the_old_name_of_a_fits_candidate_is_read() -> None:
    parameter = {"name": "coulomb", "unit": "N m", "value": 0.005, "mean": 0.005, "sd": 1e-4}
    facts = {
        "rung": "coulomb, symmetric",
        "effort": "draft",
        "inputs_hash": "",
        "sources": (),
        "parameters": ({**parameter, "q05": 0.0048, "q50": 0.005, "q95": 0.0052},),
        "warnings": (),
    }
    assert FitRecord.model_validate(facts).candidate == "coulomb, symmetric"
    assert "rung" not in FitRecord.model_validate(facts).model_dump()


def test_stances_are_positions(cli: Cli, workspace: Path, tmp_path: Path) -> None:
    said = cli("capture", "plate", "-i", tmp_path / "a.jpg", "--stances", tmp_path / "none.csv")
    assert said.code == 2
    assert "none.csv does not exist" in said.err
    assert "--stances is now called --positions. Version 0.2 reads --positions only." in said.err
    assert "--stances" not in cli("capture", "plate", "--help").out
