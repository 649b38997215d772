"""scissorcal init"""

from pathlib import Path

import pytest

from scissorcal.recipe import recipe_names, recipe_path

from .conftest import Cli


@pytest.mark.parametrize("name", recipe_names())
def test_a_workspace_holds_a_copy_of_the_recipe(name: str, cli: Cli, tmp_path: Path) -> None:
    folder = tmp_path / "deep" / "work"
    said = cli("init", folder, "--recipe", name, "--json")
    assert said.code == 0
    assert said.envelope["result"]["recipe"] == name
    drawn = ["paper-with-hole.svg"] if name == "paper-with-hole" else []
    assert said.envelope["files"] == [str(folder / one) for one in ("recipe.toml", *drawn)]
    for one in drawn:
        assert (folder / one).read_bytes() == recipe_path(name).with_name(one).read_bytes()
    assert [path.name for path in folder.glob("*.svg")] == drawn
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
    assert "cotton-cloth, paper-80gsm, paper-photographed, paper-with-hole, press-only" in said.err


def test_a_folder_that_cannot_be_made_is_named(cli: Cli, tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    said = cli("init", tmp_path / "file" / "work")
    assert said.code == 2
    assert str(tmp_path / "file" / "work") in said.err


def own_drawn(folder: Path) -> Path:
    """A recipe of somebody's own, with its drawing."""
    folder.mkdir()
    for suffix in (".toml", ".svg"):
        source = recipe_path("paper-with-hole").with_suffix(suffix)
        (folder / source.name).write_bytes(source.read_bytes())
    return folder / "paper-with-hole.toml"


def test_a_drawing_comes_with_the_recipe_file_that_names_it(cli: Cli, tmp_path: Path) -> None:
    said = cli("init", tmp_path / "work", "--recipe", own_drawn(tmp_path / "mine"))
    assert said.code == 0
    assert "Its plate is drawn in paper-with-hole.svg." in said.out
    planned = cli("plan", "--workspace", tmp_path / "work")
    assert planned.code == 0, planned.err
    said_of_plate = " ".join(planned.out.split())
    assert "1 layer and, on the line of the cut, 2 pieces with 1 gap within layers" in said_of_plate
    assert "Toughness ratios of 1, 3 are declared in the recipe, not measured." in said_of_plate


def test_a_drawing_is_checked_before_anything_is_copied(cli: Cli, tmp_path: Path) -> None:
    recipe = own_drawn(tmp_path / "mine")
    drawing = recipe.with_suffix(".svg")
    text = drawing.read_text()
    for wrong, why in ((text.replace('"hole"', '"slot"'), "no shapes with id"), ("", "is empty")):
        drawing.write_text(wrong)
        said = cli("init", tmp_path / "work", "--recipe", recipe)
        assert said.code == 2
        assert why in " ".join(said.err.split())
        assert not (tmp_path / "work").exists()
    drawing.unlink()
    said = cli("init", tmp_path / "work", "--recipe", recipe)
    assert "does not exist" in " ".join(said.err.split())
    assert not (tmp_path / "work").exists()


def test_another_drawing_of_the_name_is_left_as_it_is(cli: Cli, tmp_path: Path) -> None:
    folder = tmp_path / "work"
    folder.mkdir()
    (folder / "paper-with-hole.svg").write_text("mine")
    said = cli("init", folder, "--recipe", "paper-with-hole")
    assert said.code == 2
    assert "is not the drawing of this recipe" in " ".join(said.err.split())
    assert [path.name for path in folder.iterdir()] == ["paper-with-hole.svg"]
    assert (folder / "paper-with-hole.svg").read_text() == "mine"


def test_a_recipe_may_lie_in_its_workspace_already(cli: Cli, tmp_path: Path) -> None:
    recipe = own_drawn(tmp_path / "mine")
    before = recipe.with_suffix(".svg").stat().st_mtime_ns
    assert cli("init", tmp_path / "mine", "--recipe", recipe).code == 0
    assert recipe.with_suffix(".svg").stat().st_mtime_ns == before
