"""A path followed with a workspace's rig: what it needs, what it keeps, what it says."""

import json
import re
from collections.abc import Iterator
from contextlib import contextmanager, nullcontext
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from scissorcal.control import REQUEST_FIRST
from scissorcal.device import LockstepLink, Operator, RigSession
from scissorcal.errors import DeviceError, InputError, MissingError
from scissorcal.kernel import Capability
from scissorcal.recording import CONTROL, read_attachments, read_recording, read_telemetry
from scissorcal.verdicts import failed
from scissorcal.workday.options import (
    SIM_RIG,
    CaptureOptions,
    ControlOptions,
    FitOptions,
    RigOptions,
)
from scissorcal.workday.rigs import open_rig
from scissorcal.workday.runs import control as runs_control
from scissorcal.workday.runs.capture import capture_into
from scissorcal.workday.runs.control import control_workspace
from scissorcal.workday.runs.fit import fit_workspace
from scissorcal.workday.runs.probe import ensure_probed
from scissorcal.workday.tracking.stated_pose import stated_pose
from scissorcal.workday.workspace import Workspace, create_workspace

pytestmark = pytest.mark.slow

LONG = """speeds_rad_per_s = [0.05, 0.12, 0.3, 0.7, 1.5]
repeats = 2
excitation_s = 10.0
"""
FEWER = """speeds_rad_per_s = [0.2, 0.7]
repeats = 1
excitation_s = 4.0
"""
SHORT = """
[capture.friction_advance]
speeds_mm_per_s = [30.0, 80.0]
repeats = 1
excitation_s = 3.0

[fit.friction]
law = "coulomb+viscous"
symmetry = "symmetric"
critic = false

[fit.friction_advance]
law = "coulomb+viscous"
symmetry = "symmetric"
critic = false
"""


@pytest.fixture(scope="module")
def fitted(tmp_path_factory: pytest.TempPathFactory) -> Workspace:
    """A workspace with draft fits of one law to short captures of both axes."""
    folder = tmp_path_factory.mktemp("day")
    workspace = create_workspace(folder / "paper", "paper-80gsm")
    text = workspace.recipe_path.read_text(encoding="utf-8")
    assert LONG in text
    workspace.recipe_path.write_text(text.replace(LONG, FEWER) + SHORT, encoding="utf-8")
    capture_into(workspace, "friction", SIM_RIG, CaptureOptions(designed=False))
    capture_into(workspace, "friction-advance", SIM_RIG)
    fit_workspace(workspace, ("friction", "friction-advance"), FitOptions(effort="draft"))
    (workspace.root / "path.csv").write_text("x_mm,force_N\n10,2\n30,2\n20,3\n")
    return workspace


def path_of(workspace: Workspace) -> Path:
    return workspace.root / "path.csv"


def test_a_path_is_followed_with_what_was_fitted(fitted: Workspace) -> None:
    """The recipe's specimen has its plate at 20, 10 mm, pitched by 3 degrees."""
    done = control_workspace(fitted, SIM_RIG, ControlOptions(path_of(fitted), pose="20,10,3"))
    figures = done.result.figures
    assert failed(done.result.verdicts) == ()
    assert figures.force_rms_N < 0.12
    assert figures.path_95_mm < 0.3
    assert figures.way_mm == pytest.approx(30.0, abs=0.1)
    assert done.result.wanted_N == 3.0
    assert done.recording is not None
    recording = read_recording(done.recording)
    assert recording.kind == "control"
    assert "Followed 30.0 mm of path" in recording.notes[-1]
    (attached,) = read_attachments(done.recording)
    assert attached.name == "path.csv"
    assert attached.data == path_of(fitted).read_bytes()
    rows = read_telemetry(done.recording, CONTROL)
    assert rows["force_wanted"].max() == pytest.approx(3.0, abs=0.01)
    assert np.all(np.diff(rows["host_time_ns"]) > 0)
    assert fitted.recordings("control") == (done.recording,)


def test_without_fits_it_says_what_to_run(tmp_path: Path) -> None:
    workspace = create_workspace(tmp_path / "paper", "paper-80gsm")
    path = workspace.root / "path.csv"
    path.write_text("x_mm\n10\n30\n")
    with pytest.raises(MissingError, match="scissorcal capture friction"):
        control_workspace(workspace, SIM_RIG, ControlOptions(path, pose="20,10,3"))


def test_without_a_pose_it_says_what_to_do(fitted: Workspace) -> None:
    with pytest.raises(MissingError, match=r"--pose"):
        control_workspace(fitted, SIM_RIG, ControlOptions(path_of(fitted)))


def test_without_friction_of_the_carriage_it_says_what_to_run(
    fitted: Workspace, tmp_path: Path
) -> None:
    import shutil

    other = Workspace(tmp_path / "paper")
    shutil.copytree(fitted.root, other.root)
    (other.root / "fits" / "friction-advance.nc").unlink()
    with pytest.raises(MissingError, match="--axis advance"):
        control_workspace(other, SIM_RIG, ControlOptions(path_of(other), pose="20,10,3"))


def test_a_specimen_without_a_plate_is_said(fitted: Workspace, tmp_path: Path) -> None:
    made = LockstepLink.configure

    def refuse(self: LockstepLink, key: int, value: float) -> float:
        self.rig.specimen = self.rig.specimen.model_copy(update={"plate": None})
        return made(self, key, value)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(LockstepLink, "configure", refuse)
        with pytest.raises(Exception, match="give the virtual rig's specimen a plate"):
            control_workspace(
                fitted, SIM_RIG, ControlOptions(path_of(fitted), pose="20,10,3", no_record=True)
            )


def test_a_person_puts_the_plate_in_before_a_camera_looks_for_it(
    fitted: Workspace, monkeypatch: pytest.MonkeyPatch
) -> None:
    """On a rig that says that it is real."""
    link = LockstepLink("office-paper", np.random.default_rng(1))
    real = int(link.identity.capabilities) & ~int(Capability.SIMULATOR)
    link.identity = link.identity._replace(capabilities=real)
    events: list[tuple[str, float, float]] = []

    def note(what: str) -> None:
        joint = link.rig.joint
        joint.place = (
            joint.low if "close the blades" in what else
            joint.high if "open the blades" in what else
            0.5 if "half open" in what else joint.place
        )  # fmt: skip
        events.append((what, link.rig.opening, link.rig.advance))

    class Eye:
        world_rig = nullcontext(link)

        @contextmanager
        def follow(self, *given: Any, **held: float) -> Iterator[None]:
            note("looked")
            raise DeviceError("There is no pose of the plate.")
            yield

    monkeypatch.setattr(runs_control, "_camera", lambda *given: Eye())
    port, tracked = RigOptions("port"), ControlOptions(path_of(fitted), camera="0", no_record=True)
    with pytest.raises(DeviceError, match="no pose"):
        control_workspace(fitted, port, tracked, Operator(note))
    (asked, *_), (looked, *_) = events[-2:]
    assert (asked, looked) == (REQUEST_FIRST, "looked")
    assert events[-2][1:] == events[-1][1:], "nothing moved since"
    with pytest.raises(InputError, match="A person must be asked"):
        control_workspace(fitted, port, tracked)
    assert [what for what, *_ in events].count("looked") == 1


@pytest.mark.parametrize("text", ["", "1", "1,2,3,4", "a,b", "1,nan", "1;2"])
def test_a_pose_that_is_none_is_refused(text: str) -> None:
    with pytest.raises(InputError, match="X_MM,Y_MM,RISE_DEG"):
        stated_pose(text)


def test_the_surface_and_its_material_are_the_recipes(fitted: Workspace, tmp_path: Path) -> None:
    import shutil

    other = Workspace(tmp_path / "paper")
    shutil.copytree(fitted.root, other.root)
    with open_rig("sim", other.recipe().specimen, 0) as link:
        ensure_probed(
            other, RigSession(link, other.recipe())
        )  # the last one may be of another test's rig
    late = json.loads(other.probe_path.read_text())
    late["delay_s"] = {"mean": 4e-3, "sd": 1e-4}
    other.probe_path.write_text(json.dumps(late))
    recipe = other.recipe_path
    meant = 'unusual = ["plate.touch.stiffness_N_per_mm"]\n' + recipe.read_text()
    recipe.write_text(meant + "\n[plate.touch]\nstiffness_N_per_mm = 900\n")
    with pytest.raises(InputError, match="No gains hold a force against 900 N/mm"):
        control_workspace(other, SIM_RIG, ControlOptions(path_of(other), pose="20,10,3"))
    text = re.sub(r"(?m)^stiffness.*", "peak_N = 1.0", recipe.read_text())
    recipe.write_text(text + '[plate.surface]\nkind = "sphere"\nradius_mm = 20.0\n')
    with pytest.raises(InputError, match="line 3: x = 30 mm leaves the surface"):
        control_workspace(other, SIM_RIG, ControlOptions(path_of(other), pose="20,10,3"))


def test_the_command_tells_and_keeps(fitted: Workspace, capsys: pytest.CaptureFixture[str]) -> None:
    from scissorcal.cli.root import run

    words = ["control", "--device", "sim", "--path", str(path_of(fitted)), "--pose", "20,10,3"]
    with pytest.raises(SystemExit) as ended:
        run([*words, "--force", "2", "--json", "-w", str(fitted.root)])
    out, err = capsys.readouterr()
    assert ended.value.code == 0, err
    envelope = json.loads(out)
    assert envelope["result"]["figures"]["losses"] == 0
    assert envelope["files"][0].endswith(".mcap")
    assert {verdict["check"] for verdict in envelope["verdicts"]} >= {"force", "path", "touch"}
    with pytest.raises(SystemExit) as ended:
        run([*words, "-w", str(fitted.root), "--no-record"])
    out, err = capsys.readouterr()
    assert ended.value.code == 0, err
    assert "followed 30.0 mm of path" in out
    assert "following the path" in err
