"""--camera of 'control' and 'render': what is refused, what is recorded, what is said."""

from collections.abc import Iterator
from pathlib import Path

import pytest

from scissorcal.errors import DeviceError
from scissorcal.recording import FRAME, PICTURE, POSE, read_recording, read_telemetry
from scissorcal.vision import Frame
from scissorcal.workday import (
    SIM_RIG,
    CaptureOptions,
    FitOptions,
    SimWorld,
    Workspace,
    capture_into,
    fit_workspace,
)
from tests.cli.conftest import Cli
from tests.package.fits import recipe as known_recipe
from tests.render.conftest import on_estimated_plate, package_for

SIM = ("--device", "sim", "--camera", "sim")


@pytest.fixture(scope="module")
def packages(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """Packages whose plate's pose is known, or estimated between two moving blades."""
    known, both = (tmp_path_factory.mktemp(name) for name in ("known", "both"))
    package_for(known, known_recipe(), energy=0.52)
    package_for(both, on_estimated_plate("both"), energy=0.52)
    return {"known": known / "package.zip", "both": both / "package.zip"}


def recordings(workspace: Path) -> list[Path]:
    return sorted((workspace / "captures").glob("*.mcap"))


def test_a_known_pose_takes_no_camera(
    cli: Cli, calibrated: Path, packages: dict[str, Path]
) -> None:
    said = cli("render", *SIM, "--package", packages["known"])
    assert said.code == 2
    assert "has a known plate pose, so no camera is used" in said.err
    assert recordings(calibrated) == []
    assert not Workspace(calibrated).probe_path.exists(), "nothing of it runs"


def test_a_pose_is_stated_once(cli: Cli, calibrated: Path) -> None:
    path = calibrated / "path.csv"
    path.write_text("x_mm\n10\n30\n")
    said = cli("control", *SIM, "--path", path, "--pose", "20,10,3")
    assert said.code == 2
    assert "give one" in said.err


def test_cameras_that_do_not_go_with_the_rig_are_refused(
    cli: Cli, calibrated: Path, packages: dict[str, Path]
) -> None:
    render = ("render", "--package", packages["both"])
    said = cli(*render, "--device", "sim", "--camera", "0")
    assert said.code == 2
    assert "do not show the same plate" in said.err
    said = cli(*render, "--device", "/dev/ttyUSB9", "--camera", "plate.avi")
    assert said.code == 2
    assert "was recorded at another time" in said.err
    said = cli(*render, *SIM, "--realtime")
    assert said.code == 2
    assert "leave --realtime out" in said.err
    said = cli(*render, "--device", "sim", "--taps", "3")
    assert said.code == 2
    assert "name a camera too" in said.err


def test_taps_of_a_plate_that_may_not_be_carried_are_refused(
    cli: Cli, calibrated: Path, packages: dict[str, Path]
) -> None:
    words = ("render", *SIM, "--package", packages["both"], "--taps", "3")
    recipe = Workspace(calibrated).recipe_path
    text = recipe.read_text()
    for stated in ("", "\n[plate.tracking]\nspeed_mm_per_s = 5\n"):
        recipe.write_text(text + stated)
        said = cli(*words)
        assert said.code == 2
        assert "speed_mm_per_s = 5 and turn_deg_per_s = 2 in [plate.tracking]" in said.err
    assert recordings(calibrated) == []


@pytest.mark.parametrize(
    ("error", "words"),
    [
        (DeviceError("The camera 0 was unplugged."), "The camera 0 was unplugged."),
        pytest.param(None, "There is no pose of the plate after 10 s", marks=pytest.mark.slow),
    ],
)
def test_without_a_first_pose_the_camera_says_why(
    cli: Cli,
    calibrated: Path,
    packages: dict[str, Path],
    monkeypatch: pytest.MonkeyPatch,
    error: DeviceError | None,
    words: str,
) -> None:
    asked: list[float] = []

    def frames(self: SimWorld, until_s: float) -> Iterator[Frame]:
        asked.append(until_s)
        if error is not None:
            raise error
        return iter(())

    monkeypatch.setattr(SimWorld, "frames", frames)
    said = cli("render", *SIM, "--package", packages["both"], "--no-record")
    assert said.code == 4
    assert words in said.err
    if error is None:
        assert "The camera gave no picture." in said.err
        assert asked[-1] - asked[0] == pytest.approx(10.0, abs=0.2)
    else:
        assert len(asked) == 1, "nothing is waited for"


def test_without_the_rigs_frame_it_says_what_to_photograph(
    cli: Cli, workspace: Path, album: Path, packages: dict[str, Path]
) -> None:
    said = cli("render", *SIM, "--package", packages["both"])
    assert said.code == 5
    assert "run 'scissorcal fit camera' first" in said.err
    cli("import", album / "camera.yml")
    said = cli("render", *SIM, "--package", packages["both"])
    assert said.code == 5
    assert "'scissorcal capture plate --camera sim --positions sim'" in said.err
    assert "known" in said.err
    assert recordings(workspace) == []


@pytest.mark.slow
def test_a_rendering_is_tracked_and_keeps_the_rows_of_a_track(
    cli: Cli, calibrated: Path, packages: dict[str, Path]
) -> None:
    words = ("render", *SIM, "--package", packages["both"], "--seconds", "1.5", "--json")
    said = cli(*words)
    assert said.code in (0, 3), said.err
    result = said.envelope["result"]
    assert result["plate"]["estimates"] == pytest.approx(150, abs=10)
    assert result["plate"]["lost"] == 0
    tracked = result["tracked"]
    assert tracked["source"] == "camera sim"
    assert tracked["figures"]["pictures"]["used"] > 12
    assert tracked["figures"]["contacts"]["used"] == 0, "nothing real is between the blades"
    assert {"clock jumps", "refused pictures"} <= {v["check"] for v in said.envelope["verdicts"]}
    (path,) = recordings(calibrated)
    assert read_recording(path).kind == "render"
    poses = read_telemetry(path, POSE)
    assert len(poses) == len(read_telemetry(path, FRAME)) > 12
    assert len(read_telemetry(path, PICTURE)) == tracked["pictures"]
    assert (poses["covariance"].reshape(-1, 6, 6)[:, 3, 3] > 0.0).all()
    again = cli("track", "--camera", path)
    assert again.code == 2
    assert "is not the recording of a track but of 'render'" in again.err
    assert "captures/track-*.mcap" in again.err


@pytest.mark.slow
def test_a_path_is_followed_on_a_tracked_plate(cli: Cli, calibrated: Path) -> None:
    workspace = Workspace(calibrated)
    capture_into(workspace, "friction", SIM_RIG, CaptureOptions(designed=False))
    capture_into(workspace, "friction-advance", SIM_RIG)
    fit_workspace(workspace, ("friction", "friction-advance"), FitOptions(effort="draft"))
    path = calibrated / "path.csv"
    path.write_text("x_mm\n10\n25\n")
    said = cli("control", *SIM, "--path", path, "--force", "2", "--json")
    assert said.code == 0, said.err
    result = said.envelope["result"]
    assert result["figures"]["force_rms_N"] < 0.12
    assert (result["figures"]["losses"], result["figures"]["let_goes"]) == (0, 0)
    tracked = result["tracked"]
    assert tracked["state"] in ("fused", "pictures")
    assert tracked["figures"]["contacts"]["used"] > 100
    assert tracked["figures"]["contacts"]["refused"] == 0
    assert tracked["figures"]["rig"]["jumps"] == 0
    (made,) = (one for one in recordings(calibrated) if one.name.startswith("control"))
    assert set(read_telemetry(made, POSE)["source"].tolist()) == {0, 1}
    assert "where it was tracked" in read_recording(made).notes[-1]
