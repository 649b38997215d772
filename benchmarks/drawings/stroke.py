"""One stroke through a sheet: torque over the opening, by phase, from scissorcal.model."""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from benchmarks.drawings.canvas import BLUE, GREEN, GREY, INK, ORANGE, PALE, Drawing, Point
from benchmarks.drawings.scissors import EDGE
from numpy.typing import NDArray

from scissorcal.aliases import Array
from scissorcal.model import Cutting, Response, cut_torque_along, edge_height, settled_contact

PAPER = Cutting(
    edge=EDGE,
    response=Response("power", force=0.65, exponent=1.55, reference_m=1.5e-4),
    moving_blades=2,
    upper_face_m=5e-5,
    fracture_energy=0.5,
    kappa=0.5,
)
STROKE_DEG = (44.0, 26.0)
ADVANCE_M = -0.020
PHASES = {"free": GREY, "loading": GREEN, "running": ORANGE, "unloading": BLUE}


@dataclass(frozen=True)
class Stroke:
    """Opening (deg), torque (mN m) and phase of each sample of one stroke."""

    opening: Array
    torque: Array
    phase: NDArray[np.str_]
    mean: Array


def walk_stroke(cutting: Cutting = PAPER, samples: int = 24_000) -> Stroke:
    """Close and open once; the crack starts at J_c h and stops at kappa J_c h, exactly."""
    down = np.linspace(*STROKE_DEG, samples)
    opening = np.radians(np.concatenate([down, down[::-1]]))
    closing = np.arange(len(opening)) < samples
    assert cutting.fracture_energy is not None
    peak = float(cutting.fracture_energy) / cutting.moving_blades
    crack, started = 0.0, False
    torque, phase = np.zeros(len(opening)), np.empty(len(opening), dtype="<U9")
    for i, theta in enumerate(opening):
        view = edge_height(cutting.edge, crack - ADVANCE_M, theta / cutting.moving_blades)
        force = float(cutting.response.force_at(cutting.upper_face_m - view.height))
        if force * float(view.slope) > peak:
            started = True
            crack = _stopped(cutting, float(theta), float(cutting.kappa) * peak)
            view = edge_height(cutting.edge, crack - ADVANCE_M, theta / cutting.moving_blades)
            force = float(cutting.response.force_at(cutting.upper_face_m - view.height))
        torque[i] = force * float(view.lever)
        if force <= 0.0:
            phase[i] = "free"
        else:
            phase[i] = ("running" if started else "loading") if closing[i] else "unloading"
    mean, _ = cut_torque_along(cutting, opening, np.full(len(opening), ADVANCE_M), 0.0)
    return Stroke(np.degrees(opening), 1e3 * torque, phase, 1e3 * mean)


def _stopped(cutting: Cutting, theta: float, left: float) -> float:
    """Return the crack's place (m) at which g tan(psi) has fallen to ``left`` (N)."""
    low = float(settled_contact(cutting, theta)) - 0.003
    high = low + 0.012
    for _ in range(50):
        middle = 0.5 * (low + high)
        view = edge_height(cutting.edge, middle, theta / cutting.moving_blades)
        force = float(cutting.response.force_at(cutting.upper_face_m - view.height))
        low, high = (middle, high) if force * float(view.slope) > left else (low, middle)
    return low + ADVANCE_M


def stroke() -> Drawing:
    """Torque over the opening: the whole stroke, its beginning and its end enlarged."""
    drawing = Drawing(1100, 600, "One stroke: torque over opening, by phase")
    walked = walk_stroke()
    closing = np.arange(len(walked.opening)) < len(walked.opening) // 2
    start = float(walked.opening[np.argmax(walked.phase == "loading")])
    begin, end = (start + 0.5, start - 2.4), (STROKE_DEG[1] + 1.9, STROKE_DEG[1] - 0.12)
    top = 1.12 * float(walked.torque.max())
    _plot(drawing, walked, (80, 50, 990, 200), (STROKE_DEG[0], STROKE_DEG[1] - 0.4), top, 2)
    _plot(drawing, walked, (80, 350, 440, 170), begin, 0.75 * top, 0.5)
    _plot(drawing, walked, (630, 350, 440, 170), end, top, 0.5)
    drawing.text(
        (80, 32),
        "Torque of the material over one stroke (mN m); time runs to the right "
        "while closing, to the left while opening",
        INK,
        15,
    )
    drawing.text((80, 336), "Beginning, enlarged", INK, 15)
    drawing.text((630, 336), "End, enlarged", INK, 15)
    drawing.text((575, 578), "opening (deg)", INK, 14, text_anchor="middle")
    running = closing & (walked.phase == "running")
    labels = (
        (
            (600, 236),
            "running crack: teeth between J_c h and κ J_c h; black: mean torque",
            ORANGE,
            "middle",
        ),
    )
    for at, words, colour, anchor in labels:
        drawing.text(at, words, colour, 15, text_anchor=anchor)
    drawing.text((92, 508), "free", GREY, 15)
    drawing.text((92, 376), "loading: the sheet holds,", GREEN, 15)
    drawing.text((92, 395), "torque follows g(δ)", GREEN, 15)
    drawing.text((512, 508), "running: each tooth is one start", ORANGE, 15, text_anchor="end")
    drawing.text((640, 508), "unloading: torque follows g(δ) back", BLUE, 15)
    assert running.any()
    return drawing


def _plot(
    drawing: Drawing,
    walked: Stroke,
    box: tuple[float, float, float, float],
    span: tuple[float, float],
    top: float,
    tick: float,
) -> None:
    """Draw the part of a stroke between two openings (deg), which fall to the right."""
    x0, y0, wide, tall = box

    def place(opening: float, torque: float) -> Point:
        share = (span[0] - opening) / (span[0] - span[1])
        return x0 + wide * share, y0 + tall * (1.0 - torque / top)

    drawing.parts.append(
        f'<rect x="{x0:g}" y="{y0:g}" width="{wide:g}" height="{tall:g}" fill="#fbfcfd"'
        f' stroke="{PALE}"/>'
    )
    step = 10.0 if top > 25.0 else 5.0
    for value in np.arange(0.0, top, step):
        _, y = place(span[0], float(value))
        drawing.line([(x0, y), (x0 + wide, y)], PALE, 1.0)
        drawing.text((x0 - 8, y + 5), f"{value:g}", GREY, 13, text_anchor="end")
    for value in np.arange(np.ceil(span[1] / tick), np.floor(span[0] / tick) + 1) * tick:
        x, y = place(float(value), 0.0)
        drawing.line([(x, y), (x, y + 5)], GREY, 1.0)
        drawing.text((x, y + 19), f"{value:g}", GREY, 13, text_anchor="middle")
    inside = (walked.opening <= span[0]) & (walked.opening >= span[1])
    changes = np.flatnonzero((walked.phase[1:] != walked.phase[:-1]) | (inside[1:] != inside[:-1]))
    edges = [0, *(changes + 1).tolist(), len(walked.opening)]
    for low, high in pairwise(edges):
        if not inside[low] or high - low < 2:
            continue
        part = slice(low, min(high + 1, len(walked.opening)))
        points = [
            place(float(o), float(t))
            for o, t in zip(walked.opening[part], walked.torque[part], strict=True)
        ]
        drawing.line(_thinned(points), PHASES[str(walked.phase[low])], 1.8)
    half = len(walked.opening) // 2
    steady = inside[:half] & (walked.phase[:half] == "running")
    mean = [
        place(float(o), float(t))
        for o, t in zip(walked.opening[:half][steady], walked.mean[:half][steady], strict=True)
    ]
    drawing.line(_thinned(mean), INK, 1.2)


def _thinned(points: list[Point], apart: float = 0.35) -> list[Point]:
    """Leave out points on straight runs, so that the file stays small; corners are kept."""
    kept = [points[0]]
    for before, point, after in zip(points, points[1:], points[2:], strict=False):
        turn = abs(
            (point[0] - before[0]) * (after[1] - point[1])
            - (point[1] - before[1]) * (after[0] - point[0])
        )
        far = np.hypot(point[0] - kept[-1][0], point[1] - kept[-1][1])
        if turn > apart or far > 6.0:
            kept.append(point)
    return [*kept, points[-1]]
