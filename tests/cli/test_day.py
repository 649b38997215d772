"""The day in a workspace by its commands: each does its part, once, and says what comes next."""

import hashlib
import json
import zipfile
from pathlib import Path

import jsonschema
import numpy as np
import pytest

from scissorcal.package import open_package
from scissorcal.recipe import schemas_dir
from scissorcal.recording import write_recording
from scissorcal.workday import Workspace
from tests.calibration.truth import Stroke, Truth, make_recording
from tests.report.pages import panel_of, read_page, values_of
from tests.workday.made import quick_workspace, record_cut, record_friction

from .conftest import Cli


@pytest.fixture(scope="module")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> Workspace:
    """A workspace with both captures, made up, and few choices for the fits."""
    workspace = quick_workspace(tmp_path_factory.mktemp("day") / "paper")
    record_friction(workspace)
    record_cut(workspace)
    return workspace


def test_the_day_from_captures_to_package(
    recorded: Workspace, cli: Cli, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(recorded.captures_dir)
    assert cli("plan", "--json").envelope["result"]["next_command"] == "scissorcal fit friction"
    assert cli("report").code == 5
    assert cli("package", "build").code == 5

    fitted = cli("fit", "--json")
    assert fitted.code == 0
    result = fitted.envelope["result"]
    names = [parameter["name"] for parameter in result["parameters"]]
    assert names[:2] == ["inertia", "offset"]
    assert names[-3:] == ["response_force", "response_exponent", "fracture_energy"]
    keys = ["name", "unit", "mean", "sd", "q05", "q50", "q95", "identifiability"]
    keys += ["next_recording_sd", "caveats"]
    assert all(list(parameter) == keys for parameter in result["parameters"])
    assert [fit["cached"] for fit in result["fits"]] == [False, False]
    assert fitted.envelope["files"] == [str(recorded.fit_path(w)) for w in ("friction", "cut")]

    again = cli("fit", "--json")
    assert [fit["cached"] for fit in again.envelope["result"]["fits"]] == [True, True]
    assert again.envelope["files"] == []
    assert again.envelope["result"]["parameters"] == result["parameters"]
    assert "nothing changed since the last fit" in cli("fit").out

    built = cli("package", "build", "--json")
    assert built.code == 0
    assert built.envelope["result"]["bound"]["stated_Nm"] > 0
    assert cli("package", "build", "--json").envelope["result"]["cached"]
    checked = cli("package", "check", "--json")
    assert checked.code == 0
    assert {v["scope"] for v in checked.envelope["verdicts"]} == {"package"}

    reported = cli("report", "--json")
    assert reported.code == 0
    assert len(reported.envelope["result"]["fits"]) == 2
    scopes = {verdict["scope"] for verdict in reported.envelope["verdicts"]}
    assert scopes == {"fit.friction", "fit.cut"}, "the report shows no package"

    plan = cli("plan", "--json").envelope["result"]
    needed = [s for s in plan["steps"] if not s["optional"]]
    waiting = [s["name"] for s in needed if s["state"] not in ("done", "unverified")]
    assert waiting == ["report sign"]
    assert plan["next_command"] == "scissorcal verify"


def test_a_signature_travels_with_the_package_and_is_void_once_the_report_changes(
    recorded: Workspace, cli: Cli, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(recorded.root)
    said = cli("report", "sign", "--name", "A. Reviewer", "--decision", "accept", "--json")
    assert said.code == 0
    signed = said.envelope["result"]
    digest = hashlib.sha256(recorded.report_json.read_bytes()).hexdigest()
    assert signed["content"]["report/report.json"] == digest
    assert set(signed["fit_hashes"]) == {"friction", "cut"}
    schema = json.loads((schemas_dir() / "signature.schema.json").read_text(encoding="utf-8"))
    jsonschema.validate(json.loads(recorded.signature_path.read_text(encoding="utf-8")), schema)

    before = open_package(recorded.package_path(recorded.recipe())).manifest
    assert before.review is None
    assert not cli("package", "build", "--json").envelope["result"]["cached"]
    after = open_package(recorded.package_path(recorded.recipe())).manifest
    assert after.review is not None
    assert after.review.name == "A. Reviewer"
    assert after.content_hash == before.content_hash
    assert cli("package", "build", "--json").envelope["result"]["cached"]
    assert cli("plan", "--json").envelope["result"]["next_command"] is None
    assert "left as they are" in cli("report").out
    assert hashlib.sha256(recorded.report_json.read_bytes()).hexdigest() == digest
    assert cli("report", "--anew", "--json").envelope["result"]["signed"] == signed
    assert hashlib.sha256(recorded.report_json.read_bytes()).hexdigest() == digest
    # Another note: two signatures of one second are otherwise the same.
    answer = ("--name", "A. Reviewer", "--decision", "accept", "--note", "read again")
    again = cli("report", "sign", *answer).out
    assert again.endswith("next: scissorcal package build\n")
    assert again.count("next:") == 1

    whole = recorded.report_json.read_text(encoding="utf-8")
    recorded.report_json.write_text(whole.replace("accepted", "x") + " ", encoding="utf-8")
    steps = {s["name"]: s for s in cli("plan", "--json").envelope["result"]["steps"]}
    assert steps["report sign"]["state"] == "stale"
    assert "report/report.json was changed since it was signed" in steps["report sign"]["found"]
    assert steps["package build"]["state"] == "stale"
    recorded.report_json.write_text(whole, encoding="utf-8")


def test_a_rejection_is_carried_and_fails_the_check(
    recorded: Workspace, cli: Cli, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(recorded.root)
    words = ("report", "sign", "--name", "B", "--decision", "reject", "--note", "it bends")
    assert cli(*words).code == 0
    steps = {s["name"]: s for s in cli("plan", "--json").envelope["result"]["steps"]}
    assert steps["report sign"]["state"] == "failed"
    assert "it bends" in steps["report sign"]["found"]
    assert cli("package", "build").code == 3
    assert "rejected by B" in cli("package", "check").out
    words = ("--device", "sim", "--strokes", "1", "--seconds", "0.3", "--no-record", "--yes")
    assert "its report was rejected by B" in cli("render", *words).err


def test_a_report_of_another_recipe_is_not_signed(
    recorded: Workspace, cli: Cli, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(recorded.root)
    text = recorded.recipe_path.read_text(encoding="utf-8")
    recorded.recipe_path.write_text(text + "\n[limits]\ntorque_Nm = 0.5\n", encoding="utf-8")
    said = cli("report", "sign", "--name", "C", "--decision", "accept")
    recorded.recipe_path.write_text(text, encoding="utf-8")
    assert said.code == 5
    assert "other fits, verifications or settings" in said.err
    assert cli("report", "sign", "--name", " ", "--decision", "accept").code == 2


def test_two_runs_stand_side_by_side_or_are_refused_for_what_differs(
    recorded: Workspace, cli: Cli, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    said = cli("report", "compare", recorded.root, recorded.report_json, "--json")
    assert said.code == 0
    told = cli("report", "compare", recorded.root, recorded.report_json).out
    assert "Verdicts: 0 of " in told
    panels = {panel["id"]: panel for panel in said.envelope["result"]["panels"]}
    assert panels["cut-parameters"]["sentence"] == (
        "No parameter has changed by more than 3 standard deviations."
    )
    for row in panels["cut-parameters"]["rows"]:
        assert [value["number"] for value in row["values"] if value["name"] == "in sd"] == [0.0]
    twin = json.loads((tmp_path / "comparison" / "comparison.json").read_text(encoding="utf-8"))
    schema = json.loads((schemas_dir() / "comparison.schema.json").read_text(encoding="utf-8"))
    jsonschema.Draft202012Validator(schema).validate(twin)
    torque = values_of(panel_of(twin, "torque"))
    assert torque["largest difference"]["B − A"]["number"] == pytest.approx(0, abs=1e-9)
    assert read_page(tmp_path / "comparison" / "comparison.html").unbalanced == []

    facts = json.loads(recorded.report_json.read_text(encoding="utf-8"))
    facts["material"], facts["scene"]["moving"] = "tin", "upper"
    other = tmp_path / "other.json"
    other.write_text(json.dumps(facts), encoding="utf-8")
    said = cli("report", "compare", recorded.report_json, other)
    assert said.code == 2
    assert "the material differs (paper against tin)" in said.err
    assert "which blades move differs (both against upper)" in said.err
    assert (
        cli("report", "compare", recorded.fit_path("cut"), recorded.fit_path("friction")).code == 2
    )
    assert cli("report", "compare", tmp_path / "nothing", other).code == 5
    assert cli("report", "compare", tmp_path, other).code == 5
    assert cli("report", "compare", recorded.recipe_path, other).code == 2
    assert cli("report", "--json", "compare", other, other).code == 2


def test_a_package_whose_bytes_were_changed_is_refused(
    recorded: Workspace, cli: Cli, tmp_path: Path
) -> None:
    source = recorded.package_path(recorded.recipe())
    assert source.is_file()
    data = bytearray(source.read_bytes())
    with zipfile.ZipFile(source) as archive:
        member = archive.infolist()[-1]
    data[member.header_offset + 30 + len(member.filename) + member.compress_size // 2] ^= 1
    changed = tmp_path / "changed.zip"
    changed.write_bytes(data)
    said = cli("package", "check", changed)
    assert said.code == 2
    assert "changed.zip" in said.err
    assert "scissorcal package build" in said.err
    assert cli("package", "check", tmp_path / "nowhere.zip").code == 5


def test_a_recipe_with_a_typo_stops_every_command(cli: Cli, workspace: Path) -> None:
    recipe = workspace / "recipe.toml"
    recipe.write_text(recipe.read_text().replace("thickness_mm = 0.10", "thickness_cm = 0.01"))
    for words in (["plan"], ["fit"], ["report"], ["package", "build"], ["capture", "friction"]):
        device = ["--device", "sim"] if words[0] == "capture" else []
        said = cli(*words, *device)
        assert said.code == 2
        assert "material.thickness_cm: unknown key. Did you mean thickness_mm?" in said.err


@pytest.mark.parametrize("words", [["plan"], ["fit"], ["report"], ["package", "build"]])
def test_outside_a_workspace_the_next_step_is_named(
    words: list[str], cli: Cli, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    said = cli(*words)
    assert said.code == 5
    assert "scissorcal init" in said.err


def test_an_interrupted_capture_is_recovered_by_the_next_command(cli: Cli, workspace: Path) -> None:
    path = record_friction(Workspace(workspace))
    path.rename(path.with_name(path.name + ".part"))
    said = cli("plan", "--json")
    assert "was recovered from an interrupted capture" in said.err
    (step, *_) = said.envelope["result"]["steps"]
    assert (step["name"], step["state"]) == ("capture friction", "done")
    assert path.is_file()
    assert "recovered" not in cli("plan").err


def test_a_friction_recording_without_motion_is_refused_by_the_fit(
    cli: Cli, workspace: Path
) -> None:
    still = [np.full(6000, 0.5)]
    strokes = [Stroke(0, "closing", 0.1)]
    rng = np.random.default_rng(1)
    made = make_recording("friction", still, [0.0], strokes, Truth(), rng, False)
    write_recording(made, Workspace(workspace).new_recording("friction"))
    said = cli("fit", "friction")
    assert said.code == 2
    assert "Traceback" not in said.err


def test_a_capture_that_cannot_be_read_is_named_with_the_way_on(cli: Cli, workspace: Path) -> None:
    foreign = Workspace(workspace).new_recording("friction")
    foreign.write_bytes(b"")
    said = cli("fit", "friction")
    assert said.code == 2
    assert f"scissorcal recording exclude {foreign.name}" in said.err
    plan = cli("plan", "--json").envelope["result"]
    assert plan["next_command"].startswith(f"scissorcal recording exclude {foreign.name} ")
    assert foreign.is_file()


def test_friction_alone_is_reported_before_anything_is_cut(
    cli: Cli, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    workspace = quick_workspace(tmp_path / "friction-only")
    record_friction(workspace)
    monkeypatch.chdir(workspace.root)
    assert cli("fit", "friction").code == 0
    assert len(cli("report", "--json").envelope["result"]["fits"]) == 1
    assert "not there yet" in workspace.report_json.read_text(encoding="utf-8")
    assert cli("package", "build").code == 5


def test_a_missing_package_is_not_said_to_have_fallen_behind(cli: Cli, workspace: Path) -> None:
    said = cli("render", "--device", "sim")
    assert said.code == 5
    assert "package build" in said.err
    assert "not of the fits" not in said.err
