"""A fit that its workspace cannot take is kept elsewhere, and put in place later."""

import errno
import os
import shutil
import tempfile
from pathlib import Path

import pytest

from scissorcal.errors import InputError
from scissorcal.workday import history
from scissorcal.workday.engine import Engine
from scissorcal.workday.history import put_in_place, refuse_unwritable, restore, versions
from scissorcal.workday.options import FitOptions
from scissorcal.workday.runs.fit import fit_step, fit_workspace
from scissorcal.workday.steps import BY_NAME
from scissorcal.workday.workspace import Workspace
from tests.workday.made import fitted_copy


@pytest.fixture(scope="module")
def fitted(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return fitted_copy(
        tmp_path_factory, tmp_path_factory.mktemp("elsewhere") / "paper", "friction"
    ).root


@pytest.fixture
def workspace(fitted: Path, tmp_path: Path) -> Workspace:
    return Workspace(Path(shutil.copytree(fitted, tmp_path / "paper")))


def refused(workspace: Workspace, folder: Path | None, patch: pytest.MonkeyPatch) -> InputError:
    """Fit again where the workspace's folder of fits takes nothing."""
    save = history.save

    def full(result: object, path: Path) -> None:
        if path.is_relative_to(workspace.root):
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        save(result, path)  # type: ignore[arg-type]

    patch.setattr(history, "save", full)
    step = BY_NAME["fit friction"]
    with pytest.raises(InputError) as found:
        fit_step(Engine.of(workspace), step, FitOptions(seed=5, force=True, save_to=folder))
    patch.undo()
    return found.value


def test_it_is_kept_named_and_put_in_place(
    workspace: Workspace, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    before = workspace.fit_path("friction").read_bytes()
    told = refused(workspace, tmp_path / "spare", monkeypatch)
    (kept,) = told.kept
    assert kept.parent == tmp_path / "spare"
    assert "The disk is full" in str(told)
    assert f"'scissorcal fit restore {kept}'" in str(told)
    assert workspace.fit_path("friction").read_bytes() == before
    step, earlier = put_in_place(Engine.of(workspace), kept)
    assert step.name == "fit friction"
    assert workspace.fit_path("friction").read_bytes() == kept.read_bytes() != before
    assert earlier is not None
    assert (earlier / "friction.nc").read_bytes() == before


def test_a_file_of_another_kind_is_refused(workspace: Workspace, tmp_path: Path) -> None:
    engine = Engine.of(workspace)
    shutil.copyfile(workspace.fit_path("friction"), tmp_path / "other.nc")
    with pytest.raises(InputError, match="does not tell by its name"):
        put_in_place(engine, tmp_path / "other.nc")
    shutil.copyfile(workspace.fit_path("friction"), tmp_path / "camera-1.nc")
    with pytest.raises(InputError, match=r"camera-1\.nc"):
        put_in_place(engine, tmp_path / "camera-1.nc")


def test_a_fit_under_the_name_of_another_is_refused(workspace: Workspace, tmp_path: Path) -> None:
    shutil.copyfile(workspace.fit_path("friction"), tmp_path / "cut-1.nc")
    with pytest.raises(InputError, match="holds a fit of friction"):
        put_in_place(Engine.of(workspace), tmp_path / "cut-1.nc")
    assert not workspace.fit_path("cut").exists()


def test_a_symbolic_link_is_put_in_place_as_its_file(workspace: Workspace, tmp_path: Path) -> None:
    fit = workspace.fit_path("friction")
    shutil.move(fit, tmp_path / "store.nc")
    (tmp_path / "friction-1.nc").symlink_to("store.nc")
    put_in_place(Engine.of(workspace), tmp_path / "friction-1.nc")
    assert fit.is_file()
    assert not fit.is_symlink()


def test_without_any_folder_for_temporary_files_it_is_kept_in_the_home_folder(
    workspace: Workspace, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def none() -> str:
        raise FileNotFoundError(errno.ENOENT, "No usable temporary directory found")

    monkeypatch.setenv("HOME", str(tmp_path))
    monkeypatch.setattr(tempfile, "gettempdir", none)
    (kept,) = refused(workspace, None, monkeypatch).kept
    assert kept.parent == tmp_path


def test_folders_of_other_programs_beside_a_fit_are_left_out(workspace: Workspace) -> None:
    pictures = workspace.fit_path("friction").with_suffix("")
    (pictures / "@eaDir").mkdir(parents=True)
    (pictures / "own.png").write_bytes(b"picture")
    fit_workspace(workspace, ("friction",), FitOptions(seed=3, force=True))
    (earlier,) = [one for one in versions(Engine.of(workspace), "friction") if not one.current]
    kept = earlier.path.with_suffix("")
    assert [path.name for path in kept.iterdir()] == ["own.png"]


def test_a_workspace_that_may_only_be_read_is_refused_before_the_fit(
    workspace: Workspace, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr(os, "access", lambda *_: False)
    with pytest.raises(InputError, match="--save-to FOLDER"):
        refuse_unwritable(Engine.of(workspace), None)
    refuse_unwritable(Engine.of(workspace), tmp_path)


def test_a_restore_that_was_killed_half_way_can_be_done_again(workspace: Workspace) -> None:
    fit_workspace(workspace, ("friction",), FitOptions(seed=9, force=True))
    engine = Engine.of(workspace)
    (earlier,) = [one for one in versions(engine, "friction") if not one.current]
    shutil.copytree(earlier.path.parent, workspace.root / "aside")
    restore(engine, earlier.name)
    # The kill: the restored version still stands in the history, too, and what stood beside it.
    shutil.copytree(workspace.root / "aside", earlier.path.parent)
    records = "friction.verify.partial.jsonl"
    (earlier.path.parent / records).write_text("records", encoding="utf-8")
    names = [one.name for one in versions(Engine.of(workspace), "friction")]
    assert len(names) == len(set(names)) == 2
    restore(Engine.of(workspace), earlier.name)
    assert (workspace.root / "fits" / records).read_text() == "records"
    assert not earlier.path.parent.exists()
