"""A demo replaces an earlier demo's folder, and nothing else."""

from pathlib import Path

import pytest

from scissorcal.errors import InputError
from scissorcal.workday.workspace import create_workspace, demo_folder


def test_an_earlier_demo_is_replaced(tmp_path: Path) -> None:
    folder = demo_folder(tmp_path / "demo")
    create_workspace(folder, "paper-80gsm")
    assert demo_folder(folder) == folder
    assert not (folder / "recipe.toml").exists()
    create_workspace(folder, "paper-80gsm")


def test_what_no_demo_made_is_left_alone(tmp_path: Path) -> None:
    workspace = create_workspace(tmp_path / "mine", "paper-80gsm")
    with pytest.raises(InputError, match="no demo made it"):
        demo_folder(workspace.root)
    assert workspace.recipe_path.is_file()
    (tmp_path / "file").write_text("mine")
    with pytest.raises(InputError, match="no demo made it"):
        demo_folder(tmp_path / "file")
    with pytest.raises(InputError, match="is a file and not a folder"):
        demo_folder(tmp_path / "file" / "below")
