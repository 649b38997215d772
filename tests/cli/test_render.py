"""What 'render' refuses by name, what it fails for, and what a person may accept."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from scissorcal.package import PackageOptions, RigRecord, build_package
from scissorcal.recording import read_recording
from scissorcal.workday import Workspace, recorded_rig
from tests.cli.conftest import Cli
from tests.package.fits import cut_fit, friction_fit, recipe

BRIEF = ("render", "--device", "sim", "--yes", "--strokes", "1", "--seconds", "0.3")
SIM = RigRecord(
    name="scissorcal-sim", serial="office-paper", torque_limit_Nm=2.0, force_limit_N=40.0
)


def package(folder: Path, *, tolerance: float = 7.0, rig: RigRecord | None = None) -> Path:
    """A package of made-up fits, of a rig."""
    chosen = recipe(tolerance_percent=tolerance)
    friction = friction_fit(coulomb=0.014, stribeck=0.004, viscous=0.002)
    cut = cut_fit(chosen, kappa=0.75, energy=0.52)
    path = folder / "package.zip"
    build_package(
        chosen, friction, cut, path, np.random.default_rng(1), options=PackageOptions(rig=rig)
    )
    return path


def test_a_package_states_the_rig_of_its_recordings(
    workspace: Path, tmp_path: Path, cli: Cli
) -> None:
    """And is rendered on that rig without a word about another one."""
    text = (workspace / "recipe.toml").read_text(encoding="utf-8")
    for old, new in (("[0.05, 0.12, 0.3, 0.7, 1.5]", "[1.0]"), ("_s = 10.0", "_s = 1.0")):
        assert old in text
        text = text.replace(old, new)
    (workspace / "recipe.toml").write_text(text, encoding="utf-8")
    assert cli("capture", "friction", "--device", "sim").code == 0
    (recording,) = Workspace(workspace).recordings("friction")
    stated = read_recording(recording).device
    friction = replace(friction_fit(), sources=(f"captures/{recording.name} sha256:{64 * '0'}",))
    rig = recorded_rig(recording.parent, {"friction": friction, "cut": None, "plate": None})
    assert rig is not None
    assert (rig.name, rig.serial) == (stated["name"], stated["serial"])
    assert (rig.torque_limit_Nm, rig.force_limit_N) == (
        stated["torque_limit"],
        stated["force_limit"],
    )
    gone = replace(friction, sources=("gone.mcap sha256:00",))
    assert recorded_rig(recording.parent, {"friction": None, "cut": gone}) is None
    said = cli(*BRIEF, "--package", package(tmp_path, rig=rig), "--no-record")
    assert said.code == 0, said.err
    assert "another rig" not in said.err + said.out


def test_a_stale_package_is_refused_until_it_is_asked_for(packed: Workspace, cli: Cli) -> None:
    text = packed.recipe_path.read_text(encoding="utf-8")
    packed.recipe_path.write_text(
        text.replace("contact_mm = [15.0, 60.0]", "contact_mm = [15.0, 55.0]"), encoding="utf-8"
    )
    said = cli(*BRIEF, "--no-record")
    assert said.code == 5
    assert "The package is stale" in said.err
    assert "--allow-mismatch" in said.err
    assert not packed.probe_path.exists(), "nothing moves"
    said = cli(*BRIEF, "--allow-mismatch")
    assert said.code in (0, 3)
    assert "The package is stale" in said.err
    (recording,) = packed.recordings("render")
    assert any("The package is stale" in note for note in read_recording(recording).notes)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"serial": "other-serial"}, "of the rig scissorcal-sim other-serial, and this is"),
        ({"torque_limit_Nm": 20.0}, "That rig's torque limit was 20 N m, this one's is"),
        ({"force_limit_N": 5.0}, "That rig's force limit was 5 N, this one's is"),
    ],
)
def test_a_package_of_another_rig_is_refused_by_name(
    workspace: Path, tmp_path: Path, cli: Cli, changes: dict[str, object], words: str
) -> None:
    path = package(tmp_path, rig=SIM.model_copy(update=changes))
    said = cli(*BRIEF, "--package", path, "--no-record")
    assert said.code == 2
    assert "is of another rig" in said.err
    assert words in said.err
    assert not Workspace(workspace).probe_path.exists(), "nothing moves"
    said = cli(*BRIEF, "--package", path, "--no-record", "--allow-mismatch", "--json")
    assert said.code in (0, 3)
    assert any(words in sentence for sentence in said.envelope["result"]["warnings"])


def test_a_package_of_other_blades_is_refused_by_name(
    workspace: Path, tmp_path: Path, cli: Cli
) -> None:
    path = package(tmp_path)
    text = (workspace / "recipe.toml").read_text(encoding="utf-8")
    (workspace / "recipe.toml").write_text(
        text.replace('moving = "both"', 'moving = "upper"'), encoding="utf-8"
    )
    said = cli(*BRIEF, "--package", path, "--no-record")
    assert said.code == 2
    assert 'its recipe has rig.moving = "both", and this workspace\'s has "upper"' in said.err


def test_what_is_felt_beyond_the_tolerance_fails_unless_a_person_accepts_it(
    workspace: Path, tmp_path: Path, cli: Cli
) -> None:
    path = package(tmp_path, tolerance=1.0)
    words = (*BRIEF, "--package", path, "--json")
    found = {}
    for accepted in (False, True):
        said = cli(*words, *(["--accept-derated"] if accepted else []))
        assert said.code == (0 if accepted else 3), said.err
        (verdict,) = (v for v in said.envelope["verdicts"] if v["check"] == "felt torque")
        result = said.envelope["result"]
        assert result["accepted_derated"] is accepted
        assert verdict["value"] == result["admission"]["felt_share"] > verdict["threshold"] == 0.01
        recording = read_recording(next(Path(f) for f in said.envelope["files"]))
        assert verdict["why"] in recording.notes
        found[accepted] = verdict
    assert found[False]["status"] == "fail"
    assert "What would cure it, each by itself:" in found[False]["why"]
    assert found[True]["status"] == "not_evaluated"
    assert "Accepted by a person" in found[True]["why"]
    within = package(tmp_path, tolerance=7.0)
    said = cli(*BRIEF, "--package", within, "--json", "--no-record", "--accept-derated")
    assert said.code == 0
    assert said.envelope["result"]["accepted_derated"] is False


def test_the_file_beside_the_package_states_that_a_person_accepted(
    packed: Workspace, cli: Cli, monkeypatch: pytest.MonkeyPatch
) -> None:
    from scissorcal.render import admission

    strict = admission._asked
    monkeypatch.setattr(admission, "_asked", lambda *given: replace(strict(*given), tolerance=1e-4))
    assert cli(*BRIEF, "--no-record").code == 3
    beside = packed.package_path(packed.recipe()).with_suffix(".admission.json")
    assert json.loads(beside.read_text())["accepted_derated"] is False
    assert cli(*BRIEF, "--no-record", "--accept-derated").code == 0
    stated = json.loads(beside.read_text())
    assert stated["accepted_derated"] is True
    assert stated["felt_share"] > stated["tolerance"] == 1e-4


def test_a_rig_that_does_not_render_by_itself_is_refused_before_it_is_probed(
    workspace: Path, tmp_path: Path, cli: Cli
) -> None:
    path = package(tmp_path, rig=SIM)
    ran = cli(*BRIEF, "--package", path, "--on-device")
    assert ran.code == 4
    assert "does not render by itself" in ran.err
    assert "leave --on-device out" in ran.err
    assert not Workspace(workspace).probe_path.exists()
