"""Photographs of the plate and of the rig's card, and the plate's fit."""

from pathlib import Path

import cv2
import numpy as np
import pytest

from scissorcal import open_fit
from scissorcal.calibration import PlateFit, fit_plate, plate_target
from scissorcal.recipe import Recipe
from scissorcal.vision import (
    Detection,
    Pose,
    SimPose,
    card_view,
    difference,
    find_board,
    locate_plate,
    locate_rig,
    read_camera_file,
    read_photo,
    sim_plate_scene,
)
from tests.cli.conftest import Cli


def plates(album: Path) -> list[Path]:
    return sorted(album.glob("plate-*.jpg"))


def cards(album: Path) -> list[Path]:
    return sorted(album.glob("rig-*.jpg"))


def captured(workspace: Path) -> list[str]:
    return sorted(path.name for path in (workspace / "captures").glob("*"))


def off(pose: dict[str, list[float]], truth: SimPose) -> tuple[float, float]:
    """Degrees and millimetres by which a printed pose is off."""
    found = Pose(tuple(pose["quaternion"]), tuple(pose["translation_m"]))  # type: ignore[arg-type]
    away = difference(found, Pose.from_matrix(truth.rotation, truth.shift_m))
    return float(np.degrees(np.linalg.norm(away[:3]))), float(1e3 * np.linalg.norm(away[3:]))


def test_a_plate_is_captured_fitted_and_known_in_the_rigs_frame(
    cli: Cli, workspace: Path, album: Path, recipe: Recipe
) -> None:
    assert cli("import", album / "camera.yml").code == 0
    said = cli("capture", "plate", "-i", *plates(album))
    assert said.code == 0
    assert "3 photographs of the plate board" in said.out
    assert "plate-01.jpg: 24 of 24 corners of the plate board" in said.err

    said = cli("fit", "plate", "--json")
    envelope = said.envelope
    assert said.code == 0
    truth = sim_plate_scene(recipe, 0)
    degrees, millimetres = off(envelope["result"]["camera_plate"], truth.camera_plate)
    assert degrees < 0.1
    assert millimetres < 0.3
    assert envelope["result"]["rig_plate"] is None
    assert len(envelope["result"]["pictures"]) == 3
    assert all(Path(path).is_file() for path in envelope["files"])
    angles = envelope["result"]["camera_plate"]["euler_angles"]
    turn = [angles[f"{name}_deg"] for name in ("yaw", "pitch", "roll")]
    printed = cli("fit", "plate").out
    assert printed.startswith("plate: nothing changed")
    camera = next(line for line in printed.splitlines() if line.startswith("camera"))
    assert camera.split()[4:7] == [f"{value:.2f}" for value in turn]
    assert "quaternion, camera: w 0." in printed
    assert "yaw, pitch, roll: intrinsic z-y'-x''" in printed

    said = cli("capture", "plate", "-i", *cards(album), "--positions", album / "positions.csv")
    assert said.code == 0
    assert "9 photographs of the rig markers" in said.out
    envelope = cli("fit", "plate", "--json").envelope
    assert not envelope["result"]["cached"]
    degrees, millimetres = off(envelope["result"]["rig_plate"], truth.rig_plate)
    assert degrees < 0.3
    assert millimetres < 0.6
    known = np.array(envelope["result"]["rig_plate"]["covariance"])
    assert np.degrees(np.sqrt(np.diag(known)[:3].max())) < 0.5
    assert {v["status"] for v in envelope["verdicts"]} == {"pass", "not_evaluated"}
    assert_arrays_give_the_fit(workspace, album, recipe)


def assert_arrays_give_the_fit(workspace: Path, album: Path, recipe: Recipe) -> None:
    """The same pixels, detected and fitted without files: the same numbers to the last bit."""

    def detected(path: Path, board: str) -> Detection:
        return find_board(read_photo(path, colour=False).image, board)

    camera = read_camera_file(album / "camera.yml").camera
    views = []
    for line in (album / "positions.csv").read_text().splitlines()[1:]:
        name, advance_mm, opening_deg = line.split(",")
        position = 1e-3 * float(advance_mm), float(np.radians(float(opening_deg)))
        card = detected(album / name, "rig markers")
        views.append(card_view(card, *position, recipe.rig.moving_blades))
    priors = recipe.fit.plate.priors
    rig = locate_rig(views, camera, priors=priors)
    seen = [detected(path, "plate board") for path in plates(album)]
    fit = fit_plate(seen, camera, priors=priors, plate_target=plate_target(recipe), rig=rig)
    stored = open_fit(workspace / "fits" / "plate.nc")
    assert isinstance(stored, PlateFit)
    for pose, of_file in (
        (fit.camera_plate, stored.camera_plate),
        (fit.rig_plate, stored.rig_plate),
    ):
        assert pose is not None
        assert of_file is not None
        assert pose.quaternion == of_file.quaternion
        assert pose.translation_m == of_file.translation_m
        assert np.array_equal(pose.covariance, of_file.covariance)  # type: ignore[arg-type]
    assert [v.status for v in fit.verdicts] == [v.status for v in stored.verdicts]
    plate = locate_plate(seen, camera, plate_target(recipe), rig, priors)
    assert plate.pose.quaternion == stored.rig_plate.quaternion  # type: ignore[union-attr]
    assert plate.odds == stored.odds


def test_nothing_is_kept_of_what_is_wrong(
    cli: Cli, workspace: Path, album: Path, tmp_path: Path
) -> None:
    said = cli("capture", "plate", "-i", cards(album)[0], "-i", album / "positions.csv", "--json")
    assert said.code == 0, "the card's photographs show the plate's target too"
    empty = tmp_path / "nothing.jpg"
    cv2.imwrite(str(empty), np.full((600, 800, 3), 120, np.uint8))
    before = captured(workspace)
    for words in (
        ["-i", empty],
        ["-i", album / "positions.csv"],
        ["-i", tmp_path / "no-such.jpg"],
        ["-i", cards(album)[0]],
    ):
        said = cli("capture", "plate", *words, "--json")
        assert said.code == 2, words
        assert "Nothing was kept." in said.envelope["result"]["error"]
        assert captured(workspace) == before


def test_positions_are_checked_line_by_line(
    cli: Cli, workspace: Path, album: Path, tmp_path: Path
) -> None:
    table = tmp_path / "positions.csv"
    for text, words in (
        ("file,advance_mm\nrig-01.jpg,3\n", "needs a first line"),
        ("file,advance_mm,opening_deg\nrig-01.jpg,3,wide\n", "line 2"),
        ("file,advance_mm,opening_deg\nother.jpg,3,20\n", "has no position: add a line"),
    ):
        table.write_text(text)
        said = cli("capture", "plate", "-i", cards(album)[0], "--positions", table)
        assert said.code == 2
        assert words in said.err
    assert captured(workspace) == []
    said = cli("capture", "plate", "-i", cards(album)[0], "--positions", tmp_path / "none.csv")
    assert said.code == 2
    assert "none.csv does not exist" in said.err


def test_a_rig_that_stood_still_is_refused(cli: Cli, workspace: Path, album: Path) -> None:
    cli("import", album / "camera.yml")
    assert cli("capture", "plate", "-i", *plates(album)).code == 0
    one = cards(album)[0]
    assert cli("capture", "plate", "-i", one, "--positions", album / "positions.csv").code == 0
    said = cli("fit", "plate", "--json")
    assert said.code == 3
    assert "The rig has the same position in all pictures" in said.envelope["result"]["error"]
    assert not (workspace / "fits" / "plate.nc").exists()


def test_what_must_come_first_is_said(cli: Cli, workspace: Path, album: Path) -> None:
    said = cli("fit", "plate", "--json")
    assert said.code == 5
    assert "scissorcal capture plate" in said.envelope["result"]["error"]
    assert cli("track", "--camera", "sim").code == 5
    cli("import", album / "camera.yml")
    said = cli("fit", "plate")
    assert said.code == 5
    assert "Nothing to fit (capture plate: " in said.err


def test_photographs_of_another_size_are_refused(
    cli: Cli, workspace: Path, album: Path, tmp_path: Path
) -> None:
    cli("import", album / "camera.yml")
    half = tmp_path / "half.png"
    cv2.imwrite(str(half), cv2.resize(cv2.imread(str(plates(album)[0])), (1000, 750)))
    assert cli("capture", "plate", "-i", half).code == 0
    said = cli("fit", "plate")
    assert said.code == 2
    assert "has 1000 x 750 pixels, and the camera was fitted at 2000 x 1500" in said.err


def test_photographs_are_taken_from_a_video(
    cli: Cli, workspace: Path, album: Path, tmp_path: Path
) -> None:
    still = tmp_path / "still.avi"
    writer = cv2.VideoWriter(str(still), cv2.VideoWriter.fourcc(*"MJPG"), 10.0, (2000, 1500))
    pictures = [cv2.imread(str(path)) for path in plates(album)]
    for number in range(9):
        writer.write(pictures[number % 3])
    writer.release()
    said = cli("capture", "plate", "--camera", still, "--views", "2")
    assert said.code == 0, said.err
    assert "2 photographs of the plate board" in said.out


@pytest.mark.parametrize("words", [("capture", "plate"), ("track",)])
def test_no_such_camera_or_video(
    cli: Cli, workspace: Path, album: Path, words: tuple[str, ...], tmp_path: Path
) -> None:
    cli("import", album / "camera.yml")
    said = cli(*words, "--camera", "97", "--json")
    assert said.code == 4
    assert "Camera 97 gives no picture" in said.envelope["result"]["error"]
    said = cli(*words, "--camera", "gone.mp4")
    assert said.code == 2
    assert "gone.mp4 does not exist" in said.err
    said = cli(*words, "--camera", album / "positions.csv")
    assert said.code == 2
    assert "positions.csv is text, not a video" in said.err
    assert captured(workspace) == []


def test_contradictions_are_refused(cli: Cli, workspace: Path, album: Path) -> None:
    assert cli("capture", "plate").code == 2
    assert cli("capture", "plate", "-i", "a.jpg", "--camera", "0").code == 2
    said = cli("capture", "plate", "--camera", "0", "--positions", album / "positions.csv")
    assert said.code == 2
    assert "The rig's positions are not known" in said.err
