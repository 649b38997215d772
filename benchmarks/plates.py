"""Accuracy of plate poses in rendered views: errors, flips, coverage, rejections; one marker alone.

    python benchmarks/plates.py --count 500

The renderer gives the true values and shares no code with the measurement. Each view has another
camera (its fit with errors drawn from the stated covariance), another pose (one in six from the
front, one in six grazing), a printer scale error, blur, noise, vignetting, a tone curve other than
sRGB's, JPEG, and in one of four a shadow or an object over a part of the target. For comparison,
one marker of the same picture is located by OpenCV's detector and ``cv2.solvePnP`` (IPPE_SQUARE).
"""

import argparse
import json
import sys
import time
from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np
from benchmarks.photographs import random_looks

from scissorcal.calibration.plate.fit import fit_plate
from scissorcal.errors import ScissorcalError
from scissorcal.vision.geometry.camera import Camera
from scissorcal.vision.photo import Photo
from scissorcal.vision.sim import Lens, PaintLayer, SimPose, as_jpeg, render, target_layers
from scissorcal.vision.targets.boards import PLATE_BOARD, PLATE_STRIP, MarkedBoard, dictionary
from scissorcal.vision.targets.detect import find_board

CAMERA_SD = np.array([1.2, 1.2, 1.2, 1.2, 2e-3, 4e-3, 1e-4, 1e-4, 0.0])
"""Standard deviations of a camera of 1280 pixels: focal lengths, centre (px), distortion."""

PRINT_SD = 1e-3
WIDTH, HEIGHT = 1280, 720
KINDS = ("square-on", "middling", "middling", "middling", "middling", "grazing")
FLIP_DEG = 1.0
"""A pose counts as flipped if its normal is nearer to the true normal mirrored at the line of sight
than to the true one, provided that these differ by more than this angle."""

Z90 = 1.645


@dataclass(frozen=True)
class View:
    """A picture of ``board``, a camera fit, and the true pose."""

    photo: Photo
    board: MarkedBoard
    camera: Camera
    truth: SimPose
    kind: str


def main() -> None:
    """Run the benchmark and print its table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--count", type=int, default=40)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--strength", type=float, default=1.0, help="of the disturbances")
    parser.add_argument("--json", action="store_true")
    arguments = parser.parse_args()
    rows = []
    for index in range(arguments.count):
        rng = np.random.default_rng([arguments.seed, index])
        seen = photographed(KINDS[index % len(KINDS)], arguments.strength, rng)
        rows.append({"kind": seen.kind, "board": seen.board.name, **measured(seen)})
        rows[-1]["marker"] = one_marker(seen)
        if not arguments.json:
            said = rows[-1].get("refused") or f"{rows[-1]['deg']:.3f} deg {rows[-1]['mm']:.3f} mm"
            print(f"  {index} {seen.kind}, {seen.board.name}: {said}", file=sys.stderr)
    tables = {"all": summary(rows)}
    tables |= {k: summary([r for r in rows if r["kind"] == k]) for k in dict.fromkeys(KINDS)}
    for board in (PLATE_BOARD.name, PLATE_STRIP.name):
        tables[board] = summary([row for row in rows if row["board"] == board])
    if arguments.json:
        print(json.dumps({"tables": tables, "rows": rows}, indent=1))
        return
    for name, table in tables.items():
        print(f"{name}\n" + "\n".join(f"{key:>32}: {value}" for key, value in table.items()))


def photographed(kind: str, strength: float, rng: np.random.Generator) -> View:
    """Render one view of a target from a plausible viewpoint."""
    board: MarkedBoard = PLATE_BOARD if rng.uniform() < 0.5 else PLATE_STRIP
    focal = WIDTH * rng.uniform(0.8, 1.2)
    centre = (0.5 * WIDTH + rng.normal(0, 6), 0.5 * HEIGHT + rng.normal(0, 6))
    bent = (rng.normal(0, 0.06), rng.normal(0, 0.03), rng.normal(0, 3e-4), rng.normal(0, 3e-4), 0.0)
    lens = Lens(focal, centre, WIDTH, HEIGHT, bent)
    low, high = {"square-on": (0, 3), "middling": (3, 65), "grazing": (65, 80)}[kind]
    tilt = np.radians(rng.uniform(low, high))
    span = max(board.width_m, 1.5 * board.height_m)
    distance = focal * span / (WIDTH * rng.uniform(0.35, 0.75))
    middle = (
        0.5 * board.width_m + rng.normal(0, 0.05) * span,
        0.5 * board.height_m + rng.normal(0, 0.03) * span,
    )
    turn = rng.uniform(-0.4, 0.4) + (np.pi if rng.uniform() < 0.3 else 0.0)
    truth = SimPose.looking_at(
        middle, distance, tilt=tilt, azimuth=rng.uniform(0, 2 * np.pi), turn=turn
    )
    printed = tuple(1.0 + rng.normal(0, PRINT_SD, 2))
    layers = target_layers(board, truth, print_scale=(float(printed[0]), float(printed[1])))
    if rng.uniform() < 0.25:
        layers.append(_thing(board, truth, rng))
    picture = render(layers, lens, random_looks(rng, 1e-3 * focal / distance, strength), rng)
    data = np.frombuffer(as_jpeg(picture, int(rng.integers(75, 97))), dtype=np.uint8)
    read = np.asarray(cv2.imdecode(data, cv2.IMREAD_GRAYSCALE), dtype=np.uint8)
    photo = Photo.from_array(read, "rendered.jpg")
    return View(photo, board, assumed_camera(lens, rng), truth, kind)


def _thing(board: MarkedBoard, truth: SimPose, rng: np.random.Generator) -> PaintLayer:
    """A dark object with a soft shadow over one end of the target."""
    left = rng.uniform(-0.03, 0.2) * board.width_m
    bar = np.array([[left - 0.02, -0.05], [left, -0.05], [left + 0.01, 0.2], [left - 0.01, 0.2]])
    shift = (rng.uniform(0.004, 0.02), 0.003)
    return PaintLayer([bar], truth, 0.2, shadow=0.4, shadow_m=shift, shadow_soft_m=0.005)


def assumed_camera(lens: Lens, rng: np.random.Generator) -> Camera:
    """A camera fit: the true camera with errors drawn from its covariance."""
    covariance = np.diag(CAMERA_SD**2)
    covariance[0, 1] = covariance[1, 0] = 0.98 * CAMERA_SD[0] * CAMERA_SD[1]
    truth = np.array([lens.focal_px, lens.focal_px, *lens.centre_px, *lens.distortion])
    found = rng.multivariate_normal(truth, covariance)
    fx, fy, cx, cy = (float(value) for value in found[:4])
    return Camera(fx, fy, cx, cy, tuple(found[4:]), lens.width, lens.height, covariance)


def measured(view: View) -> dict[str, Any]:
    """Find and fit one view, and compare it with the true pose."""
    start = time.perf_counter()
    try:
        found = find_board(view.photo, view.board)
        fit = fit_plate([found], view.camera)
    except ScissorcalError as error:
        return {"refused": str(error)}
    seconds = time.perf_counter() - start
    failed = [v.check for v in fit.verdicts if v.status == "fail"]
    pose, known = fit.camera_plate, fit.camera_plate.covariance
    assert known is not None
    away = off(pose.matrix, np.array(pose.translation_m), view.truth)
    z = np.abs(away) / np.sqrt(np.diag(known))
    return {
        **errors(pose.matrix, np.array(pose.translation_m), view),
        "corners": len(found.ids),
        "side_px": found.square_px,
        "failed": failed,
        "ambiguous": "ambiguity" in failed,
        "z_rotation": z[:3].tolist(),
        "z_translation": z[3:].tolist(),
        "seconds": seconds,
    }


def one_marker(view: View) -> dict[str, Any]:
    """The pose from the target's middle marker alone, by OpenCV."""
    settings = cv2.aruco.DetectorParameters()
    settings.cornerRefinementMethod = cv2.aruco.CORNER_REFINE_SUBPIX
    detector = cv2.aruco.ArucoDetector(dictionary(view.board.dictionary), settings)
    corners, ids, _ = detector.detectMarkers(view.photo.grey)
    own = [] if ids is None else [int(i) for i in np.ravel(ids)]
    central = view.board.ids[len(view.board.ids) // 2]
    usable = sorted(set(own) & set(view.board.ids), key=lambda i: abs(i - central))
    if not usable:
        return {"refused": "no marker"}
    points = view.board.marker_corners(usable[0])
    half = 0.5 * view.board.marker_m
    square = np.array([[-half, half, 0], [half, half, 0], [half, -half, 0], [-half, -half, 0]])
    _, turn, shift = cv2.solvePnP(
        square,
        np.asarray(corners[own.index(usable[0])], dtype=np.float64).reshape(4, 2),
        view.camera.matrix,
        view.camera.coefficients,
        flags=cv2.SOLVEPNP_IPPE_SQUARE,
    )
    matrix = cv2.Rodrigues(turn)[0] @ np.diag([1.0, -1.0, -1.0])
    return errors(matrix, shift.ravel() - matrix @ points.mean(axis=0), view)


def off(matrix: np.ndarray, shift: np.ndarray, truth: SimPose) -> np.ndarray:
    """Difference from the true pose: rotation vector (rad), translation (m)."""
    turn = cv2.Rodrigues(matrix @ truth.rotation.T)[0].ravel()
    return np.concatenate([turn, shift - truth.shift_m])


def errors(matrix: np.ndarray, shift: np.ndarray, view: View) -> dict[str, Any]:
    """Angle, and the error of the target's middle: total, across the line of sight, along it."""
    away = off(matrix, shift, view.truth)
    middle = np.array([0.5 * view.board.width_m, 0.5 * view.board.height_m, 0.0])
    place = view.truth.rotation @ middle + view.truth.shift_m
    moved = matrix @ middle + shift - place
    along = float(moved @ place / np.linalg.norm(place))
    degrees = float(np.degrees(np.linalg.norm(away[:3])))
    return {
        "deg": degrees,
        "mm": float(1e3 * np.linalg.norm(moved)),
        "across_mm": float(1e3 * np.sqrt(max(moved @ moved - along**2, 0.0))),
        "flip": _flipped(matrix[:, 2], view.truth.rotation[:, 2], place / np.linalg.norm(place)),
    }


def _flipped(normal: np.ndarray, truth: np.ndarray, sight: np.ndarray) -> bool:
    mirrored = 2.0 * (truth @ sight) * sight - truth
    apart = np.degrees(np.arccos(np.clip(truth @ mirrored, -1.0, 1.0)))
    return bool(apart > FLIP_DEG and normal @ mirrored > normal @ truth)


def summary(rows: list[dict[str, Any]]) -> dict[str, Any]:
    """Medians, 95 %, flips, coverage of 90 % intervals, share rejected or ambiguous."""
    good = [row for row in rows if "refused" not in row]
    sure = [row for row in good if not row["ambiguous"]]
    out: dict[str, Any] = {"views": len(rows), "refused": len(rows) - len(good)}
    out["called ambiguous"] = len(good) - len(sure)
    out["flips among these"] = sum(row["flip"] for row in good if row["ambiguous"])
    out["flips among the rest"] = sum(row["flip"] for row in sure)
    if not sure:
        return out
    for name in ("deg", "mm", "across_mm", "seconds"):
        middle, most, worst = np.quantile([row[name] for row in sure], [0.5, 0.95, 1.0])
        out[name] = f"median {middle:.3g}, 95 % {most:.3g}, worst {worst:.3g}"
    for name in ("z_rotation", "z_translation"):
        z = np.array([row[name] for row in sure])
        share, size = np.mean(z < Z90), np.sqrt(np.mean(z**2))
        out[f"{name} within 90 %"] = f"{share:.3f} (rms z {size:.2f})"
    single = [row["marker"] for row in rows if "refused" not in row["marker"]]
    out["one marker: refused"] = len(rows) - len(single)
    out["one marker: flips"] = sum(row["flip"] for row in single)
    if single:
        for name in ("deg", "mm", "across_mm"):
            middle, most = np.quantile([row[name] for row in single], [0.5, 0.95])
            out[f"one marker: {name}"] = f"median {middle:.3g}, 95 % {most:.3g}"
    checks = sorted({check for row in sure for check in row["failed"]})
    out["other verdicts that failed"] = {c: sum(c in r["failed"] for r in sure) for c in checks}
    return out


if __name__ == "__main__":
    main()
