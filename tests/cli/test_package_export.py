"""``scissorcal package export`` of C, header and FMU: answers, files, refusals."""

import shutil
import zipfile
from pathlib import Path

import pytest

from scissorcal.package import open_package
from scissorcal.workday import Workspace

from .conftest import Cli


def test_a_workspaces_package_is_exported_in_each_form(
    packed: Workspace, cli: Cli, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("scissorcal.package.export.fmu.find_spec", lambda name: None)
    folder, header, unit = tmp_path / "c", tmp_path / "paper.h", tmp_path / "paper.fmu"
    words = ("package", "export", "--c", folder, "--header", header, "--fmu", unit)
    said = cli(*words, "--json")
    assert said.code == 0, said.err
    result = said.envelope["result"]
    manifest = open_package(packed.package_path(packed.recipe()), warn=False).manifest
    assert result["package"]["content_hash"] == manifest.content_hash
    assert result["package"]["signature"] == "not signed"
    assert result["package"]["bound"]["stated_Nm"] == manifest.bound.stated_Nm
    assert result["c"]["files"] == sum(path.is_file() for path in folder.rglob("*"))
    assert result["header"]["bytes"] == header.stat().st_size
    assert (folder / "scissorcal_package.h").read_bytes() == header.read_bytes()
    assert result["fmu"]["draws"] == 200
    assert zipfile.is_zipfile(unit)
    assert bool(result["fmu"]["platforms"]) == (shutil.which("cc") is not None)
    assert "not signed: its report has not been reviewed" in said.err

    again = cli(*words)
    assert again.code == 2
    assert "already exists" in again.err
    assert cli(*words, "--overwrite").code == 0


def test_a_package_elsewhere_needs_no_workspace(
    packed: Workspace, cli: Cli, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = packed.package_path(packed.recipe()).resolve()
    elsewhere = tmp_path / "elsewhere"
    elsewhere.mkdir()
    monkeypatch.chdir(elsewhere)
    assert cli("package", "export", "--header", "p.h", "--package", path).code == 0
    assert cli("package", "export", "--header", "p.h").code != 0


def test_an_export_asks_what_to_write_and_for_a_package(cli: Cli, workspace: Path) -> None:
    said = cli("package", "export")
    assert said.code == 2
    assert "give --html FILE, --c DIR, --header FILE or --fmu FILE" in said.err
    said = cli("package", "export", "--c", "c")
    assert said.code == 5
    assert "no package to export yet: run 'scissorcal capture friction" in said.err
    assert not Path("c").exists()


def test_an_edited_package_is_refused(packed: Workspace, cli: Cli, tmp_path: Path) -> None:
    path = packed.package_path(packed.recipe())
    data = bytearray(path.read_bytes())
    place = data.index(b"torque_Nm") + 20
    data[place] = ord("7") if data[place] != ord("7") else ord("8")
    path.write_bytes(data)
    assert cli("package", "export", "--c", tmp_path / "c").code == 2
    assert not (tmp_path / "c").exists()
