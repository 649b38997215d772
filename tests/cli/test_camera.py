"""Targets, photographs of a board, the camera's fit and its files, on the command line."""

import json
import shutil
import sys
from pathlib import Path

import cv2
import numpy as np
import pytest
from PIL import Image

from scissorcal import open_fit
from scissorcal.calibration import CameraFit, fit_camera
from scissorcal.vision import (
    BLADE_MAT,
    CAMERA_BOARD,
    Lens,
    Looks,
    SimPose,
    as_jpeg,
    find_board,
    read_photo,
    render,
    target_layers,
)
from tests.cli.conftest import Cli

STREAM = 2
"""Of the camera's fit, beside the seed."""
EYE = Lens(620.0, (324.0, 236.0), 640, 480, (-0.1, 0.02, 0.0, 0.0, 0.0))
LOOKS = Looks(softness_px=0.6, noise=0.008)
SLANTS = [(0.0, 0.0), (0.6, 0.0), (0.6, 1.6), (0.6, 3.1), (0.6, 4.7), (0.4, 0.8), (0.5, 2.4)]


def rendered(pose: SimPose, board: object = CAMERA_BOARD, seed: int = 0) -> np.ndarray:
    return render(target_layers(board, pose), EYE, LOOKS, np.random.default_rng(seed))  # type: ignore[arg-type]


def looking(tilt: float, azimuth: float, number: int, distance_m: float = 0.32) -> SimPose:
    aside = (0.117 + 0.04 * ((number % 3) - 1), 0.091 + 0.03 * ((number % 2) - 0.5))
    return SimPose.looking_at(aside, distance_m, tilt=tilt, azimuth=azimuth, turn=0.1 * number)


@pytest.fixture(scope="module")
def album(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Seven photographs of the camera board, four of it square-on, one of the mat, one blank."""
    folder = tmp_path_factory.mktemp("album")
    pictures = {
        f"board-{number}.jpg": rendered(looking(*slant, number), seed=number)
        for number, slant in enumerate(SLANTS)
    }
    for number in range(4):
        pictures[f"flat-{number}.jpg"] = rendered(
            looking(0.0, 0.0, number, 0.3 + 0.02 * number), seed=number
        )
    pictures["mat.jpg"] = rendered(SimPose.looking_at((0.128, 0.089), 0.4), BLADE_MAT)
    pictures["nothing.jpg"] = np.full((480, 640, 3), 120, np.uint8)
    for name, picture in pictures.items():
        (folder / name).write_bytes(as_jpeg(picture, 92))
    return folder


def boards(album: Path) -> list[Path]:
    return sorted(album.glob("board-*.jpg"))


def left_in(workspace: Path) -> list[str]:
    """Files of a workspace, but for the index and the lock, which hold no result."""
    names = (path.relative_to(workspace) for path in workspace.rglob("*") if path.is_file())
    return sorted(str(name) for name in names if name.parts[0] != ".scissorcal")


def test_targets_are_written_and_named(cli: Cli, tmp_path: Path) -> None:
    said = cli("target", "--output", tmp_path / "print", "--paper", "Letter")
    assert said.code == 0
    assert "Print at 100 %" in said.out
    assert len(list((tmp_path / "print").glob("target-*-Letter.pdf"))) == 3
    (tmp_path / "file").write_text("")
    said = cli("target", "blade", "--output", tmp_path / "file" / "below", "--json")
    assert said.code == 2
    assert not said.envelope["ok"]


def test_a_camera_from_photographs_to_files(cli: Cli, workspace: Path, album: Path) -> None:
    said = cli("capture", "camera", "--image", *boards(album), album / "mat.jpg")
    assert said.code == 0
    assert "7 photographs of the camera board, 1 left out" in said.out
    assert "mat.jpg shows the blade mat, not the camera board" in said.err
    assert "places" in said.err
    (folder,) = (workspace / "captures").iterdir()
    index = json.loads((folder / "capture.json").read_text())
    assert index["format"] == "scissorcal-photographs/1"
    stored = folder / index["photographs"][0]["file"]
    assert stored.read_bytes() == boards(album)[0].read_bytes()
    assert len(list(folder.glob("*-detected.png"))) == 7

    said = cli("fit", "camera", "--json")
    result = said.envelope["result"]
    camera = result["camera"]
    sd = np.sqrt(camera["covariance"][0][0])
    assert abs(camera["fx"] - 620.0) < 4.0 * sd < 20.0
    assert said.code == (3 if any(v["status"] == "fail" for v in said.envelope["verdicts"]) else 0)
    assert [Path(file).suffix for file in said.envelope["files"]] == [".nc"] + [".png"] * 5
    assert all(Path(file).is_file() for file in said.envelope["files"])
    assert_arrays_give_the_fit(workspace, album)

    again = cli("fit", "camera")
    assert "nothing changed since the last fit" in again.out
    assert again.code == said.code

    for name, style in (("a.yml", "opencv"), ("a.yaml", "ros")):
        assert cli("export", "fits/camera.nc", name, "--style", style).code == 0
        assert cli("export", "fits/camera.nc", name, "--style", style).code == 2
    before = (workspace / "fits" / "camera.nc").read_bytes()
    assert cli("import", "a.yaml").code == 2
    assert (workspace / "fits" / "camera.nc").read_bytes() == before

    # A photograph more, and the fit is done anew; the same one again is left out.
    assert cli("capture", "camera", "-i", album / "flat-0.jpg").code == 0
    said = cli("capture", "camera", "-i", album / "flat-0.jpg")
    assert said.code == 2
    assert "was taken in before" in said.err
    said = cli("fit", "camera")
    assert "8 photographs" in said.out
    assert len(list((workspace / "fits" / "camera").glob("*.png"))) == 5


def assert_arrays_give_the_fit(workspace: Path, album: Path) -> None:
    """The same pixels, detected and fitted without files: the same numbers to the last bit."""
    pictures = [read_photo(path, colour=False).image for path in boards(album)]
    seen = [find_board(picture, "camera board") for picture in pictures]
    fit = fit_camera(seen, rng=np.random.default_rng([0, STREAM]))
    stored = open_fit(workspace / "fits" / "camera.nc")
    assert isinstance(stored, CameraFit)
    assert np.array_equal(fit.camera.parameters, stored.camera.parameters)
    assert np.array_equal(fit.draws, stored.draws)
    assert [v.status for v in fit.verdicts] == [v.status for v in stored.verdicts]


def test_a_camera_is_fitted_without_matplotlib(
    cli: Cli, workspace: Path, album: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    assert cli("capture", "camera", "--image", *boards(album)).code == 0
    said = cli("fit", "camera")
    assert said.code in (0, 3)
    (note,) = (line for line in said.out.splitlines() if "matplotlib" in line)
    assert note.startswith("residuals.png and uncertainty.png were not drawn")
    assert note.endswith("pip install 'scissorcal[plots]', then 'scissorcal fit camera --force'.")
    drawn = sorted(path.name for path in (workspace / "fits" / "camera").iterdir())
    assert [name[:8] for name in drawn] == ["worst-1-", "worst-2-", "worst-3-"]
    monkeypatch.undo()
    monkeypatch.chdir(workspace)
    said = cli("fit", "camera", "--force", "--json")
    assert not [note for note in said.envelope["result"]["notes"] if "matplotlib" in note]
    assert len(list((workspace / "fits" / "camera").iterdir())) == 5


def test_a_camera_file_becomes_the_workspaces_camera(cli: Cli, workspace: Path) -> None:
    (workspace / "kalibr.yaml").write_text(
        "cam0:\n  camera_model: pinhole\n  intrinsics: [461.6, 460.3, 362.7, 248.1]\n"
        "  distortion_model: radtan\n  distortion_coeffs: [-0.27, 0.06, 0.0009, 0.00003]\n"
        "  resolution: [752, 480]\n"
    )
    said = cli("import", "kalibr.yaml", "--json")
    assert said.code == 0
    assert said.envelope["result"]["style"] == "Kalibr"
    assert said.envelope["verdicts"][0]["status"] == "not_evaluated"
    assert "Imported from kalibr.yaml" in cli("fit", "camera").out


def test_a_camera_file_of_ones_own_is_imported_with_the_model_that_was_taken(
    cli: Cli, workspace: Path
) -> None:
    own = {"K": [[461.6, 0, 362.7], [0, 460.3, 248.1], [0, 0, 1]], "image_size": [752, 480]}
    (workspace / "own.json").write_text(json.dumps(own | {"dist": [[-0.27, 0.06, 0.0, 0.0, 0.0]]}))
    said = cli("import", "own.json")
    assert said.code == 0
    assert "note: The file names no distortion model; its coefficients were taken as" in said.out
    (workspace / "cameras.txt").write_text("1 OPENCV 640 480 500 500 320 240 0 0 0 0\n")
    said = cli("import", "cameras.txt")
    assert said.code == 2
    assert "COLMAP" in said.err


@pytest.mark.parametrize(
    ("names", "words", "code"),
    [
        (["nothing.jpg"], "nothing.jpg is of one shade", 2),
        (["mat.jpg"], "shows the blade mat, not the camera board", 2),
        (["none.jpg"], "does not exist", 2),
    ],
)
def test_nothing_is_kept_where_nothing_can_be_used(
    cli: Cli, workspace: Path, album: Path, names: list[str], words: str, code: int
) -> None:
    before = left_in(workspace)
    said = cli("capture", "camera", "--image", *(album / name for name in names))
    assert said.code == code
    assert words in said.err
    assert "Nothing was kept" in said.err
    assert left_in(workspace) == before


@pytest.mark.parametrize(
    ("pattern", "words", "code"),
    [
        ("board-0.jpg", "One photograph alone", 5),
        ("flat-*.jpg", "focal length is not determined", 3),
        (None, "Nothing to fit", 5),
    ],
)
def test_a_fit_that_cannot_be_is_refused_and_writes_nothing(
    cli: Cli, workspace: Path, album: Path, pattern: str | None, words: str, code: int
) -> None:
    if pattern:
        assert cli("capture", "camera", "-i", *sorted(album.glob(pattern))).code == 0
    before = left_in(workspace)
    said = cli("fit", "camera")
    assert said.code == code
    assert words in said.err
    assert left_in(workspace) == before


def test_photographs_of_other_sizes_turns_and_boards_are_left_out(
    cli: Cli, workspace: Path, album: Path, tmp_path: Path
) -> None:
    first = boards(album)[0]
    small = tmp_path / "small.png"
    turned = tmp_path / "turned.jpg"
    with Image.open(boards(album)[1]) as opened:
        opened.resize((480, 360)).save(small)
        exif = Image.Exif()
        exif[0x0112] = 3
        opened.save(turned, exif=exif, quality=92)
    copy = tmp_path / "copy.jpg"
    shutil.copy(first, copy)
    said = cli("capture", "camera", "-i", first, small, turned, copy)
    assert said.code == 0
    assert "480 x 360" in said.err
    assert "has the EXIF orientation 3" in said.err
    assert "given twice" in said.err
    said = cli("capture", "camera", "--board", "chessboard:9x6:25", "-i", boards(album)[2])
    assert said.code == 2
    assert "one fit uses one board" in said.err


def test_pictures_are_picked_from_a_video(
    cli: Cli, workspace: Path, album: Path, tmp_path: Path
) -> None:
    video = tmp_path / "board.avi"
    writer = cv2.VideoWriter(str(video), cv2.VideoWriter.fourcc(*"MJPG"), 10.0, (640, 480))
    for path in boards(album)[:3]:
        for _ in range(3):
            writer.write(cv2.imread(str(path)))
    writer.release()
    said = cli("capture", "camera", "--camera", video)
    assert said.code == 0
    assert "3 photographs" in said.out
    assert cli("capture", "camera", "--camera", tmp_path / "none.avi").code == 2
    assert cli("capture", "camera").code == 2


def test_a_damaged_index_says_what_to_remove(cli: Cli, workspace: Path, album: Path) -> None:
    assert cli("capture", "camera", "-i", *boards(album)[:2]).code == 0
    (index,) = (workspace / "captures").glob("*/capture.json")
    index.write_text(index.read_text()[:300])
    said = cli("fit", "camera")
    assert said.code == 2
    assert "capture its photographs again" in said.err
