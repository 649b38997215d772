"""The plate's pose from rendered photographs, and from real ones of a board of others."""

import dataclasses
from pathlib import Path

import numpy as np
import pytest

from scissorcal.calibration.plate.fit import fit_plate
from scissorcal.calibration.plate.result import PlateFit
from scissorcal.errors import InputError, MissingError, VerdictError
from scissorcal.vision import (
    BLADE_MAT,
    PLATE_BOARD,
    PLATE_STRIP,
    Camera,
    CharucoBoard,
    Detection,
    Lens,
    Looks,
    MarkedBoard,
    MarkerBoard,
    Pose,
    SimPose,
    difference,
    find_board,
    find_markers,
    locate_rig,
    read_camera_file,
    read_photo,
    render,
    target_layers,
)
from tests.vision.geometry.test_pose import CAMERA as CARD_CAMERA
from tests.vision.geometry.test_pose import MIDDLE, card_views
from tests.vision.scenes import lens, photo_of, pose_before

LENS = lens()
CAMERA = Camera(LENS.focal_px, LENS.focal_px, *LENS.centre_px, LENS.distortion, 1280, 720)
KNOWN = np.array([0.3, 0.3, 0.3, 0.3, 1e-3, 3e-3, 1e-4, 1e-4, 1e-3])
SURE = dataclasses.replace(CAMERA, covariance=np.diag(KNOWN**2))
REAL = Path(__file__).parents[4] / "shared" / "data" / "aruco"


def shot(
    board: MarkedBoard, pose: SimPose, seed: int = 0, ids: list[int] | None = None, eye: Lens = LENS
) -> Detection:
    """Photograph a target and find it."""
    layers = target_layers(board, pose, ids=ids)
    looks = Looks(softness_px=0.7, noise=0.01, defocus_px=0.5)
    picture = render(layers, eye, looks, np.random.default_rng(seed))
    name = f"plate-{seed}.jpg"
    return find_board(photo_of(picture, name), board)


def away(fit: PlateFit, truth: SimPose) -> tuple[float, float, np.ndarray]:
    """Degrees and millimetres off, and both in standard deviations."""
    known = Pose.from_matrix(truth.rotation, truth.shift_m)
    off = difference(fit.camera_plate, known)
    assert fit.camera_plate.covariance is not None
    z = off / np.sqrt(np.diag(fit.camera_plate.covariance))
    degrees = float(np.degrees(np.linalg.norm(off[:3])))
    return degrees, float(1e3 * np.linalg.norm(off[3:])), z


def verdict(fit: PlateFit, check: str) -> str:
    (found,) = (v for v in fit.verdicts if v.check == check)
    return found.status


@pytest.fixture(scope="module")
def still() -> tuple[SimPose, list[Detection]]:
    pose = pose_before(PLATE_BOARD, 0.3, tilt=0.6, azimuth=1.0, turn=0.2)
    return pose, [shot(PLATE_BOARD, pose, seed) for seed in range(4)]


@pytest.mark.parametrize("board", [PLATE_BOARD, PLATE_STRIP], ids=lambda board: board.name)
@pytest.mark.parametrize("tilt", [0.0, 0.5, 1.1])
def test_the_pose_is_recovered(board: MarkedBoard, tilt: float) -> None:
    """The print is exact and the camera known: errors far below what a printer's 0.1 % allows."""
    truth = pose_before(board, 0.33, tilt=tilt, azimuth=2.0, turn=-0.3)
    fit = fit_plate([shot(board, truth, seed) for seed in range(2)], SURE)
    degrees, millimetres, z = away(fit, truth)
    assert degrees < 0.1
    assert millimetres < 0.15
    assert np.abs(z).max() < 3.5
    assert fit.target == board.name
    assert {v.status for v in fit.verdicts if v.check != "rig frame"} == {"pass"}
    assert verdict(fit, "rig frame") == "not_evaluated"


def test_the_targets_place_on_the_plate_is_removed(
    still: tuple[SimPose, list[Detection]],
) -> None:
    truth, photos = still
    target = Pose.from_rotation_vector([np.pi, 0.0, 0.0], [0.04, -0.02, 0.0])
    fit = fit_plate(photos, SURE, plate_target=target)
    seen = fit.camera_plate.after(target)
    assert np.allclose(seen.matrix, truth.rotation, atol=2e-3)
    assert np.allclose(seen.translation_m, truth.shift_m, atol=3e-4)
    assert fit.camera_plate.matrix[2, 2] < 0, "the plate's upper face looks at the camera"


def test_a_moved_plate_is_detected_and_named(still: tuple[SimPose, list[Detection]]) -> None:
    """Moved a little (its corners still count), and far (they are left out)."""
    truth, photos = still
    for moved_m in (3e-4, 5e-3):
        moved = SimPose(truth.rotation, truth.shift_m + np.array([moved_m, 0.0, 0.0]))
        fit = fit_plate([*photos, shot(PLATE_BOARD, moved, 9)], SURE)
        (found,) = (v for v in fit.verdicts if v.check == "at rest")
        assert found.status == "fail"
        assert found.why.startswith("plate-9.jpg shows the plate")
        assert found.value is not None
        assert np.isfinite(found.value)
    assert verdict(fit_plate(photos, SURE), "at rest") == "pass"


def test_one_photograph_leaves_motion_not_evaluated(
    still: tuple[SimPose, list[Detection]],
) -> None:
    truth, photos = still
    fit = fit_plate(photos[:1], SURE)
    assert verdict(fit, "at rest") == "not_evaluated"
    assert away(fit, truth)[0] < 0.1


def test_one_small_marker_square_on_is_ambiguous() -> None:
    truth = pose_before(PLATE_STRIP, 1.1, tilt=0.03)
    ids = [PLATE_STRIP.ids[2]]
    fit = fit_plate([shot(PLATE_STRIP, truth, 1, ids)], SURE)
    assert fit.other is not None
    assert fit.odds < 20
    assert verdict(fit, "ambiguity") == "fail"
    assert verdict(fit, "halves") == "not_evaluated"
    assert verdict(fit, "size") == "fail"


def test_a_wrong_camera_fails_the_checks(still: tuple[SimPose, list[Detection]]) -> None:
    """Grossly: corners do not fit. Slightly: both sides of the target claim other poses."""
    _, photos = still
    fit = fit_plate(photos, SURE)
    assert verdict(fit, "halves") == verdict(fit, "residuals") == "pass"
    gross = dataclasses.replace(SURE, distortion=(0.3, -0.2, 0.01, 0.0, 0.0))
    assert verdict(fit_plate(photos, gross), "residuals") == "fail"
    slight = dataclasses.replace(SURE, distortion=(-0.12, 0.05, 0.004, 0.0, 0.0))
    assert verdict(fit_plate(photos, slight), "halves") == "fail"


def test_without_a_photograph_or_with_two_targets_there_is_no_fit(
    still: tuple[SimPose, list[Detection]],
) -> None:
    with pytest.raises(MissingError, match="capture plate"):
        fit_plate([], SURE)
    pose = pose_before(PLATE_STRIP, 0.33, tilt=0.4)
    with pytest.raises(InputError, match="that of one target"):
        fit_plate([still[1][0], shot(PLATE_STRIP, pose)], SURE)


def test_corners_along_one_line_are_refused_by_name(still: tuple[SimPose, list[Detection]]) -> None:
    seen = still[1][0]
    line = seen.points[:, 1] == seen.points[0, 1]
    thin = dataclasses.replace(
        seen, ids=seen.ids[line], pixels=seen.pixels[line], source="thin.jpg"
    )
    with pytest.raises(VerdictError, match=r"thin\.jpg: .* along one line"):
        fit_plate([still[1][1], thin], SURE)


def test_another_target_is_named() -> None:
    pose = pose_before(BLADE_MAT, 0.4, tilt=0.3)
    picture = render(
        target_layers(BLADE_MAT, pose), LENS, Looks(noise=0.01), np.random.default_rng(0)
    )
    with pytest.raises(InputError, match="shows the blade mat, not the plate board"):
        find_board(photo_of(picture), PLATE_BOARD)


def test_a_slanted_marker_is_measured_within_its_own_border() -> None:
    """Across it a foreshortened border is narrow: looking farther takes its cells for it."""
    board = MarkerBoard("one", 0.028, 0.028, 0.028, ((0.014, 0.014),), first_id=82)
    pose = pose_before(board, 0.25, tilt=1.1)
    seen = shot(board, pose)
    exact = LENS.sees(seen.points[:, :2], pose)
    assert np.abs(seen.pixels - exact).max() < 0.1


REAL_BOARD = CharucoBoard("real board", 5, 7, 0.04, 0.02, 0, "DICT_6X6_250")


def real(name: str) -> Path:
    if not REAL.is_dir():
        pytest.skip(f"{REAL} is not there")
    return REAL / name


@pytest.mark.parametrize("name", ["img_00.jpg", "img_02.jpg"])
def test_a_real_board_agrees_between_halves_of_its_corners(name: str) -> None:
    """Alternate fours of corners: 0.08 deg and 0.21 mm, 0.18 deg and 0.30 mm apart; left and right:
    0.13 deg and 0.46 mm, 0.23 deg and 0.71 mm. The worse one, by what it claims, is kept."""
    camera = read_camera_file(real("tutorial_camera_charuco.yml")).camera
    photo = read_photo(real(name), colour=False)
    assert set(find_markers(photo.grey, REAL_BOARD.dictionary, REAL_BOARD).ids) == set(range(17))
    found = find_board(photo, REAL_BOARD)
    assert len(found.ids) == 24
    fit = fit_plate([found], camera)
    assert fit.halves is not None
    assert fit.halves.rotation_deg < 0.3
    assert fit.halves.translation_mm < 1.0
    assert verdict(fit, "halves") == "pass"
    assert verdict(fit, "ambiguity") == "pass"
    assert fit.rms_px < 0.3


def test_every_real_marker_is_found() -> None:
    photo = read_photo(real("singlemarkersoriginal.jpg"), colour=False)
    found = find_markers(photo.grey, "DICT_6X6_250")
    assert sorted(found.ids) == [23, 40, 62, 98, 124, 203]
    assert found.sharp.all()
    with pytest.raises(InputError, match=r"plate board|markers of DICT_6X6_250"):
        find_board(photo, PLATE_BOARD)


def test_positions_that_do_not_fit_the_card_fail(still: tuple[SimPose, list[Detection]]) -> None:
    """The blade turned by half of what was said."""
    _, seen = card_views(
        [(a, b) for a in (0.0, 0.03) for b in (0.1, 0.3)], np.random.default_rng(1)
    )
    doubled = tuple(view._replace(blade_angle_rad=2.0 * view.blade_angle_rad) for view in seen)
    honest, wrong = (locate_rig(views, CARD_CAMERA, MIDDLE) for views in (seen, doubled))
    assert verdict(fit_plate(still[1], SURE, rig=honest), "rig frame") == "pass"
    assert verdict(fit_plate(still[1], SURE, rig=wrong), "rig frame") == "fail"
