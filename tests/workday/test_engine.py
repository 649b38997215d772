"""States of the steps: what makes a result stale, incomplete, failed or unverified."""

import json
import os
import shutil
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any, Literal

import numpy as np
import pytest

from scissorcal.calibration import VerifyResult, load_fit, save
from scissorcal.device import LockstepLink, RigSession, open_writer
from scissorcal.device.capture import capture
from scissorcal.errors import InputError, MissingError, VerdictError
from scissorcal.recording import read_recording, write_recording
from scissorcal.verdicts import Status, Verdict
from scissorcal.workday.engine import Engine
from scissorcal.workday.history import restore, versions
from scissorcal.workday.index import FileIndex
from scissorcal.workday.options import FitOptions
from scissorcal.workday.plan import make_plan
from scissorcal.workday.recordings import exclude_recording, include_recording, used_recordings
from scissorcal.workday.runs.fit import fit_workspace
from scissorcal.workday.runs.package import build_workspace_package
from scissorcal.workday.runs.report import write_workspace_report
from scissorcal.workday.runs.simplest import known_scene_choice
from scissorcal.workday.states import WAITING
from scissorcal.workday.steps import BY_NAME, STEPS
from scissorcal.workday.workspace import Workspace
from tests.workday.made import fitted_copy, quick_workspace, record_friction


@pytest.fixture(scope="module")
def fitted(tmp_path_factory: pytest.TempPathFactory) -> Workspace:
    """Friction and a cut, recorded and fitted at draft effort."""
    return fitted_copy(
        tmp_path_factory, tmp_path_factory.mktemp("engine") / "paper", "friction", "cut"
    )


@pytest.fixture
def copied(fitted: Workspace, tmp_path: Path) -> Workspace:
    shutil.copytree(fitted.root, tmp_path / "copy")
    return Workspace(tmp_path / "copy")


def state(workspace: Workspace, name: str) -> str:
    return Engine.of(workspace).state(name).state


def fail(workspace: Workspace, check: str) -> None:
    """Give the friction fit a failed check, keeping the identity of its inputs."""
    path = workspace.fit_path("friction")
    fit = load_fit(path)
    wrong = Verdict("fit.friction", check, "fail", 1.0, 0.5, "Made to fail.")
    save(replace(fit, verdicts=(wrong,)), path)


def test_inputs_are_rows_above_and_no_step_builds_on_itself() -> None:
    seen: set[str] = set()
    for step in STEPS:
        names = {item.rstrip("?") for item in step.inputs}
        assert names <= seen, step.name
        assert not step.verified_by or step.name in BY_NAME[step.verified_by].inputs
        seen.add(step.name)


@pytest.mark.parametrize(
    ("step", "setting"),
    [
        ("fit camera", "[fit.camera.priors]\nbulge_sd_mm = 2.0"),
        ("fit blade", "[fit.blade.priors]\nslope_sd = 0.2"),
        ("fit blade", "[fit.blade.priors]\nprint_scale_sd_percent = 0.02"),
        ("fit plate", "[fit.plate.priors]\nprint_scale_sd_percent = 0.02"),
        ("fit friction", "[fit.friction.priors.rotary]\noffset_Nm = { mean = 0.0, sd = 0.2 }"),
    ],
)
def test_another_prior_is_another_identity_of_its_own_fit_only(
    tmp_path: Path, step: str, setting: str
) -> None:
    workspace = quick_workspace(tmp_path / "made-up")
    fits = [row.name for row in STEPS if row.kind == "fit"]
    before = {name: Engine.of(workspace).identity(name) for name in fits}
    text = workspace.recipe_path.read_text(encoding="utf-8")
    workspace.recipe_path.write_text(f"{text}\n{setting}\n", encoding="utf-8")
    after = {name: Engine.of(workspace).identity(name) for name in fits}
    # a cut takes the priors of the friction that it is fitted with
    others = {"fit cut"} if step == "fit friction" else set()
    assert {name for name in fits if before[name] != after[name]} == {step} | others


def test_another_seed_of_friction_makes_the_cut_stale(copied: Workspace) -> None:
    assert state(copied, "fit cut") == "unverified"
    fit_workspace(copied, ("friction",), FitOptions(seed=7, force=True))
    assert state(copied, "fit friction") == "unverified"
    assert state(copied, "fit cut") == "stale"
    assert make_plan(copied).next_command == "scissorcal fit cut"


def test_the_same_fit_again_leaves_the_cut_current_and_adds_no_version(copied: Workspace) -> None:
    fit_workspace(copied, (), FitOptions(force=True))
    for version in versions(Engine.of(copied)):
        if not version.current:
            shutil.rmtree(version.path.parent)
    fit_workspace(copied, ("friction",), FitOptions(force=True))
    assert state(copied, "fit cut") == "unverified"
    assert len(versions(Engine.of(copied), "friction")) == 1


def test_an_earlier_version_is_kept_and_restored(copied: Workspace) -> None:
    before = copied.fit_path("friction").read_bytes()
    fit_workspace(copied, ("friction",), FitOptions(seed=7, force=True))
    engine = Engine.of(copied)
    current, earlier = versions(engine, "friction")
    assert (current.current, earlier.current) == (True, False)
    with pytest.raises(InputError, match="in use"):
        restore(engine, current.name)
    with pytest.raises(MissingError, match=earlier.name):
        restore(engine, "nothing")
    restore(engine, earlier.name)
    assert copied.fit_path("friction").read_bytes() == before
    assert state(copied, "fit cut") == "unverified"
    assert [version.current for version in versions(Engine.of(copied), "friction")].count(True) == 1


def test_a_copy_of_a_workspace_keeps_the_names_of_its_versions(copied: Workspace) -> None:
    fit_workspace(copied, ("friction",), FitOptions(seed=7, force=True))
    before = versions(Engine.of(copied), "friction")
    for file in copied.root.rglob("*"):
        os.utime(file, (1e9, 1e9))  # as a copy without times of files
    after = versions(Engine.of(copied), "friction")
    assert {version.name for version in after} == {version.name for version in before}
    (earlier,) = (version for version in before if not version.current)
    assert [v.time_utc for v in after if not v.current] == [earlier.time_utc]
    restored, _ = restore(Engine.of(copied), earlier.path.parent.name)  # its folder names it, too
    assert restored.name == earlier.name
    assert len(versions(Engine.of(copied), "friction")) == 2


def test_a_fit_that_cannot_be_written_leaves_the_earlier_one(
    copied: Workspace, monkeypatch: pytest.MonkeyPatch
) -> None:
    before = copied.fit_path("friction").read_bytes()

    def full(part: Path, content: bytes) -> int:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(Path, "write_bytes", full)
    with pytest.raises(InputError, match="The disk is full"):
        fit_workspace(copied, ("friction",), FitOptions(seed=7, force=True))
    assert copied.fit_path("friction").read_bytes() == before
    assert state(copied, "fit friction") == "unverified"


def test_an_excluded_recording_is_not_used_until_it_is_included(copied: Workspace) -> None:
    second = record_friction(copied, seed=5)
    assert state(copied, "fit friction") == "stale"
    exclude_recording(copied, second.name, "the cable was loose")
    assert state(copied, "fit friction") == "unverified"
    assert len(used_recordings(copied, copied.recipe(), "friction")) == 1
    (note,) = Engine.of(copied).state("capture friction").notes
    assert "the cable was loose" in note
    with pytest.raises(InputError, match="--why"):
        exclude_recording(copied, second.name, " ")
    include_recording(copied, second.name)
    assert state(copied, "fit friction") == "stale"
    with pytest.raises(MissingError, match="is not excluded"):
        include_recording(copied, second.name)


def test_without_any_used_recording_the_capture_is_missing(copied: Workspace) -> None:
    for path in copied.recordings("friction"):
        exclude_recording(copied, path.name, "wrong rig")
    assert state(copied, "capture friction") == "missing"
    assert state(copied, "fit friction") == "stale"


@pytest.mark.parametrize(
    ("check", "command"),
    [
        ("k-hat", "scissorcal fit friction --effort thorough"),
        ("hold-out", "scissorcal capture friction --device PORT"),
    ],
)
def test_a_failed_fit_leads_to_its_remedy(copied: Workspace, check: str, command: str) -> None:
    fail(copied, check)
    fit = Engine.of(copied).state("fit friction")
    assert (fit.state, fit.failed, fit.command) == ("failed", (check,), command)
    assert make_plan(copied).next_command == command


def test_a_package_of_a_failed_fit_is_refused_unless_allowed(copied: Workspace) -> None:
    fail(copied, "hold-out")
    fit_workspace(copied, ("cut",))
    with pytest.raises(
        VerdictError, match=r"hold-out.*scissorcal capture friction.*--allow-failed"
    ):
        build_workspace_package(Engine.of(copied))
    assert not Engine.of(copied).file("package build").exists()
    built = build_workspace_package(Engine.of(copied), allow_failed=True)
    assert built.path.is_file()


def test_package_and_scene_choice_come_of_one_walk(
    copied: Workspace, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Also with a seed of its own: what is kept and printed is of what ships."""
    from scissorcal.package.simplest import model

    walks = []

    def counted(*args: Any, **options: Any) -> Any:
        walks.append(args)
        return walk(*args, **options)

    walk = model.walk
    monkeypatch.setattr(model, "walk", counted)
    built = build_workspace_package(Engine.of(copied), seed=5)
    assert len(walks) == 1
    assert built.choice == known_scene_choice(Engine.of(copied))
    assert built.choice is not None
    assert built.choice.simplification == built.manifest.simplification
    members = built.manifest.members
    headers = 128 * len(members)
    assert built.choice.simplification.bytes_after == (
        sum(member.bytes for member in members) - headers
    )


def test_a_fit_that_ran_out_of_time_is_incomplete(copied: Workspace) -> None:
    path = copied.fit_path("friction")
    fit = load_fit(path)
    save(replace(fit, inputs_hash=f"unfinished:{fit.inputs_hash}"), path)
    found = Engine.of(copied).state("fit friction")
    assert found.state == "incomplete"
    assert found.command == "scissorcal fit friction --max-minutes 60"


def test_a_stopped_fit_of_other_data_is_stale(copied: Workspace) -> None:
    path = copied.fit_path("friction")
    fit = load_fit(path)
    save(replace(fit, inputs_hash=f"unfinished:{fit.inputs_hash}"), path)
    record_friction(copied, seed=9)
    assert state(copied, "fit friction") == "stale"
    assert state(copied, "fit cut") == "stale"


def check_of(workspace: Workspace, what: Literal["friction", "cut"], status: Status) -> None:
    """Keep a verification of the fit as it is now, with coverage counted."""
    engine = Engine.of(workspace)
    fit = load_fit(engine.file(f"fit {what}"))
    verdict = Verdict(f"verify.{what}", "calibration", status, 0.4, 0.5, "Ranks as they are.")
    check = VerifyResult(
        format="scissorcal-verify/1",
        what=what,
        fit_hash=fit.inputs_hash,
        candidate=fit.candidate,
        effort=fit.effort,
        seed=0,
        calibration=None,
        halves=None,
        sensitivity=None,
        not_done=(),
        false_alarm=0.01,
        verdicts=(verdict,),
        fit_content=engine.identity(f"verify {what}"),
    )
    save(check, engine.file(f"verify {what}"))


def test_a_trust_check_that_fails_later_reaches_the_cut_and_the_package(copied: Workspace) -> None:
    build_workspace_package(Engine.of(copied))
    assert state(copied, "package build") == "done"
    check_of(copied, "friction", "fail")
    assert state(copied, "fit friction") == "failed"
    cut = Engine.of(copied).state("fit cut")
    assert (cut.state, cut.failed) == ("failed", ("fit friction failed",))
    assert state(copied, "package build") == "stale"
    with pytest.raises(VerdictError, match="--allow-failed"):
        build_workspace_package(Engine.of(copied))
    built = build_workspace_package(Engine.of(copied), allow_failed=True)
    assert any("verify.friction, calibration" in why for why in built.manifest.failed_checks)
    assert any("failed 1 check" in warning for warning in built.warnings)
    assert state(copied, "package build") == "failed"


def test_a_check_with_coverage_verifies(copied: Workspace) -> None:
    check_of(copied, "friction", "pass")
    assert state(copied, "fit friction") == "done"
    check_of(copied, "friction", "not_evaluated")
    assert state(copied, "fit friction") == "unverified"


def test_a_report_without_its_page_is_missing(copied: Workspace) -> None:
    write_workspace_report(Engine.of(copied))
    assert state(copied, "report") == "done"
    copied.report_html.unlink()
    assert state(copied, "report") == "missing"


def test_a_recording_copied_under_another_name_counts_once(copied: Workspace) -> None:
    (path,) = copied.recordings("friction")
    before = Engine.of(copied).state("capture friction").content
    shutil.copy(path, path.with_name("friction-20990101T000000Z.mcap"))
    found = Engine.of(copied).state("capture friction")
    assert found.content == before
    assert any(f"it has the same content as {path.name}" in note for note in found.notes)


def test_only_recordings_of_friction_and_cuts_are_excluded(copied: Workspace) -> None:
    stray = copied.captures_dir / "render-20990101T000000Z.mcap"
    stray.write_bytes(b"")
    with pytest.raises(MissingError, match="no recording of friction or a cut called render"):
        exclude_recording(copied, stray.name, "not a capture")


def test_a_capture_that_the_rig_cannot_follow_is_not_done(
    captured: Workspace, tmp_path: Path
) -> None:
    shutil.copytree(captured.root, tmp_path / "beyond")
    workspace = Workspace(tmp_path / "beyond")
    text = workspace.recipe_path.read_text(encoding="utf-8")
    beyond = text.replace("opening_deg = [12.0, 50.0]", "opening_deg = [100.0, 120.0]")
    workspace.recipe_path.write_text(beyond, encoding="utf-8")
    found = Engine.of(workspace).state("capture friction")
    assert (found.state, found.command) == (
        "incomplete",
        "scissorcal capture friction --device PORT",
    )
    assert "lacks a plan that this rig can follow" in found.found


def brisk_workspace(folder: Path) -> Workspace:
    """A quick workspace whose capture of friction takes half a minute."""
    workspace = quick_workspace(folder)
    text = workspace.recipe_path.read_text(encoding="utf-8")
    text = text.replace("[0.1, 0.3, 0.8]", "[0.3, 0.6, 0.8]\nexcitation_s = 5.0")
    workspace.recipe_path.write_text(text, encoding="utf-8")
    return workspace


@pytest.fixture(scope="module")
def captured(tmp_path_factory: pytest.TempPathFactory) -> Workspace:
    """A whole capture of friction on the virtual rig, in virtual time."""
    workspace = brisk_workspace(tmp_path_factory.mktemp("captured") / "paper")
    text = workspace.recipe_path.read_text(encoding="utf-8")
    recipe = workspace.recipe()
    link = LockstepLink("office-paper", np.random.default_rng(1))
    path = workspace.new_recording("friction")
    with open_writer(RigSession(link, recipe, recipe_toml=text), "friction", path) as writer:
        capture(RigSession(link, recipe), "friction", writer)
    return workspace


def test_a_whole_capture_is_done(captured: Workspace) -> None:
    found = Engine.of(captured).state("capture friction")
    assert (found.state, found.command) == ("done", "")


def test_a_speed_that_the_fit_hardly_uses_is_named_in_plan_and_report(tmp_path: Path) -> None:
    """At 0.05 rad/s the encoder of the virtual rig does not show the direction of motion."""
    workspace = quick_workspace(tmp_path / "slow")
    text = workspace.recipe_path.read_text(encoding="utf-8")
    text = text.replace("[0.1, 0.3, 0.8]", "[0.05, 0.3]\nrepeats = 1\nexcitation_s = 3.0")
    workspace.recipe_path.write_text(text, encoding="utf-8")
    link = LockstepLink("office-paper", np.random.default_rng(2))
    path = workspace.new_recording("friction")
    with open_writer(
        RigSession(link, workspace.recipe(), recipe_toml=text), "friction", path
    ) as writer:
        capture(RigSession(link, workspace.recipe()), "friction", writer)
    before = Engine.of(workspace).completeness("friction")
    assert all(row.used is None for row in before.summary)
    assert before.missing == ()
    (outcome,) = fit_workspace(workspace, ("friction",))
    assert any("used of the strokes at 0.05 per s" in note for note in outcome.result.notes)
    engine = Engine.of(workspace)
    notes = make_plan(workspace).notes
    assert any(note.startswith("fit friction, closing at 0.05 rad/s: ") for note in notes)
    assert not any("at 0.3 rad/s" in note for note in notes)
    rows = {(row.name, row.unit): row for row in engine.completeness("friction").summary}
    slow = rows["closing at 0.05 rad/s", "ranges of opening"]
    fast = rows["closing at 0.3 rad/s", "ranges of opening"]
    assert slow.used is not None
    assert slow.used < slow.recorded == slow.planned
    assert fast.used == fast.recorded == fast.planned
    write_workspace_report(engine)
    twin = json.loads(workspace.report_json.read_text(encoding="utf-8"))
    (decision,) = [panel for panel in twin["panels"] if panel["id"] == "decision-data"]
    assert "closing at 0.05 rad/s" in decision["sentence"]


@pytest.mark.parametrize(
    ("kept", "words"),
    [
        (
            0.5,
            (
                "closing strokes at 0.3 rad/s: 1 of 3 recorded",
                "opening strokes at 0.3, 0.6 rad/s: 1 of 2 recorded each",
                "excitation: 0.0 s of 5 s",
            ),
        ),
        (0.9, ("excitation:",)),
    ],
)
def test_half_a_capture_is_incomplete_and_says_what_is_missing(
    captured: Workspace, tmp_path: Path, kept: float, words: tuple[str, ...]
) -> None:
    (path,) = captured.recordings("friction")
    whole = read_recording(path)
    workspace = brisk_workspace(tmp_path / "half")
    count = int(kept * len(whole.samples))
    write_recording(
        replace(whole, samples=whole.samples[:count]), workspace.new_recording("friction")
    )
    found = Engine.of(workspace).state("capture friction")
    assert found.state == "incomplete"
    assert found.command == "scissorcal capture friction --device PORT"
    for word in words:
        assert any(word in note for note in found.notes), found.notes


def test_two_halves_make_a_whole_capture(captured: Workspace, tmp_path: Path) -> None:
    """What one capture lacks another may hold: cells, strokes and excitation are summed."""
    (path,) = captured.recordings("friction")
    whole = read_recording(path)
    label = whole.samples["stroke"]
    cut = int(np.flatnonzero(label == label.max() // 2)[-1]) + 50
    workspace = brisk_workspace(tmp_path / "halves")
    for samples in (whole.samples[:cut], whole.samples[cut:]):
        write_recording(replace(whole, samples=samples), workspace.new_recording("friction"))
    assert state(workspace, "capture friction") == "done"


def test_an_import_has_no_plan_to_be_complete_against(fitted: Workspace) -> None:
    assert state(fitted, "capture friction") == "done"


def test_the_index_reads_a_file_once_and_again_when_it_changed(tmp_path: Path) -> None:
    reads: list[str] = []

    def read(path: Path) -> dict[str, str]:
        reads.append(path.read_text())
        return {"text": reads[-1]}

    path = tmp_path / "a.txt"
    path.write_text("one")
    first = FileIndex(tmp_path)
    assert first.facts(path, "text", read) == first.facts(path, "text", read) == {"text": "one"}
    first.save()
    assert FileIndex(tmp_path).facts(path, "text", read) == {"text": "one"}
    path.write_text("two")
    assert FileIndex(tmp_path).facts(path, "text", read) == {"text": "two"}
    assert reads == ["one", "two"]


def damaged(path: Path) -> None:
    path.write_text("{")


def foreign(path: Path) -> None:
    path.write_text(json.dumps({"format": "another", "files": {"x": 1}}))


def removed(path: Path) -> None:
    shutil.rmtree(path.parent)


def misspelt(path: Path) -> None:
    path.write_text(path.read_text().replace('"sha256"', '"sha25c"'))


def of_another_value(path: Path) -> None:
    path.write_text(path.read_text().replace('"failed": []', '"failed": ["bounds"]'))


@pytest.mark.parametrize("change", [damaged, foreign, removed, misspelt, of_another_value])
def test_a_damaged_index_changes_no_state(
    copied: Workspace, change: Callable[[Path], None]
) -> None:
    before = [step.state for step in make_plan(copied).steps]
    index = copied.root / ".scissorcal" / "index.json"
    kept = index.read_text()
    change(index)
    assert not index.exists() or index.read_text() != kept
    assert [step.state for step in make_plan(copied).steps] == before


def test_what_waits_for_a_step_is_stale_while_it_waits(copied: Workspace) -> None:
    copied.fit_path("friction").unlink()
    assert state(copied, "fit friction") in WAITING
    assert Engine.of(copied).state("fit cut").found == "fit friction is missing"
