"""Accuracy of blades in rendered photographs: error, coverage, rejections, seconds.

    python benchmarks/blades.py --count 200 --width 2000

The renderer gives the true values and shares no code with the measurement. Each photograph has
another blade shape (line, arc, cubic or wavy), camera and viewpoint, with blur, noise, vignetting,
shadow, reflections, a tone curve other than sRGB's, a printer scale error, and JPEG. Half of the
photographs have a camera fit (with errors drawn from its stated covariance), half have none.
"""

import argparse
import json
import sys
import time
from dataclasses import dataclass, replace
from typing import Any

import cv2
import numpy as np
from benchmarks.photographs import Glare, GlaringLayer, centreline_turn, random_looks

from scissorcal.calibration.edge.fit import fit_blade
from scissorcal.calibration.edge.result import BladeFit
from scissorcal.errors import InputError
from scissorcal.vision.blade.photo import BladePhoto, photograph_blade
from scissorcal.vision.geometry.camera import Camera
from scissorcal.vision.photo import Photo
from scissorcal.vision.sim import (
    BladeShape,
    Lens,
    Nick,
    SimPose,
    as_jpeg,
    blade_layer,
    render,
    target_layers,
)
from scissorcal.vision.targets.boards import BLADE_MAT, MAT_PIVOT_M

CAMERA_SD = np.array([2.0, 2.0, 2.0, 2.0, 2e-3, 4e-3, 1e-4, 1e-4, 0.0])
"""Standard deviations of a camera of 2000 pixels: focal lengths, centre (px), distortion."""

CHECKED = np.array([0.2, 0.35, 0.5, 0.65, 0.8, 0.93])


@dataclass(frozen=True)
class Setting:
    """One rendered photograph and its true values."""

    photo: Photo
    camera: Camera | None
    shape: BladeShape
    px_per_mm: float


def main() -> None:
    """Run the benchmark and print its table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--count", type=int, default=20)
    parser.add_argument("--width", type=int, nargs="+", default=[2000])
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--strength", type=float, default=1.0, help="of the disturbances")
    parser.add_argument("--effort", choices=["draft", "standard"], default="draft")
    parser.add_argument("--json", action="store_true")
    arguments = parser.parse_args()
    tables = []
    for width in arguments.width:
        rows = []
        for index in range(arguments.count):
            rng = np.random.default_rng([arguments.seed, width, index])
            setting = photographed(width, arguments.strength, rng, known=index % 2 == 0)
            rows.append(measured(setting, arguments.effort, rng))
            if not arguments.json:
                said = rows[-1].get("refused") or rows[-1]["error_um"]
                print(f"  {index} {said}", file=sys.stderr)
        tables.append({"width": width, **summary(rows)})
    if arguments.json:
        print(json.dumps(tables, indent=1))
    else:
        for table in tables:
            print("\n".join(f"{name:>34}: {value}" for name, value in table.items()) + "\n")


def photographed(width: int, strength: float, rng: np.random.Generator, *, known: bool) -> Setting:
    """Render one blade on the mat from a plausible viewpoint."""
    height = width * 3 // 4
    focal = width * rng.uniform(0.75, 1.1)
    centre = (width / 2 - 0.5 + rng.normal(0, 6), height / 2 - 0.5 + rng.normal(0, 6))
    bent = (rng.normal(0, 0.06), rng.normal(0, 0.03), rng.normal(0, 3e-4), rng.normal(0, 3e-4), 0.0)
    lens = Lens(focal, centre, width, height, bent)
    distance = 0.126 / (0.43 * width) * focal * rng.uniform(1.0, 1.25)
    pose = SimPose.looking_at(
        (0.126 + rng.normal(0, 0.004), 0.09 + rng.normal(0, 0.004)),
        distance,
        tilt=abs(rng.normal(0, 0.12)),
        azimuth=rng.uniform(0, 2 * np.pi),
        turn=rng.normal(0, 0.1),
    )
    px_per_mm = focal / distance * 1e-3
    shape = random_shape(rng)
    turn = rng.normal(0, 0.12)
    where = (MAT_PIVOT_M[0] + rng.normal(0, 2e-3), MAT_PIVOT_M[1] + rng.normal(0, 2e-3))
    glares: list[Glare] = []
    for _ in range(rng.integers(0, 3)):
        along = rng.uniform(0.01, 0.06)
        glares.append(
            Glare(
                (where[0] + along, where[1] + rng.uniform(-0.006, 0.004)),
                rng.uniform(0.003, 0.01),
                rng.uniform(0.0005, 0.002),
                turn,
                strength * rng.uniform(0.1, 0.8),
            )
        )
    printed = tuple(1.0 + rng.normal(0, 1e-3, 2) * strength)
    metal = blade_layer(
        shape,
        pose,
        where,
        turn,
        reflectance=rng.uniform(0.1, 0.35),
        shading=(rng.normal(0, 0.3), rng.normal(0, 0.6)),
        brushed=0.05 * strength,
        shadow=strength * rng.uniform(0.0, 0.5),
        shadow_m=tuple(rng.normal(0, 1.2e-3, 2)),
        shadow_soft_m=rng.uniform(0.8e-3, 3e-3),
    )
    layers = [
        *target_layers(BLADE_MAT, pose, print_scale=printed),
        GlaringLayer(**vars(metal), glares=tuple(glares)),
    ]
    picture = render(layers, lens, random_looks(rng, px_per_mm, strength), rng)
    data = np.frombuffer(as_jpeg(picture, int(rng.integers(75, 97))), dtype=np.uint8)
    read = np.asarray(cv2.imdecode(data, cv2.IMREAD_COLOR), dtype=np.uint8)
    photo = Photo.from_array(read, "rendered.jpg")
    return Setting(photo, assumed_camera(lens, rng) if known else None, shape, px_per_mm)


def random_shape(rng: np.random.Generator) -> BladeShape:
    """A blade 60 to 100 mm long whose edge is a line, an arc, a cubic or wavy.

    One whose edge meets its back before the tip would be shorter than it says, and is drawn anew.
    """
    while True:
        shape = _any_shape(rng)
        s = np.linspace(0.0, (1.0 - shape.tip_share) * shape.length_m, 50)
        if np.min(shape.back_at(s) - shape.edge_at(s)) > 3e-3:
            return shape


def _any_shape(rng: np.random.Generator) -> BladeShape:
    length = rng.uniform(0.06, 0.1)
    kind = rng.integers(0, 4)
    offset = -rng.uniform(0.005, 0.009)
    taper = rng.uniform(0.0, 0.05)
    shape = BladeShape(
        length_m=length,
        offset_m=offset,
        taper_rad=taper,
        curvature_per_m=rng.normal(0, 0.8) if kind in (1, 2) else 0.0,
        bend_per_m2=rng.normal(0, 25.0) if kind == 2 else 0.0,
        wave_m=rng.uniform(3e-5, 2e-4) if kind == 3 else 0.0,
        wave_length_m=rng.uniform(0.025, 0.06),
        wave_phase=rng.uniform(0, 2 * np.pi),
        back_m=rng.uniform(0.006, 0.009),
        back_slope=-rng.uniform(0.0, 0.05),
        hole_m=rng.uniform(0.0018, 0.003),
    )
    nicks = tuple(
        Nick(rng.uniform(0.2, 0.9) * length, rng.uniform(0.5e-3, 2e-3), rng.uniform(1e-4, 6e-4))
        for _ in range(rng.integers(0, 3))
    )
    return replace(shape, nicks=nicks)


def assumed_camera(lens: Lens, rng: np.random.Generator) -> Camera:
    """A camera fit: the true camera with errors drawn from its covariance."""
    truth = np.array([lens.focal_px, lens.focal_px, *lens.centre_px, *lens.distortion])
    sd = CAMERA_SD * np.r_[np.full(4, lens.width / 2000.0), np.ones(5)]
    # a fit knows both focal lengths to be nearly one
    covariance = np.diag(sd**2)
    covariance[0, 1] = covariance[1, 0] = 0.98 * sd[0] * sd[1]
    found = rng.multivariate_normal(truth, covariance)
    fx, fy, cx, cy = found[:4]
    return Camera(fx, fy, cx, cy, tuple(found[4:]), lens.width, lens.height, covariance)


def true_edge(shape: BladeShape, stations: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Edge and its slope angle in the frame whose x axis is the centreline."""
    turn = centreline_turn(shape)
    s = np.linspace(0.0, shape.length_m, 40_001)
    e = shape.edge_at(s)
    along, off = np.cos(turn) * s + np.sin(turn) * e, np.cos(turn) * e - np.sin(turn) * s
    slope = np.gradient(off, along)
    return np.interp(stations, along, off), np.arctan(np.interp(stations, along, slope))


def measured(setting: Setting, effort: Any, rng: np.random.Generator) -> dict[str, Any]:
    """Measure and fit one photograph, and compare it with the true values."""
    start = time.perf_counter()
    try:
        photo: BladePhoto = photograph_blade(setting.photo, setting.camera)
    except InputError as error:
        return {"refused": str(error)}
    middle = time.perf_counter()
    fit: BladeFit = fit_blade([*photo.measured], None, effort=effort, rng=rng)
    end = time.perf_counter()
    stations = CHECKED * setting.shape.length_m
    truth, angle = true_edge(setting.shape, stations)
    edges = fit.edge_posterior.with_values(fit.draws)
    offsets, tapers = edges.offset_at(stations), np.arctan(edges.slope_at(stations))
    miss = offsets.mean(axis=0) - truth
    wrong = tapers.mean(axis=0) - angle
    nicks = setting.shape.nicks
    found = sum(
        any(abs(n.station_m - seen.station_m) < 1.5e-3 for seen in fit.nicks) for n in nicks
    )
    return {
        "error_um": float(1e6 * np.sqrt(np.mean(miss**2))),
        "error_px": float(np.sqrt(np.mean(miss**2)) * 1e3 * setting.px_per_mm),
        "shape_um": float(1e6 * (miss - np.polyval(np.polyfit(stations, miss, 1), stations)).std()),
        "alpha_mrad": float(1e3 * np.sqrt(np.mean(wrong**2))),
        "z_edge": (miss / offsets.std(axis=0)).tolist(),
        "z_alpha": (wrong / tapers.std(axis=0)).tolist(),
        "length_um": float(1e6 * (photo.measured[0].length - setting.shape.length_m)),
        "family": fit.family,
        "nicks": len(nicks),
        "nicks_found": found,
        "nicks_false": max(len(fit.nicks) - found, 0),
        "known": setting.camera is not None,
        "measure_s": middle - start,
        "fit_s": end - middle,
    }


def summary(rows: list[dict[str, Any]]) -> dict[str, Any]:
    """The table: medians, worst, coverage of 90 % intervals, share rejected."""
    good = [row for row in rows if "refused" not in row]
    out: dict[str, Any] = {"photographs": len(rows), "refused": len(rows) - len(good)}
    for said in {row["refused"].split(":")[-1][:60] for row in rows if "refused" in row}:
        out[f"refused: {said}"] = sum(said in row.get("refused", "") for row in rows)
    if not good:
        return out
    for name in ("error_um", "error_px", "shape_um", "alpha_mrad", "measure_s", "fit_s"):
        values = np.array([row[name] for row in good])
        middle, most, worst = np.quantile(values, [0.5, 0.95, 1.0])
        out[name] = f"median {middle:.3g}, 95 % {most:.3g}, worst {worst:.3g}"
    for kind in (True, False):
        part = [row for row in good if row["known"] == kind]
        if not part:
            continue
        name = "camera known" if kind else "no camera"
        out[f"error_um, {name}"] = float(np.median([row["error_um"] for row in part]))
        for what in ("z_edge", "z_alpha"):
            z = np.abs([row[what] for row in part])
            out[f"{what} within 90 %, {name}"] = (
                f"{float(np.mean(z < 1.645)):.3f}, rms z {float(np.sqrt(np.mean(z**2))):.2f}"
            )
    out["nicks found"] = f"{sum(r['nicks_found'] for r in good)} of {sum(r['nicks'] for r in good)}"
    out["nicks false"] = sum(row["nicks_false"] for row in good)
    names = sorted({row["family"] for row in good})
    out["families"] = {name: sum(row["family"] == name for row in good) for name in names}
    return out


if __name__ == "__main__":
    main()
