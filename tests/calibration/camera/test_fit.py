"""The camera's fit: exact where nothing is wrong, honest where something is, refused where it must.

Corners are placed by the renderer's own lens, which shares no code with the fit.
"""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from scissorcal.aliases import Array
from scissorcal.calibration.camera.bundle import SHARED, SeenBoard, fit_bundle, seen
from scissorcal.calibration.camera.checks import verdict_there
from scissorcal.calibration.camera.fit import (
    CANDIDATES,
    compare_cameras,
    fit_camera,
    seen_region,
)
from scissorcal.calibration.camera.uncertainty import (
    camera_covariance,
    halves,
    pixel_map,
)
from scissorcal.calibration.fit_pictures import left_over, residual_chart, uncertainty_chart
from scissorcal.calibration.plate.checks import CAMERA
from scissorcal.errors import MissingError, VerdictError
from scissorcal.vision import CAMERA_BOARD, Camera, Detection, Lens, SimPose, usual_camera

WIDTH, HEIGHT = 1280, 720
TRUE = np.array([1150.0, 1150.0, 648.0, 354.0, -0.2, 0.05, 0.0008, -0.0005, 0.0, 0.0, 0.0])
LENS = Lens(1150.0, (648.0, 354.0), WIDTH, HEIGHT, (-0.2, 0.05, 0.0008, -0.0005, 0.0))
BROWN = CANDIDATES[3][1]


def photographs(
    rng: np.random.Generator,
    count: int = 12,
    *,
    lens: Lens = LENS,
    noise_px: float = 0.1,
    shared_px: float = 0.0,
    bulge_m: tuple[float, float] = (0.0, 0.0),
    tilt: tuple[float, float] = (0.0, 0.75),
    azimuth: float | None = None,
) -> list[Detection]:
    """See the board from ``count`` places, with corner errors of ``noise_px``.

    ``shared_px`` bends the pixels of each photograph by a smooth field of its own; ``bulge_m``
    bends the board.
    """
    board = CAMERA_BOARD
    found: list[Detection] = []
    while len(found) < count:
        target = (
            0.5 * board.width_m + rng.uniform(-0.14, 0.14),
            0.5 * board.height_m + rng.uniform(-0.1, 0.1),
        )
        pose = SimPose.looking_at(
            target,
            rng.uniform(0.3, 0.7),
            tilt=rng.uniform(*tilt),
            azimuth=rng.uniform(0.0, 2 * np.pi) if azimuth is None else azimuth,
            turn=rng.uniform(-0.5, 0.5),
        )
        half = 0.5 * np.array([board.width_m, board.height_m])
        rise = (1.0 - ((board.points[:, :2] - half) / half) ** 2) @ np.array(bulge_m)
        points = np.column_stack([board.points[:, :2], rise]) @ pose.rotation.T + pose.shift_m
        pixels = lens.bend(points[:, :2] / points[:, 2:])
        pixels = pixels + noise_px * rng.standard_normal(pixels.shape)
        field = shared_px * rng.standard_normal((2, 2))
        pixels = pixels + ((board.points[:, :2] - half) / half) ** 2 @ field
        inside = np.all((pixels > 3.0) & (pixels < (WIDTH - 4, HEIGHT - 4)), axis=1)
        if inside.sum() >= 15:
            ids = np.flatnonzero(inside)
            name = f"{len(found):02d}.jpg"
            found.append(Detection(board, ids, pixels[inside], 60.0, name, WIDTH, HEIGHT))
    return found


def boards(photos: list[Detection]) -> list[SeenBoard]:
    size = (CAMERA_BOARD.width_m, CAMERA_BOARD.height_m)
    return [SeenBoard(photo.source, photo.points, photo.pixels, size, 1e-3) for photo in photos]


def test_slopes_of_seen_corners_are_right() -> None:
    (view,) = boards(photographs(np.random.default_rng(0), 1))
    pose = np.array([0.2, -0.3, 0.1, -0.1, -0.05, 0.5])
    shared = TRUE + np.array([0.0] * 9 + [1e-3, -5e-4])
    pixels, by_pose, by_shared = seen(view, pose, shared)
    steps = np.array([1e-2] * 4 + [1e-5] * 5 + [1e-6] * 2)
    for index, step in enumerate(steps):
        move = np.zeros(len(SHARED))
        move[index] = step
        ahead, behind = (seen(view, pose, shared + way * move)[0] for way in (1, -1))
        slope = (ahead - behind).ravel() / (2 * step)
        assert by_shared[:, index] == pytest.approx(slope, rel=1e-5, abs=1e-4)
    for index in range(6):
        move = np.zeros(6)
        move[index] = 1e-6
        ahead, behind = (seen(view, pose + way * move, shared)[0] for way in (1, -1))
        slope = (ahead - behind).ravel() / 2e-6
        assert by_pose[:, index] == pytest.approx(slope, rel=1e-5, abs=1e-3)
    assert pixels.shape == view.pixels.shape


def test_exact_corners_give_the_exact_camera_and_bend() -> None:
    photos = photographs(np.random.default_rng(1), 6, noise_px=0.0, bulge_m=(8e-4, -3e-4))
    start = np.append(usual_camera(WIDTH, HEIGHT).parameters, [0.0, 0.0])
    bundle = fit_bundle(boards(photos), BROWN, start)
    assert bundle.converged
    assert bundle.camera[:4] == pytest.approx(TRUE[:4], abs=0.02)
    assert bundle.camera[4:] == pytest.approx(TRUE[4:9], abs=1e-4)
    assert bundle.shared[9:] == pytest.approx([8e-4, -3e-4], abs=1e-6)
    assert bundle.rms_px.max() < 2e-3


def test_a_few_wrong_corners_hardly_matter() -> None:
    rng = np.random.default_rng(2)
    photos = photographs(rng)
    wrong = []
    for photo in photos:
        pixels = photo.pixels.copy()
        hit = rng.random(len(pixels)) < 0.03
        pixels[hit] += rng.uniform(-4.0, 4.0, (int(hit.sum()), 2))
        wrong.append(replace(photo, pixels=pixels))
    clean, spoiled = (fit_bundle(boards(some), BROWN, TRUE) for some in (photos, wrong))
    assert abs(spoiled.camera[0] - clean.camera[0]) < 1.0
    assert spoiled.sd_px < 1.6 * clean.sd_px


def z_scores(seed: int, **how: float) -> tuple[Array, float, float]:
    photos = photographs(np.random.default_rng(seed), 12, **how)  # type: ignore[arg-type]
    views = boards(photos)
    bundle = fit_bundle(views, BROWN, TRUE)
    covariance, stretch = camera_covariance(bundle)
    free = [0, 2, 3, 4, 5, 6, 7]
    off = (bundle.camera - TRUE[:9])[free]
    camera = Camera.of(bundle.camera, WIDTH, HEIGHT, covariance)
    region, _ = seen_region([view.pixels for view in views], WIDTH, HEIGHT)
    _, cross = pixel_map(camera, stretch, halves(views, bundle), region)
    assert cross is not None
    return off / np.sqrt(np.diag(covariance)[free]), stretch, cross.p_value


@pytest.mark.parametrize(
    ("how", "widest"),
    [
        pytest.param({}, 1.3, id="independent errors"),
        pytest.param({"bulge_m": (1e-3, 5e-4)}, 1.3, id="bent board", marks=pytest.mark.slow),
        pytest.param({"shared_px": 0.15}, 3.5, id="errors that a photograph shares"),
    ],
)
def test_the_covariance_is_honest(how: dict[str, float], widest: float) -> None:
    # Mean of 7 x 16 squared z; by simulation of such fits its sd is about 0.2 for independent
    # errors: 0.5 to 1.8 is left by chance in less than one run in a thousand.
    runs = [z_scores(seed, **how) for seed in range(16)]
    z = np.array([run[0] for run in runs])
    assert 0.5 < float(np.mean(z**2)) < 1.8
    stretch = float(np.mean([run[1] for run in runs]))
    assert 1.0 <= stretch < widest
    p = np.array([run[2] for run in runs])
    assert np.count_nonzero(p < 0.01) <= 2
    if "shared_px" in how:
        assert stretch > 1.3


def middle_only(rng: np.random.Generator, count: int = 24) -> list[Detection]:
    """Photographs whose corners lie in the middle of the picture alone."""
    kept = []
    for photo in photographs(rng, count, tilt=(0.2, 0.75)):
        off = np.abs(photo.pixels / [WIDTH, HEIGHT] - 0.5)
        near = np.all(off < 0.27, axis=1)
        if near.sum() >= 15:
            kept.append(replace(photo, ids=photo.ids[near], pixels=photo.pixels[near]))
    return kept


def test_a_picture_that_is_covered_in_part_is_judged_where_a_thing_stands() -> None:
    fit = fit_camera(middle_only(np.random.default_rng(3), 14), rng=np.random.default_rng(0))
    assert fit.region_share < 0.35
    assert [v.check for v in fit.verdicts if v.status == "fail"] == []
    (note,) = fit.notes
    assert "% of the picture" in note
    places = fit.pixel_map
    assert places is not None
    middle = np.array([[600.0, 300.0], [700.0, 400.0]])
    corner = np.array([[20.0, 20.0], [60.0, 90.0]])
    assert verdict_there(CAMERA, places, middle, 1000.0).status == "pass"
    refused = verdict_there(CAMERA, places, corner, 1000.0)
    assert refused.status == "fail"
    assert "scissorcal fit camera" in refused.why


@pytest.mark.slow
def test_what_a_camera_states_of_uncovered_places_holds_the_truth() -> None:
    """Errors against the renderer's lens, the best rotation taken out, within two standard errors.

    Those of one camera go together, so that each camera counts once, by most of its places: of 30
    all lay within but one. Where 5 % do not, as two standard errors say, 3 or more of 8 have a
    chance of 6e-3 (binomial).
    """
    held = []
    for seed in range(8):
        fit = fit_camera(
            middle_only(np.random.default_rng(100 + seed)), rng=np.random.default_rng(0)
        )
        places = fit.pixel_map
        assert places is not None
        x, y = np.meshgrid(places.x, places.y)
        pixels = np.column_stack([x.ravel(), y.ravel()])
        rays = fit.camera.rays(pixels)
        inside = places.inside.ravel()
        rotation, _ = Rotation.align_vectors(
            *(
                some / np.linalg.norm(some, axis=1, keepdims=True)
                for some in (
                    unbent(pixels[inside]),
                    np.column_stack([rays, np.ones(len(rays))])[inside],
                )
            )
        )
        turned = rotation.apply(np.column_stack([rays, np.ones(len(rays))]))
        error = (LENS.bend(turned[:, :2] / turned[:, 2:]) - pixels) / np.sqrt(2.0)
        ratio = np.linalg.norm(error, axis=1) / places.error_px.ravel()
        held.append(np.median(ratio[~inside & np.isfinite(ratio)]) < 2.0)
    assert held.count(False) <= 2


def unbent(pixels: Array) -> Array:
    """Directions (n, 3) that the renderer's lens brings to pixels, by fixed-point iteration."""
    start = (pixels - LENS.centre_px) / LENS.focal_px
    rays = start.copy()
    for _ in range(60):
        rays += (pixels - LENS.bend(rays)) / LENS.focal_px
    return np.column_stack([rays, np.ones(len(rays))])


def test_errors_that_half_the_photographs_have_in_common_are_seen_by_the_halves() -> None:
    rng = np.random.default_rng(5)
    near, far = replace(LENS, focal_px=1150.0), replace(LENS, focal_px=1170.0)
    one, other = photographs(rng, 5, lens=near), photographs(rng, 5, lens=far)
    mixed = [photo for pair in zip(one, other, strict=True) for photo in pair]
    fit = fit_camera(mixed, rng=rng)
    (verdict,) = [v for v in fit.verdicts if v.check == "two halves"]
    assert verdict.status == "fail"
    assert "focus, zoom" in verdict.why


def chosen_model(bend: tuple[float, ...], seed: int) -> str:
    """The model of distortion that photographs through one lens have chosen."""
    lens = replace(LENS, distortion=bend)
    start = np.append(usual_camera(WIDTH, HEIGHT).parameters, [0.0, 0.0])
    photos = photographs(np.random.default_rng(seed), 12, lens=lens)
    compared = compare_cameras(boards(photos), start, lambda _share, _sentence: None)
    (name,) = [row.name for row, _, _ in compared if row.chosen]
    return name


@pytest.mark.parametrize(
    ("bend", "chosen"),
    [
        ((0.0, 0.0, 0.0, 0.0, 0.0), "no distortion"),
        ((-0.2, 0.3, 0.004, -0.003, 0.0), "k1, k2, p1, p2"),
    ],
)
def test_photographs_choose_the_model_of_their_lens(bend: tuple[float, ...], chosen: str) -> None:
    assert chosen_model(bend, 100) == chosen


@pytest.mark.slow
@pytest.mark.parametrize(
    ("bend", "chosen"),
    [
        ((0.0, 0.0, 0.0, 0.0, 0.0), "no distortion"),
        ((-0.2, 0.0, 0.0, 0.0, 0.0), "k1"),
        ((-0.2, 0.3, 0.004, -0.003, 0.0), "k1, k2, p1, p2"),
    ],
)
def test_the_model_has_as_many_coefficients_as_data_want(
    bend: tuple[float, ...], chosen: str
) -> None:
    # Of 45 simulated fits 37 chose the true model and 8 a richer one, none a poorer one.
    names = [chosen_model(bend, 100 + seed) for seed in range(3)]
    order = [name for name, _ in CANDIDATES]
    assert names.count(chosen) >= 2
    assert min(order.index(name) for name in names) >= order.index(chosen)


def test_what_a_model_holds_is_held() -> None:
    lens = replace(LENS, distortion=(-0.2, 0.0, 0.0, 0.0, 0.0))
    photos = photographs(np.random.default_rng(100), 8, lens=lens)
    fit = fit_camera(photos, rng=np.random.default_rng(0))
    assert fit.camera.fx == fit.camera.fy
    assert fit.camera.covariance is not None
    assert np.diag(fit.camera.covariance)[8] == 0.0
    assert fit.camera.distortion[4] == 0.0


@pytest.fixture(scope="module")
def fitted() -> tuple[list[Detection], object]:
    photos = photographs(np.random.default_rng(4), 15)
    return photos, fit_camera(photos, rng=np.random.default_rng(0), inputs_hash="abc")


def test_a_good_fit_passes_every_check(fitted) -> None:  # type: ignore[no-untyped-def]
    _, fit = fitted
    assert [verdict.status for verdict in fit.verdicts] == ["pass"] * 5
    assert fit.draws.shape == (500, 9)
    assert np.cov(fit.draws[:, 0]) == pytest.approx(fit.camera.covariance[0, 0], rel=0.3)


def test_the_map_says_what_drawn_cameras_do(fitted) -> None:  # type: ignore[no-untyped-def]
    _, fit = fitted
    row, column = 3, 16
    pixel = np.array([[fit.pixel_map.x[column], fit.pixel_map.y[row]]])
    places = np.stack(np.meshgrid(fit.pixel_map.x, fit.pixel_map.y), -1).reshape(-1, 2)
    inside = fit.pixel_map.inside.ravel()
    rays = np.column_stack([fit.camera.rays(places), np.ones(len(places))])
    moved = []
    for draw in fit.draws[:150]:
        seen_px = Camera.of(draw, WIDTH, HEIGHT).project(rays)
        slope = np.zeros((2 * len(rays), 3))
        for axis in range(3):
            turn = np.zeros(3)
            turn[axis] = 1e-5
            turned = rays + np.cross(turn, rays)
            slope[:, axis] = ((fit.camera.project(turned) - places) / 1e-5).ravel()
        rows = np.repeat(inside, 2)
        off = (seen_px - places).ravel()
        best, *_ = np.linalg.lstsq(slope[rows], off[rows], rcond=None)
        moved.append((off - slope @ best).reshape(-1, 2)[row * len(fit.pixel_map.x) + column])
    spread = np.sqrt(np.mean(np.square(moved)))
    assert pixel.shape == (1, 2)
    assert fit.pixel_map.sd_px[row, column] == pytest.approx(spread, rel=0.2)


def test_pictures_are_drawn(fitted, tmp_path: Path) -> None:  # type: ignore[no-untyped-def]
    photos, fit = fitted
    views = boards(photos)
    rms = [np.sqrt(np.mean(np.sum(left_over(fit, v, b) ** 2, axis=1)))
           for v, b in zip(fit.views, views, strict=True)]  # fmt: skip
    assert rms == pytest.approx([view.rms_px for view in fit.views])
    for path in (
        residual_chart(fit, views, tmp_path / "a.png"),
        uncertainty_chart(fit, tmp_path / "b.png"),
    ):
        assert path.read_bytes().startswith(b"\x89PNG")


def test_a_photograph_that_does_not_fit_is_named() -> None:
    rng = np.random.default_rng(6)
    photos = photographs(rng, 9)
    pixels = photos[4].pixels + rng.normal(0.0, 1.0, photos[4].pixels.shape)
    photos[4] = replace(photos[4], pixels=pixels)
    fit = fit_camera(photos, rng=rng)
    assert [view.name for view in fit.views if view.outlying] == ["04.jpg"]
    (verdict,) = [v for v in fit.verdicts if v.check == "views"]
    assert verdict.status == "fail"
    assert "04.jpg" in verdict.why


@pytest.mark.parametrize("count", [0, 1, 2])
def test_too_few_photographs_are_refused(count: int) -> None:
    photos = photographs(np.random.default_rng(7), count)
    with pytest.raises(MissingError, match="take 15"):
        fit_camera(photos, rng=np.random.default_rng(0))


@pytest.mark.parametrize(("tilt", "azimuth"), [(0.0, 0.0), (0.01, None), (0.5, 1.0)])
def test_parallel_boards_do_not_determine_the_focal_length(
    tilt: float, azimuth: float | None
) -> None:
    # Turned about the line of sight too: that does not help. Slanted ones all face one way.
    rng = np.random.default_rng(8)
    photos = photographs(rng, 8, tilt=(tilt, tilt), azimuth=azimuth)
    if tilt > 0.1:
        photos = parallel(rng, tilt)
    with pytest.raises(VerdictError, match="focal length is not determined"):
        fit_camera(photos, rng=rng)


def parallel(rng: np.random.Generator, tilt: float) -> list[Detection]:
    """Photographs of one slanted plane, shifted alone."""
    found = []
    for number in range(8):
        pose = SimPose.looking_at((0.117, 0.091), rng.uniform(0.4, 0.7), tilt=tilt, azimuth=1.0)
        pose = SimPose(pose.rotation, pose.shift_m + rng.uniform(-0.05, 0.05, 3) * [1, 0, 0])
        pixels = LENS.sees(CAMERA_BOARD.points[:, :2], pose)
        pixels = pixels + 0.1 * rng.standard_normal(pixels.shape)
        name = f"{number}.jpg"
        found.append(Detection(CAMERA_BOARD, np.arange(48), pixels, 60.0, name, WIDTH, HEIGHT))
    return found
