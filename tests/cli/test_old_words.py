"""Old words of options and recipes are read for one version, with a note of the new ones."""

from pathlib import Path

from scissorcal.errors import OLD_WORDS_UNTIL
from scissorcal.identity import VERSION
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
    line = (text + OLD).splitlines().index('rung = "stribeck"') + 1
    assert f'law = "stribeck"  # recipe, line {line}\n' in cli("recipe", "show").out
    recipe.write_text(text + OLD.replace("rung", "law"), encoding="utf-8")
    assert "is now called" not in cli("recipe", "show").err


def test_a_note_stands_once_where_the_next_command_is_worked_out_too(
    cli: Cli, workspace: Path
) -> None:
    with (workspace / "recipe.toml").open("a", encoding="utf-8") as recipe:
        recipe.write(OLD)
    said = cli("recording", "list")
    assert "next: scissorcal capture friction" in said.out
    assert said.err.count("fit.friction.rung is now called") == 1
    assert "OldWordWarning" not in said.err


def test_stances_are_positions(cli: Cli, workspace: Path, tmp_path: Path) -> None:
    said = cli("capture", "plate", "-i", tmp_path / "a.jpg", "--stances", tmp_path / "none.csv")
    assert said.code == 2
    assert "none.csv does not exist" in said.err
    assert "--stances is now called --positions. Version 0.2 reads --positions only." in said.err
    assert "--stances" not in cli("capture", "plate", "--help").out
