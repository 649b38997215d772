"""Run the command line in this process and keep what it said."""

import json
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import cv2
import jsonschema
import numpy as np
import pytest
import typer

from scissorcal.cli.lazy import LazyGroup
from scissorcal.cli.output import Answer, command
from scissorcal.cli.root import run
from scissorcal.recipe import Recipe, builtin_recipe, schemas_dir
from scissorcal.vision import SIM_LENS, render_card_photographs, render_plate_photographs
from scissorcal.workday import Workspace
from scissorcal.workday.tracking import sim_world
from tests.made_once import copied
from tests.probed_once import probed_once as probed_once
from tests.workday.made import fitted_copy


@dataclass(frozen=True)
class Said:
    """Exit code and words of one run of the command line."""

    code: int
    out: str
    err: str

    @property
    def envelope(self) -> dict[str, Any]:
        """The one object on stdout, checked against its schema."""
        (line,) = self.out.splitlines()
        found: dict[str, Any] = json.loads(line)
        schema = json.loads((schemas_dir() / "command.schema.json").read_text(encoding="utf-8"))
        jsonschema.validate(found, schema)
        assert found["ok"] == (self.code == 0)
        return found


Cli = Callable[..., Said]


@pytest.fixture
def cli(capsys: pytest.CaptureFixture[str]) -> Cli:
    """Give a function that runs ``scissorcal`` with the given words."""

    def call(*words: str | Path) -> Said:
        capsys.readouterr()
        with pytest.raises(SystemExit) as ended:
            run([str(word) for word in words])
        captured = capsys.readouterr()
        assert isinstance(ended.value.code, int)
        return Said(ended.value.code, captured.out, captured.err)

    return call


@pytest.fixture
def workspace(cli: Cli, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Make a workspace for paper and stand in it."""
    folder = tmp_path / "paper"
    assert cli("init", folder, "--recipe", "paper-80gsm").code == 0
    monkeypatch.chdir(folder)
    return folder


@pytest.fixture(scope="session")
def packed_once(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A workspace with fits and their package."""
    folder = tmp_path_factory.mktemp("packed") / "paper"
    workspace = fitted_copy(tmp_path_factory, folder, "friction", "cut")
    with pytest.raises(SystemExit) as ended:
        run(["package", "build", "--workspace", str(workspace.root)])
    assert ended.value.code == 0
    return workspace.root


@pytest.fixture
def packed(packed_once: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Workspace:
    """A copy of it; stand in it."""
    folder = copied(packed_once, tmp_path / "paper")
    monkeypatch.chdir(folder)
    return Workspace(folder)


@pytest.fixture(scope="session")
def calibrated_once(album: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A workspace for paper with a camera, which has no covariance, and the rig's frame."""
    folder = tmp_path_factory.mktemp("calibrated") / "paper"
    cards = sorted(album.glob("rig-*.jpg"))
    with pytest.MonkeyPatch.context() as patch:
        for words in (
            ("init", folder, "--recipe", "paper-80gsm"),
            ("import", album / "camera.yml"),
            ("capture", "plate", "-i", *cards, "--positions", album / "positions.csv"),
        ):
            with pytest.raises(SystemExit) as ended:
                run([str(word) for word in words])
            assert ended.value.code == 0
            patch.chdir(folder)
    return folder


@pytest.fixture
def calibrated(calibrated_once: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A copy of the calibrated workspace; stand in it."""
    folder = copied(calibrated_once, tmp_path / "paper")
    monkeypatch.chdir(folder)
    return folder


@pytest.fixture
def few_pictures(monkeypatch: pytest.MonkeyPatch) -> None:
    """The virtual camera takes 4 pictures a second in place of 10, each of which is rendered."""
    monkeypatch.setattr(sim_world, "SimCamera", partial(sim_world.SimCamera, frames_Hz=4.0))


def run_instead(function: Callable[[], Answer], patch: pytest.MonkeyPatch) -> None:
    """Make every command of the group ``scissorcal`` be ``function``."""
    app = typer.Typer(rich_markup_mode=None)
    app.command("plan")(command(function))
    patch.setattr(LazyGroup, "load", lambda *_: typer.main.get_command(app))


@pytest.fixture(scope="session")
def recipe() -> Recipe:
    return builtin_recipe("paper-80gsm")


@pytest.fixture(scope="session")
def album(recipe: Recipe, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Three photographs of a plate, nine of the card with positions.csv, and camera.yml."""
    folder = tmp_path_factory.mktemp("plates")
    render_plate_photographs(recipe, folder, 0, count=3)
    positions = render_card_photographs(recipe, folder, 0)
    rows = [
        f"{path.name},{advance:g},{opening:g}" for path, (advance, opening) in positions.items()
    ]
    (folder / "positions.csv").write_text("\n".join(["file,advance_mm,opening_deg", *rows]) + "\n")
    lens = SIM_LENS
    store = cv2.FileStorage(str(folder / "camera.yml"), cv2.FILE_STORAGE_WRITE)
    store.write("image_width", lens.width)
    store.write("image_height", lens.height)
    (u, v), f = lens.centre_px, lens.focal_px
    store.write("camera_matrix", np.array([[f, 0.0, u], [0.0, f, v], [0.0, 0.0, 1.0]]))
    store.write("distortion_coefficients", np.array([lens.distortion]))
    store.release()
    return folder
