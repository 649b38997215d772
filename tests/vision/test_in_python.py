"""Arrays in, corners, edge and pose out: against the rendered truth, and what bad input raises."""

import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.stats import chi2, norm

from scissorcal.calibration import fit_blade, fit_camera, fit_plate
from scissorcal.errors import InputError, MissingError, UnknownNameError, VerdictError
from scissorcal.recipe import PlatePriors
from scissorcal.vision.blade.photo import BladeLayout, measure_edge
from scissorcal.vision.geometry.board_pose import UndeterminedPoseError, locate_board
from scissorcal.vision.geometry.camera import Camera
from scissorcal.vision.geometry.pose import Pose, difference
from scissorcal.vision.geometry.rig_frame import card_view, locate_plate, locate_rig
from scissorcal.vision.photo import Photo
from scissorcal.vision.sim import (
    BladeShape,
    Lens,
    Looks,
    PlateScene,
    SimPose,
    as_jpeg,
    blade_layer,
    plate_scene,
    render,
    target_layers,
)
from scissorcal.vision.targets.boards import (
    BLADE_MAT,
    CAMERA_BOARD,
    MAT_PIVOT_M,
    PLATE_BOARD,
    PLATE_STRIP,
    TARGETS,
    MarkedBoard,
    as_board,
)
from scissorcal.vision.targets.detect import find_board, find_markers

Picture = NDArray[np.uint8]

PAGE = Path(__file__).parents[2] / "docs" / "vision.md"
LENS = Lens(900.0, (503.2, 371.9), 1000, 750, (-0.08, 0.03, 4e-4, -3e-4, 0.0))
CAMERA = Camera(900.0, 900.0, *LENS.centre_px, LENS.distortion, 1000, 750)
STRONG = (-0.2, 0.05, 8e-4, -5e-4, 0.0)
"""A distortion with which the sides of a marker bend by more than corners err."""
LOOKS = Looks(exposure=0.85, softness_px=0.6, noise=0.008)
SHAPE = BladeShape(back_slope=-float(np.tan(0.035)))
"""Its centreline is its x axis, so that ``edge_at`` is e(s) in the frame of a measurement."""
CHANCE = 1e-4
"""Of a false alarm, in each test that counts one."""


def picture_of(board: MarkedBoard, pose: SimPose, seed: int) -> Picture:
    return render(target_layers(board, pose), LENS, LOOKS, np.random.default_rng(seed))


def blade_picture(seed: int) -> Picture:
    rng = np.random.default_rng([seed, 1])
    azimuth, turn = rng.uniform(0.0, 6.28), rng.normal(0.0, 0.03)
    pose = SimPose.looking_at((0.126, 0.09), 0.275, tilt=0.1, azimuth=azimuth)
    blade = blade_layer(SHAPE, pose, MAT_PIVOT_M, turn)
    return render([*target_layers(BLADE_MAT, pose), blade], LENS, LOOKS, rng)


def card_picture(scene: PlateScene, advance_m: float, opening_rad: float, seed: int) -> Picture:
    """Picture of plate and card; both blades move."""
    layers = scene.layers(PLATE_BOARD, advance_m, 0.5 * opening_rad)
    return render(layers, LENS, LOOKS, np.random.default_rng(seed))


def grey_of(picture: Picture) -> Picture:
    return np.asarray(cv2.cvtColor(picture, cv2.COLOR_BGR2GRAY), dtype=np.uint8)


@pytest.fixture(scope="module")
def plate_picture() -> Picture:
    return picture_of(PLATE_BOARD, SimPose.looking_at((0.07, 0.05), 0.22, tilt=0.5), 0)


@pytest.fixture(scope="module")
def edge_picture() -> Picture:
    return blade_picture(0)


# ------------------------------------------------------------------------------------- truth


@pytest.mark.parametrize("target", TARGETS, ids=[target.name for target in TARGETS])
def test_corners_of_every_target_are_found_by_its_name(target: MarkedBoard) -> None:
    """To 0.06 px rms, as the page of photographs states."""
    middle = (0.5 * target.width_m, 0.5 * target.height_m)
    pose = SimPose.looking_at(middle, max(1.25 * target.width_m, 0.3), tilt=0.3, azimuth=1.0)
    picture = picture_of(target, pose, 3)
    seen = find_board(picture, target.name)
    assert seen.board == target
    assert len(seen.ids) == len(target.points)
    assert (seen.source, seen.width, seen.height) == ("The picture", 1000, 750)
    off = seen.pixels - LENS.sees(seen.points[:, :2], pose)
    assert np.sqrt(np.mean(off**2)) < 0.06
    again = find_board(Photo.from_array(grey_of(picture), "grey.png"), target)
    assert np.array_equal(again.pixels, seen.pixels)
    assert again.source == "grey.png"


def test_markers_are_found_in_colour_as_in_grey(plate_picture: Picture) -> None:
    found, grey = (
        find_markers(picture, "DICT_5X5_250") for picture in (plate_picture, grey_of(plate_picture))
    )
    assert set(found.ids) == set(PLATE_BOARD.ids)
    assert np.array_equal(found.corners, grey.corners)


def test_the_edge_is_within_its_own_intervals() -> None:
    """Each of 6 pictures alone, and three of them together."""
    photos = [measure_edge(blade_picture(seed), CAMERA) for seed in range(6)]
    edges = [photo.measured[0] for photo in photos]
    for edge in edges:
        off = edge.offset - SHAPE.edge_at(edge.station)
        assert np.mean(np.abs(off) < 2.0 * edge.total_sd) > 0.95
        assert np.median(np.abs(off)) < 3e-5
        assert edge.length == pytest.approx(SHAPE.length_m, abs=4e-4)
    fit = fit_blade(edges[:3], effort="draft", rng=np.random.default_rng(0))
    truth = SHAPE.edge_at(fit.station)
    assert np.mean((fit.offset.q05 < truth) & (truth < fit.offset.q95)) > 0.9
    assert np.mean((fit.taper.q05 < 0.035) & (fit.taper.q95 > 0.035)) > 0.8
    assert fit.height is None
    assert fit.metric


def test_an_edge_in_grey_and_without_a_camera(edge_picture: Picture) -> None:
    (edge,) = measure_edge(edge_picture, CAMERA).measured
    (grey,) = measure_edge(grey_of(edge_picture), CAMERA).measured
    assert np.array_equal(grey.offset, edge.offset)
    (alone,) = measure_edge(edge_picture).measured
    off = alone.offset - SHAPE.edge_at(alone.station)
    assert np.mean(np.abs(off) < 2.0 * alone.total_sd) > 0.95
    assert "No camera fit" in alone.uncertainty


@pytest.mark.parametrize(
    ("board", "bend", "print_sd_percent", "seed"),
    [
        (PLATE_BOARD, LENS.distortion, 0.1, 2029),
        (PLATE_STRIP, (0.0,) * 5, 0.1, 2029),
        (PLATE_STRIP, LENS.distortion, 0.0, 213_001),
        (PLATE_STRIP, STRONG, 0.1, 213_002),
    ],
    ids=[
        "plate board",
        "plate strip, no distortion",
        "plate strip, exact print",
        "plate strip, strong distortion",
    ],
)
def test_poses_are_within_their_own_intervals(
    board: MarkedBoard,
    bend: tuple[float, float, float, float, float],
    print_sd_percent: float,
    seed: int,
) -> None:
    """Sixteen views, six numbers each, printed off by the error that the priors have."""
    lens, camera = replace(LENS, distortion=bend), replace(CAMERA, distortion=bend)
    priors = PlatePriors(print_scale_sd_percent=print_sd_percent)
    rng = np.random.default_rng(seed)
    square = 0.0
    for view in range(16):
        tilt, azimuth = rng.uniform(0.2, 0.9), rng.uniform(0.0, 6.28)
        across, down = 1.0 + 0.01 * print_sd_percent * rng.standard_normal(2)
        middle = (0.5 * board.width_m, 0.5 * board.height_m)
        truth = SimPose.looking_at(middle, 1.4 * board.width_m, tilt=tilt, azimuth=azimuth)
        layers = target_layers(board, truth, print_scale=(across, down))
        picture = render(layers, lens, LOOKS, np.random.default_rng([seed, view]))
        pose = locate_board(find_board(picture, board.name), camera, priors).pose
        off = difference(pose, Pose.from_matrix(truth.rotation, truth.shift_m))
        assert pose.covariance is not None
        square += float(off @ np.linalg.solve(pose.covariance, off))
    assert square < chi2.isf(CHANCE, 16 * 6)


def test_a_camera_fitted_to_markers_knows_its_focal_length() -> None:
    lens = replace(LENS, distortion=STRONG)
    seen = []
    for view in range(10):
        azimuth = 0.2 * np.pi * view
        aside = (0.126 + 0.04 * np.cos(3.0 * azimuth), 0.09 + 0.03 * np.sin(azimuth))
        pose = SimPose.looking_at(aside, 0.3 + 0.02 * (view % 3), tilt=0.45, azimuth=azimuth)
        rng = np.random.default_rng([213_004, view])
        seen.append(find_board(render(target_layers(BLADE_MAT, pose), lens, LOOKS, rng), BLADE_MAT))
    camera = fit_camera(seen, rng=np.random.default_rng(0)).camera
    assert camera.covariance is not None
    sd_px = np.sqrt(camera.covariance[0, 0])
    assert abs(camera.fx - 900.0) < norm.isf(0.5 * CHANCE) * sd_px


def test_a_plate_in_the_rigs_frame_is_within_its_own_intervals() -> None:
    square = 0.0
    for seed in range(3):
        scene = plate_scene(np.random.default_rng([seed, 5]), (0.02, 0.01), 0.1)
        positions = [(a, o) for a in (0.0, 0.03) for o in (0.15, 0.6)]
        pictures = [card_picture(scene, *position, seed) for position in positions]
        views = [
            card_view(find_board(picture, "rig markers"), *position, moving_blades=2)
            for picture, position in zip(pictures, positions, strict=True)
        ]
        rig = locate_rig(views, CAMERA)
        assert rig.undetermined == ()
        plates = [find_board(picture, "plate board") for picture in pictures]
        lying = scene.plate_target
        target = Pose.from_matrix(lying.rotation, lying.shift_m)
        fit = fit_plate(plates, CAMERA, plate_target=target, rig=rig)
        assert fit.rig_plate is not None
        truth = Pose.from_matrix(scene.rig_plate.rotation, scene.rig_plate.shift_m)
        off = difference(fit.rig_plate, truth)
        assert fit.rig_plate.covariance is not None
        square += float(off @ np.linalg.solve(fit.rig_plate.covariance, off))
        assert np.linalg.norm(off[3:]) < 2e-3
    assert square < chi2.isf(CHANCE, 3 * 6)


def test_several_pictures_know_a_pose_better_than_one(plate_picture: Picture) -> None:
    pose = SimPose.looking_at((0.07, 0.05), 0.22, tilt=0.5)
    seen = [find_board(picture_of(PLATE_BOARD, pose, seed), "plate board") for seed in range(4)]
    one, four = (locate_board(some, CAMERA) for some in (seen[0], seen))
    assert np.trace(four.noise) < np.trace(one.noise)
    fit = fit_plate(seen, CAMERA)
    assert np.array_equal(fit.camera_plate.matrix, four.pose.matrix)
    plate = locate_plate(seen, CAMERA)
    assert np.array_equal(plate.pose.covariance, fit.camera_plate.covariance)  # type: ignore[arg-type]
    assert plate.odds == fit.odds > 20.0


# --------------------------------------------------------------------------------- bad input

BAD_PICTURES: dict[str, tuple[Callable[[Picture], Any], str]] = {
    "shares of white": (lambda p: p / 255.0, r"type float64, not uint8: where white is 1"),
    "16 bits": (lambda p: p.astype(np.uint16) * 257, r"type uint16.*>> 8"),
    "signed": (lambda p: p.astype(np.int64), r"type int64.*astype\(np.uint8\)"),
    "mask": (lambda p: p > 100, r"type bool.*255 \*"),
    "text": (lambda _: np.array([["a"]]), r"give an array of np.uint8"),
    "nothing read": (lambda _: None, r"cv2\.imread returns for a file that it cannot read"),
    "a file's name": (lambda _: "plate.jpg", r"plate\.jpg: read it with scissorcal.vision"),
    "a path": (lambda _: Path("plate.jpg"), r"read it with scissorcal\.vision\.read_photo"),
    "empty": (lambda p: p[:0], r"\(0, 1000, 3\), and so no pixel"),
    "no values": (lambda _: [], r"no pixel"),
    "transparent": (lambda p: np.dstack([p, p[:, :, 0]]), r"leave the transparency out"),
    "one channel": (lambda p: p[:, :, :1], r"give picture\[:, :, 0\]"),
    "channels first": (lambda p: np.moveaxis(p, 2, 0), r"np\.moveaxis\(picture, 0, 2\)"),
    "several": (lambda p: np.stack([p, p]), r"one by one"),
    "a row": (lambda p: p[0, :, 0], r"give one picture"),
}


@pytest.mark.parametrize("what", BAD_PICTURES)
def test_what_is_no_picture_is_refused_with_its_remedy(what: str, plate_picture: Picture) -> None:
    make, words = BAD_PICTURES[what]
    given = make(plate_picture)
    with pytest.raises(InputError, match=words):
        find_board(given, "plate board")
    with pytest.raises(InputError, match=words):
        find_markers(given, "DICT_5X5_250")
    with pytest.raises(InputError, match=words):
        measure_edge(given, CAMERA)


def test_views_of_an_array_are_taken_as_they_are(plate_picture: Picture) -> None:
    """Reversed channels, a part, another order in memory."""
    whole = find_board(plate_picture, "plate board")
    for same in (plate_picture[:, :, ::-1], np.asfortranarray(plate_picture)):
        assert np.abs(find_board(same, "plate board").pixels - whole.pixels).max() < 0.02
    part = find_board(plate_picture[:, 5:], "plate board")
    assert np.abs(part.pixels + np.array([5.0, 0.0]) - whole.pixels).max() < 0.02


def test_a_picture_without_the_board_names_what_it_shows(edge_picture: Picture) -> None:
    blank = np.full((750, 1000, 3), 120, np.uint8)
    for call in (lambda: find_board(blank, "plate board"), lambda: measure_edge(blank)):
        with pytest.raises(InputError, match="is of one shade: uncover the lens, and show"):
            call()
    with pytest.raises(InputError, match="shows the blade mat, not the plate board"):
        find_board(edge_picture, "plate board")
    mat = picture_of(BLADE_MAT, SimPose.looking_at((0.126, 0.09), 0.275, tilt=0.1), 0)
    with pytest.raises(InputError, match="nothing dark enough is on the sheet"):
        measure_edge(mat, CAMERA)


@pytest.mark.parametrize("name", ["plate bord", "Plate Board", "plate", ""])
def test_a_board_that_is_none_lists_those_that_are(name: str, plate_picture: Picture) -> None:
    with pytest.raises(UnknownNameError) as refused:
        find_board(plate_picture, name)
    assert all(target.name in str(refused.value) for target in TARGETS)
    assert "chessboard:COLUMNSxROWS" in str(refused.value)


def test_boards_by_words_and_of_another_library(plate_picture: Picture) -> None:
    assert as_board("charuco:7x5:20:14:DICT_6X6_250").columns == 7  # type: ignore[union-attr]
    with pytest.raises(InputError, match="is not a board: give chessboard:COLUMNS"):
        find_board(plate_picture, "chessboard:9by6")
    with pytest.raises(InputError, match=r"CharucoBoard is no board: give .* camera board"):
        find_board(plate_picture, PLATE_BOARD.as_opencv())
    with pytest.raises(UnknownNameError, match=r'Did you mean "DICT_5X5_250"\? There are: .*6X6'):
        find_markers(plate_picture, "DICT_5X5_25O")
    with pytest.raises(UnknownNameError, match="There are"):
        find_markers(plate_picture, "getPredefinedDictionary")


@pytest.mark.parametrize(
    ("layout", "words"),
    [
        (BladeLayout(edge_side="dwon"), r'no side of the mat. Did you mean "down"\?'),  # type: ignore[arg-type]
        (BladeLayout(mat=False), "blade alone is measured on the mat"),
        (BladeLayout(m_per_px=1e-4), "mat gives the scale"),
        (BladeLayout(both=True, mat=False, m_per_px=-1.0), "no size of a pixel"),
        (BladeLayout(both=True, mat=False, m_per_px=float("nan")), "no size of a pixel"),
        (BladeLayout(both=True, pivot_px=(3.0, 4.0)), "show their own pivot"),
    ],
)
def test_a_layout_at_odds_with_itself_is_refused(
    layout: BladeLayout, words: str, edge_picture: Picture
) -> None:
    with pytest.raises(InputError, match=words):
        measure_edge(edge_picture, CAMERA, layout)


def test_a_camera_of_another_size_is_refused_by_all(
    plate_picture: Picture, edge_picture: Picture
) -> None:
    other = replace(CAMERA, width=2000, height=1500)
    words = r"has 1000 x 750 pixels, and the camera was fitted at 2000 x 1500"
    seen = find_board(plate_picture, "plate board")
    view = card_view(seen, 0.0, 0.1, 1)
    calls: list[Callable[[], object]] = [
        lambda: measure_edge(edge_picture, other),
        lambda: locate_board(seen, other),
        lambda: fit_plate([seen], other),
        lambda: locate_rig([view, view._replace(advance_m=0.03)], other),
    ]
    for call in calls:
        with pytest.raises(InputError, match=words):
            call()
    half = np.asarray(cv2.resize(plate_picture, (500, 375), interpolation=cv2.INTER_AREA))
    small = locate_board(find_board(half, "plate board"), CAMERA.scaled(500, 375)).pose
    off = difference(small, locate_board(seen, CAMERA).pose)
    assert np.linalg.norm(off[3:]) < 1e-3


def test_detections_that_do_not_belong_together_are_refused(plate_picture: Picture) -> None:
    seen = find_board(Photo.from_array(plate_picture, "a.png"), "plate board")
    small = replace(seen, source="b.png", width=640, height=480)
    for call in (
        lambda: locate_board([seen, small], CAMERA),
        lambda: fit_plate([seen, small], CAMERA),
        lambda: fit_camera([seen, seen, small], rng=np.random.default_rng(0)),
    ):
        with pytest.raises(InputError, match=r"b\.png has 640 x 480 pixels, a\.png 1000 x 750"):
            call()
    strip = picture_of(PLATE_STRIP, SimPose.looking_at((0.11, 0.01), 0.3, tilt=0.4), 0)
    other = find_board(Photo.from_array(strip, "c.png"), "plate strip")
    with pytest.raises(InputError, match=r"c\.png shows the plate strip, a\.png the plate board"):
        locate_board([seen, other], CAMERA)
    with pytest.raises(MissingError, match="No picture of a target"):
        locate_board([], CAMERA)
    with pytest.raises(InputError, match="there is nothing to fit"):
        fit_blade([], rng=np.random.default_rng(0))
    with pytest.raises(UnknownNameError, match='Did you mean "draft"'):
        fit_blade([], effort="drafty", rng=np.random.default_rng(0))  # type: ignore[arg-type]


def test_a_picture_in_place_of_what_was_found_in_it_is_refused(
    plate_picture: Picture, edge_picture: Picture
) -> None:
    for call in (
        lambda: locate_board(plate_picture, CAMERA),  # type: ignore[arg-type]
        lambda: locate_plate([plate_picture], CAMERA),  # type: ignore[list-item]
        lambda: fit_camera([plate_picture] * 3, rng=np.random.default_rng(0)),  # type: ignore[list-item]
    ):
        with pytest.raises(InputError, match="ndarray is not what was found in a picture"):
            call()
    photo = measure_edge(edge_picture, CAMERA)
    with pytest.raises(InputError, match="BladePhoto is no measurement of one blade"):
        fit_blade([photo], rng=np.random.default_rng(0))  # type: ignore[list-item]


def test_corners_that_leave_a_pose_open_are_refused_by_name(plate_picture: Picture) -> None:
    seen = find_board(Photo.from_array(plate_picture, "thin.png"), "plate board")
    line = seen.points[:, 1] == seen.points[0, 1]
    thin = replace(seen, ids=seen.ids[line], pixels=seen.pixels[line])
    with pytest.raises(UndeterminedPoseError, match=r"thin\.png: .* along one line.*plate board"):
        locate_board(thin, CAMERA)
    with pytest.raises(VerdictError, match="same position in all pictures"):
        locate_rig([card_view(seen, 0.0, 0.1, 1)], CAMERA)


# ------------------------------------------------------------------------------------ the page


def test_the_code_of_the_page_runs(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """On rendered pictures, which the folder holds under the page's names."""
    section = PAGE.read_text(encoding="utf-8").partition("## In Python")[2].partition("\n## ")[0]
    blocks = re.findall(r"```python\n(.*?)```", section, re.DOTALL)
    assert len(blocks) == 4
    scene = plate_scene(np.random.default_rng(2))
    pictures: dict[str, Picture] = {}
    for number in range(8):
        way = 2.0 * np.pi * number / 8.0
        aside = (0.117 + 0.04 * np.cos(3.0 * way), 0.091 + 0.03 * np.sin(way))
        pose = SimPose.looking_at(aside, 0.3 + 0.02 * (number % 3), tilt=0.5, azimuth=way)
        pictures[f"board-{number}"] = picture_of(CAMERA_BOARD, pose, number)
    for number in range(2):
        pictures[f"blade-{number}"] = blade_picture(number)
        pictures[f"plate-{number}"] = card_picture(scene, 0.0, 0.15, number)
    for number, position in enumerate([(0.0, 0.15), (0.0, 0.6), (0.03, 0.15), (0.03, 0.6)]):
        pictures[f"rig-{number}"] = card_picture(scene, *position, 10 + number)
    for name, picture in pictures.items():
        (tmp_path / f"{name}.jpg").write_bytes(as_jpeg(picture, 95))
    monkeypatch.chdir(tmp_path)
    names: dict[str, Any] = {}
    for block in blocks:
        exec(block, names)
    camera, edge, rig = names["camera"], names["edge"], names["rig"]
    off = np.array([camera.fx - 900.0, camera.cx - LENS.centre_px[0]])
    assert np.all(np.abs(off) < 5.0 * np.sqrt(np.diag(camera.covariance)[[0, 2]]))
    assert edge.family == "line"
    assert rig.undetermined == ()
    target = Pose.from_matrix(scene.plate_target.rotation, scene.plate_target.shift_m)
    plate = names["fit_plate"](names["plates"], camera, plate_target=target, rig=rig).rig_plate
    assert np.allclose(plate.translation_m, scene.rig_plate.shift_m, atol=2e-3)
    printed = capsys.readouterr().out.splitlines()
    assert printed[:3] == ["(48, 2) (48, 3)", "(203,) (203,) (203,)", "line (41,) (41,)"]
    assert printed[-3].endswith(" True")
    assert printed[-2] == "[]", "no verdict fails"
