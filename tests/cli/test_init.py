"""scissorcal init"""

from pathlib import Path

import pytest

from scissorcal.recipe.library import recipe_names, recipe_path

from .conftest import Cli


@pytest.mark.parametrize("name", recipe_names())
def test_a_workspace_holds_a_copy_of_the_recipe(name: str, cli: Cli, tmp_path: Path) -> None:
    folder = tmp_path / "deep" / "work"
    said = cli("init", folder, "--recipe", name, "--json")
    assert said.code == 0
    assert said.envelope["result"]["recipe"] == name
    assert said.envelope["files"] == [str(folder / "recipe.toml")]
    assert (folder / "recipe.toml").read_text() == recipe_path(name).read_text()


def test_a_workspace_is_never_overwritten(cli: Cli, workspace: Path) -> None:
    recipe = workspace / "recipe.toml"
    recipe.write_text("mine")
    said = cli("init", workspace)
    assert said.code == 2
    assert "is there already" in said.err
    assert recipe.read_text() == "mine"


def test_a_recipe_file_is_checked_before_it_is_copied(cli: Cli, tmp_path: Path) -> None:
    file = tmp_path / "mine.toml"
    file.write_text(recipe_path("paper-80gsm").read_text().replace("moving", "movin"))
    said = cli("init", tmp_path / "work", "--recipe", file)
    assert said.code == 2
    assert "rig.movin: unknown key. Did you mean moving?" in said.err
    assert not (tmp_path / "work").exists()


def test_an_unknown_recipe_is_met_with_those_there_are(cli: Cli, tmp_path: Path) -> None:
    said = cli("init", tmp_path / "work", "--recipe", "paper-80")
    assert said.code == 2
    assert "cotton-cloth, paper-80gsm, paper-photographed, press-only" in said.err


def test_a_folder_that_cannot_be_made_is_named(cli: Cli, tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    said = cli("init", tmp_path / "file" / "work")
    assert said.code == 2
    assert str(tmp_path / "file" / "work") in said.err
