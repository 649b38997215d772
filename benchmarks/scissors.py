"""Coverage of the edges of open scissors photographed without a mat.

    python -m benchmarks.scissors --count 200 --seed 1

Each rendered photograph shows another pair on a textured sheet, from a camera tilted by 0 to 8 deg,
under a lamp at random whose shadow has a penumbra, with blur, noise, a tone curve beside sRGB's,
and JPEG. The renderer shares no code with the measurement. Both blades are fitted with the length
of the pair stated; the table has, by band of tilt, the share of true offsets within the 95 %
interval, the error and the stated sd, and verdicts that failed. A last row has the pictures in
which metal is about as bright as its shadow.
"""

import argparse
import json
import sys
from dataclasses import dataclass, replace
from typing import Any

import cv2
import numpy as np
from benchmarks.photographs import CastShadow, Lamp, TexturedLayer, random_looks

from scissorcal.calibration.edge.fit import Blade, fit_blade
from scissorcal.errors import InputError
from scissorcal.vision.blade.photo import BladeLayout, BladePhoto, by_blade, photograph_scissors
from scissorcal.vision.photo import Photo
from scissorcal.vision.sim import (
    BladeShape,
    Lens,
    SimPose,
    as_jpeg,
    render,
    scissors_layers,
)

NOMINAL = 0.95
BANDS_DEG = ((0.0, 2.0), (2.0, 4.0), (4.0, 6.0), (6.0, 8.0))
CHECKED = np.array([0.45, 0.55, 0.65, 0.75, 0.85, 0.92])
"""Places of the edge that are compared with the truth, in shares of the blade's length."""

LENGTHS_LIMIT = 2.576
"""Of the verdict *blade lengths* for one photograph: 1 % of sound ones exceed it."""

MOST_TILT_DEG = 8.0
ALIKE = 0.4
"""Metal and full shadow whose light differs by less than a factor of 1.5 show no border between
them in these renderings, which have no bevel, scratch or glint: a row of their own."""


@dataclass(frozen=True)
class Pair:
    """A rendered pair of scissors and its true values; ``blades`` are "left" and "right".

    ``contrast`` is the logarithm of the metal's light over that of the sheet in full shadow.
    """

    photo: Photo
    blades: dict[str, BladeShape]
    pivot_px: np.ndarray
    tips_px: dict[str, np.ndarray]
    tilt_deg: float
    lamp_deg: float
    contrast: float


def main() -> None:
    """Run the benchmark and print its table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--count", type=int, default=200)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--lamps", type=int, default=1, help="photographs of each pair, lamp moved")
    parser.add_argument("--json", action="store_true")
    arguments = parser.parse_args()
    rows = []
    for index in range(arguments.count):
        rows.append(judged(under_lamps([arguments.seed, 156, index], arguments.lamps), index))
        if not arguments.json:
            said = rows[-1].get("refused") or f"tilt {rows[-1]['tilt_deg']:.1f} deg"
            print(f"  {index} {said}", file=sys.stderr)
    found = summary(rows)
    if arguments.json:
        print(json.dumps(found, indent=1))
    else:
        print(table(found))


def photographed(
    rng: np.random.Generator, *, tilt_deg: float | None = None, lamp_deg: float | None = None
) -> Pair:
    """Render open scissors on a textured sheet; tilt and lamp are drawn where not given."""
    width = int(rng.integers(816, 1400))
    height = width * 3 // 4
    focal = width * rng.uniform(0.72, 1.0)
    centre = (width / 2 - 0.5 + rng.normal(0, 4), height / 2 - 0.5 + rng.normal(0, 4))
    lens = Lens(focal, centre, width, height, (rng.normal(0, 0.01), 0.0, 0.0, 0.0, 0.0))
    tilt = float(rng.uniform(0.0, MOST_TILT_DEG)) if tilt_deg is None else tilt_deg
    px_per_mm = rng.uniform(0.8, 0.95) * height / 200.0
    turn = rng.uniform(0.0, 2.0 * np.pi)
    middle = 0.012 * np.array([np.cos(turn), np.sin(turn)])
    pose = SimPose.looking_at(
        (-float(middle[0]), -float(middle[1])),
        focal / px_per_mm * 1e-3,
        tilt=np.radians(tilt),
        azimuth=rng.uniform(0.0, 2.0 * np.pi),
    )
    length = rng.uniform(0.07, 0.085)
    left, right = (random_blade(rng, length * (1.0 + rng.normal(0, 0.004))) for _ in range(2))
    opening = rng.uniform(0.6, 1.4)
    look: dict[str, Any] = {
        "reflectance": rng.uniform(0.06, 0.4),
        "shading": (rng.normal(0, 0.15), rng.normal(0, 0.15)),
        "brushed": 0.03,
    }
    metal = scissors_layers(left, right, opening, pose, (0.0, 0.0), turn, **look)
    aim = float(np.radians(lamp_deg)) if lamp_deg is not None else rng.uniform(0.0, 2.0 * np.pi)
    lean = rng.uniform(0.4, 1.8)
    lamp = Lamp(
        (lean * np.cos(aim), lean * np.sin(aim)), rng.uniform(0.06, 0.35), rng.uniform(0.25, 0.65)
    )
    at_tip, at_pivot = rng.uniform(0.5e-3, 3e-3), rng.uniform(2e-3, 5e-3)
    along = np.array([np.cos(turn), np.sin(turn)])

    def above(points: np.ndarray) -> np.ndarray:
        return np.asarray(
            np.maximum(at_pivot + (at_tip - at_pivot) * (points @ along) / length, 2e-4)
        )

    white = rng.uniform(0.7, 0.9)
    far = 0.3 * np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
    sheet = TexturedLayer(
        [far],
        pose,
        white,
        texture=rng.uniform(0.0, 0.03),
        texture_m=rng.uniform(0.3e-3, 2e-3),
    )
    blades = [outline for layer in metal[:2] for outline in layer.outlines_m]
    layers: list[Any] = [sheet, CastShadow.of(blades, above, metal[0].pose, lamp), *metal]
    looks = random_looks(rng, px_per_mm, rng.uniform(0.3, 0.8))
    picture = render(layers, lens, looks, rng, background=0.8)
    data = np.frombuffer(as_jpeg(picture, int(rng.integers(80, 97))), dtype=np.uint8)
    read = np.asarray(cv2.imdecode(data, cv2.IMREAD_COLOR), dtype=np.uint8)
    tips = {}
    for name, shape, side in (("left", left, -1.0), ("right", right, 1.0)):
        bearing = turn + 0.5 * side * opening
        tip = shape.length_m * np.array([np.cos(bearing), np.sin(bearing)])
        off = shape.edge_at(shape.length_m) * np.array([-np.sin(bearing), np.cos(bearing)]) * side
        tips[name] = lens.sees((tip + off)[None], pose)[0]
    return Pair(
        Photo.from_array(read, "rendered.jpg"),
        {"left": left, "right": right},
        lens.sees(np.zeros((1, 2)), pose)[0],
        tips,
        tilt,
        float(np.degrees(aim)),
        float(np.log(look["reflectance"] / (white * (1.0 - lamp.share)))),
    )


def under_lamps(seed: list[int], lamps: int) -> list[Pair]:
    """One pair under several lamps, evenly around it; under one lamp at random for 1."""
    if lamps == 1:
        return [photographed(np.random.default_rng(seed))]
    first = float(np.random.default_rng([*seed, 1]).uniform(0.0, 360.0))
    aims = first + 360.0 * np.arange(lamps) / lamps
    return [photographed(np.random.default_rng(seed), lamp_deg=aim) for aim in aims]


def random_blade(rng: np.random.Generator, length: float) -> BladeShape:
    """A blade of a length whose edge is a line, an arc or wavy; one that is too thin is redrawn."""
    while True:
        kind = rng.integers(0, 3)
        shape = BladeShape(
            length_m=length,
            offset_m=-rng.uniform(0.005, 0.009),
            taper_rad=rng.uniform(0.0, 0.06),
            curvature_per_m=rng.normal(0, 0.7) if kind == 1 else 0.0,
            wave_m=rng.uniform(3e-5, 1.5e-4) if kind == 2 else 0.0,
            wave_length_m=rng.uniform(0.03, 0.06),
            wave_phase=rng.uniform(0, 2 * np.pi),
            back_m=rng.uniform(0.006, 0.009),
            back_slope=-rng.uniform(0.0, 0.06),
            tip_share=rng.uniform(0.1, 0.3),
            hole_m=rng.uniform(0.0018, 0.003),
        )
        s = np.linspace(0.0, (1.0 - shape.tip_share) * length, 50)
        if np.min(shape.back_at(s) - shape.edge_at(s)) > 3e-3:
            return shape


def true_edge(shape: BladeShape, stations: np.ndarray, halved: tuple[float, float]) -> np.ndarray:
    """Offsets of the edge in the frame whose x axis halves the blade over a range of its length."""
    s = np.linspace(0.0, shape.length_m, 40_001)
    lower, upper = shape.edge_at(s), shape.back_at(s)
    along = np.linspace(*halved, 501) * shape.length_m
    turn = 0.0
    for _ in range(8):
        c, n = np.cos(turn), np.sin(turn)
        middle = sum(0.5 * np.interp(along, c * s + n * y, c * y - n * s) for y in (lower, upper))
        turn += float(np.arctan(np.sum(middle * along) / np.sum(along**2)))
    c, n = np.cos(turn), np.sin(turn)
    return np.asarray(np.interp(stations, c * s + n * lower, c * lower - n * s))


def judged(pairs: list[Pair], seed: int) -> dict[str, Any]:
    """Measure and fit both blades in photographs of one pair, and compare them with the truth."""
    pair, rng = pairs[0], np.random.default_rng(seed)
    row: dict[str, Any] = {"tilt_deg": pair.tilt_deg, "contrast": pair.contrast}
    try:
        photos = _measured(pairs)
        photo, groups = photos[0], by_blade(photos)
        if set(groups) != set(pair.blades):
            return {**row, "refused": "closed"}
        length = float(np.mean([blade.length_m for blade in pair.blades.values()]))
        fits = {
            name: fit_blade(
                groups[name], None, effort="draft", rng=rng, blade=Blade(name=name, length_m=length)
            )
            for name in pair.blades
        }
    except InputError as error:
        return {**row, "refused": str(error)}
    blades = []
    for name, fit in fits.items():
        shape, measured = pair.blades[name], groups[name][0]
        stations = CHECKED * length
        draws = fit.edge_posterior.with_values(fit.draws).offset_at(stations)
        truth = true_edge(shape, stations, measured.parts.halved)
        miss = draws.mean(axis=0) - truth
        low, high = np.quantile(draws, [0.5 - NOMINAL / 2, 0.5 + NOMINAL / 2], axis=0)
        tip = measured.parts.points(np.array([measured.length]), np.zeros(1))
        # the tip's station: its place beside the centreline is not compared
        along = photo.view.to_pixels(tip)[0] - measured.pivot_px
        beyond = float(np.linalg.norm(along))
        true = float((pair.tips_px[name] - measured.pivot_px) @ along) / beyond
        blades.append(
            {
                "held": ((low < truth) & (truth < high)).tolist(),
                "miss_mm": (1e3 * miss).tolist(),
                "sd_mm": (1e3 * draws.std(axis=0)).tolist(),
                "residual_mm": 1e3
                * float(
                    np.sqrt(np.mean([np.mean(np.square(p.residual)) for p in fit.photographs]))
                ),
                "tip_px": beyond - true,
                "failed": [v.check for v in fit.verdicts if v.status == "fail"],
                "checks": {v.check: v.value for v in fit.verdicts},
            }
        )
    assert photo.scissors is not None
    lengths = photo.lengths
    alike = abs(lengths.log_ratio) / lengths.sd if lengths else 0.0
    return {
        **row,
        "blades": blades,
        "lengths_sds": alike,
        "pivot_px": float(np.linalg.norm(photo.scissors.pivot - pair.pivot_px)),
    }


def _measured(pairs: list[Pair]) -> list[BladePhoto]:
    """The photographs that can be used. Raises InputError of the last one where none can."""
    found = []
    for number, pair in enumerate(pairs, start=1):
        try:
            named = replace(pair.photo, source=f"{number}.jpg")
            found.append(photograph_scissors(named, layout=BladeLayout(mat=False)))
        except InputError:
            if not found and number == len(pairs):
                raise
    return found


def summary(rows: list[dict[str, Any]]) -> dict[str, Any]:
    """By band of tilt: photographs, refusals, coverage, errors, stated sds, failed verdicts."""
    out: dict[str, Any] = {"nominal": NOMINAL, "bands": [], "refused": {}}
    for row in rows:
        if "refused" in row:
            why = row["refused"].split(":")[-1].strip()[:70]
            out["refused"][why] = out["refused"].get(why, 0) + 1
    everything = (0.0, MOST_TILT_DEG)
    for (low, high), alike in (
        *((band, False) for band in (*BANDS_DEG, everything)),
        (everything, True),
    ):
        part = [
            row
            for row in rows
            if low <= row["tilt_deg"] <= high and (abs(row["contrast"]) < ALIKE) == alike
        ]
        blades = [blade for row in part if "refused" not in row for blade in row["blades"]]
        if not blades:
            continue
        miss, sd = (np.array([b[name] for b in blades]) for name in ("miss_mm", "sd_mm"))
        checks = sorted({check for b in blades for check in b["failed"]})
        out["bands"].append(
            {
                "tilt_deg": [low, high],
                "metal_as_shadow": alike,
                "photographs": len(part),
                "refused": sum("refused" in row for row in part),
                "blades": len(blades),
                "held": float(np.mean([b["held"] for b in blades])),
                "rms_z": float(np.sqrt(np.mean((miss / sd) ** 2))),
                "median_error_mm": float(np.median(np.abs(miss))),
                "worst_error_mm": float(np.abs(miss).max()),
                "median_sd_mm": float(np.median(sd)),
                "median_residual_mm": float(np.median([b["residual_mm"] for b in blades])),
                "median_tip_px": float(np.median([b["tip_px"] for b in blades])),
                "worst_tip_px": float(max((b["tip_px"] for b in blades), key=abs)),
                "lengths_failed": sum(row.get("lengths_sds", 0.0) > LENGTHS_LIMIT for row in part),
                "failed": {c: sum(c in b["failed"] for b in blades) for c in checks},
            }
        )
    return out


def table(found: dict[str, Any]) -> str:
    """The summary as lines."""
    lines = [
        f"tilt deg   photographs  refused  held of {100 * found['nominal']:.0f} %  rms z  "
        "error mm (worst)  sd mm  residual mm  tip px (worst)  failed verdicts"
    ]
    for band in found["bands"]:
        low, high = band["tilt_deg"]
        lines.append(
            f"{low:.0f} to {high:.0f}     {band['photographs']:>11}  {band['refused']:>7}  "
            f"{100 * band['held']:>11.1f} %  {band['rms_z']:>5.2f}  {band['median_error_mm']:.3f} "
            f"({band['worst_error_mm']:.2f})      {band['median_sd_mm']:.3f}  "
            f"{band['median_residual_mm']:>10.3f}  {band['median_tip_px']:+.1f} "
            f"({band['worst_tip_px']:+.1f})  {band['failed'] or 'none'}, blade lengths "
            f"{band['lengths_failed']}{'  metal as bright as its shadow' * band['metal_as_shadow']}"
        )
    lines += [f"refused {count}: {why}" for why, count in found["refused"].items()]
    return "\n".join(lines)


if __name__ == "__main__":
    main()
