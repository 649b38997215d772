"""What to record: strokes of empty sweeps and of cuts, places of a camera over its board."""

from itertools import pairwise

import numpy as np
from benchmarks.drawings.canvas import BLUE, GREEN, GREY, INK, ORANGE, PURPLE, Drawing, Point
from benchmarks.drawings.charts import Chart

SPEEDS = (0.1, 0.3, 0.7, 1.5)
RANGE = (0.25, 0.85)


def strokes() -> Drawing:
    """Opening over time: sweeps of several speeds, an excitation, a cut with its release."""
    drawing = Drawing(1100, 640, "Strokes of a good capture: sweeps, excitation, cuts")
    time, opening = _sweeps()
    chart = Chart(drawing, (70, 60, 1000, 190), (0.0, 44.0), (0.1, 1.0))
    chart.axes("time, s", "Empty blades: opening, rad", range(0, 45, 5), (0.25, 0.5, 0.75, 1.0))
    chart.curve(time, opening, BLUE)
    moving = 2.0
    for number, speed in enumerate(SPEEDS):
        taken = 2 * (RANGE[1] - RANGE[0]) / speed
        at = moving + taken / 2 if number < 3 else moving + taken / 2 + 2.0
        height = 0.92 if number < 3 else 0.32
        chart.note(at, height, f"{speed:g} rad/s", INK, text_anchor="middle")
        moving += taken
    chart.note(0.1, 0.14, "idle second: sensor zeros", GREEN)
    chart.note(26.5, 0.14, "excitation: inertia and delay", ORANGE)
    chart.note(37.0, 0.14, "idle second", GREEN)
    cut = Chart(drawing, (70, 360, 1000, 190), (0.0, 44.0), (0.1, 1.0))
    cut.axes(
        "time, s",
        "Material between the blades: opening, rad",
        range(0, 45, 5),
        (0.25, 0.5, 0.75, 1.0),
    )
    for start, speed, release in (
        (1.0, 0.1, True),
        (16.0, 0.1, False),
        (30.0, 0.6, True),
        (37.5, 0.6, False),
    ):
        _one_cut(cut, start, speed, release)
    cut.note(1.0, 0.93, "slow: teeth are resolved; let go of the material on the way", ORANGE)
    cut.note(29.0, 0.93, "fast: the same places at another rate", ORANGE)
    cut.note(14.0, 0.14, "each piece is fresh; never two strokes through one cut", PURPLE)
    drawing.text(
        (70, 622),
        "Speeds over a factor of ten, both directions, the same places each time, "
        "an idle second at both ends.",
        GREY,
        14,
    )
    return drawing


def _sweeps() -> tuple[list[float], list[float]]:
    points: list[Point] = [(0.0, RANGE[1]), (2.0, RANGE[1])]
    for speed in SPEEDS:
        taken = (RANGE[1] - RANGE[0]) / speed
        points.append((points[-1][0] + taken, RANGE[0]))
        points.append((points[-1][0] + taken, RANGE[1]))
    begin = points[-1][0] + 1.0
    points.append((begin, RANGE[1]))
    wave = np.linspace(0.0, 9.0, 700)
    swing = 0.75 - 0.1 * np.sin(2 * np.pi * (0.5 * wave + 0.12 * wave**2)) * np.sin(
        np.pi * wave / 9
    )
    points += [(begin + 0.6 + float(t), float(y)) for t, y in zip(wave, swing, strict=True)]
    points += [(begin + 10.2, 0.75), (44.0, 0.75)]
    return [p[0] for p in points], [p[1] for p in points]


def _one_cut(chart: Chart, start: float, speed: float, release: bool) -> None:
    """A closing stroke, with the material released half way or at its end, and the way back."""
    turns = (0.85, 0.55, 0.66, 0.3) if release else (0.85, 0.3)
    points = [(start, turns[0])]
    for before, after in pairwise(turns):
        points.append((points[-1][0] + abs(after - before) / speed, after))
    chart.curve([p[0] for p in points], [p[1] for p in points], BLUE)
    back = [points[-1], (points[-1][0] + 0.55 / 0.9, 0.85)]
    chart.curve([p[0] for p in back], [p[1] for p in back], GREY, 1.5, stroke_dasharray="4 4")


def camera_places() -> Drawing:
    """Where to hold the camera over a board, seen from the side and as the picture's field."""
    drawing = Drawing(1100, 460, "Where to hold the camera")
    drawing.text((40, 34), "From the side", INK, 16, font_weight="bold")
    drawing.line([(60, 400), (560, 400)], INK, 4)
    drawing.text((310, 426), "camera board, flat and stiff", GREY, 14, text_anchor="middle")
    centre = (310.0, 400.0)
    for degrees, distance, colour in (
        (90, 330, BLUE),
        (90, 150, BLUE),
        (55, 240, ORANGE),
        (125, 240, ORANGE),
        (66, 320, ORANGE),
        (114, 320, ORANGE),
    ):
        _camera(drawing, centre, np.radians(degrees), distance, colour)
    drawing.text((330, 66), "far", BLUE, 14)
    drawing.text((330, 246), "near", BLUE, 14)
    drawing.text((470, 196), "tilted by 20 to 45°,", ORANGE, 14)
    drawing.text((470, 214), "to every side", ORANGE, 14)
    drawing.text(
        (620, 34), "In the picture: the board in every corner", INK, 16, font_weight="bold"
    )
    for row in range(3):
        for column in range(3):
            x, y = 620 + 150 * column, 56 + 112 * row
            drawing.area([(x, y), (x + 136, y), (x + 136, y + 98), (x, y + 98)], "#f3f5f7", GREY)
            left, top = x + 6 + 36 * column, y + 6 + 22 * row
            tilt = 8 * (column - 1)
            drawing.area(
                [
                    (left, top + max(tilt, 0)),
                    (left + 52, top + max(-tilt, 0)),
                    (left + 52, top + 42 - max(-tilt, 0)),
                    (left, top + 42 - max(tilt, 0)),
                ],
                "#ffffff",
                INK,
            )
            drawing.dot((left + 26, top + 21), 3, BLUE)
    drawing.text(
        (620, 424),
        "15 photographs; fixed focus and zoom; always upright, or always sideways",
        GREY,
        14,
    )
    return drawing


def _camera(drawing: Drawing, centre: Point, angle: float, distance: float, colour: str) -> None:
    x, y = centre[0] + distance * float(np.cos(angle)), centre[1] - distance * float(np.sin(angle))
    drawing.arrow(
        [(x, y), (centre[0] + 0.16 * (x - centre[0]), centre[1] + 0.16 * (y - centre[1]))],
        colour,
        1.2,
    )
    ux, uy = float(np.cos(angle)), -float(np.sin(angle))
    corners = [
        (x + a * ux - b * uy, y + a * uy + b * ux)
        for a, b in ((0, -13), (22, -13), (22, 13), (0, 13))
    ]
    drawing.area(corners, "#ffffff", colour, stroke_width="2")
    drawing.dot((x, y), 5, colour)


def speeds() -> Drawing:
    """Sweeps of one speed against sweeps over a decade: what each tells of friction."""
    drawing = Drawing(1100, 330, "One speed does not tell Coulomb from viscous friction")
    for left, speeds, words in (
        (70, (0.4,), "one speed: any slope passes through it"),
        (620, (0.1, 0.3, 0.7, 1.5), "a decade of speeds: one law"),
    ):
        chart = Chart(drawing, (left, 50, 420, 210), (0.0, 1.6), (0.0, 30.0))
        chart.axes("rate, rad/s", "friction, mN m", (0, 0.5, 1.0, 1.5), (0, 10, 20, 30))
        if len(speeds) == 1:
            for viscous, dash in ((0.0, "5 4"), (4.0, "5 4"), (9.0, "5 4")):
                level = 17.0 - viscous * 0.4
                chart.curve(
                    (0.02, 1.55),
                    (level + 0.02 * viscous, level + 1.55 * viscous),
                    ORANGE,
                    1.5,
                    stroke_dasharray=dash,
                )
        else:
            rates = np.linspace(0.02, 1.55, 80)
            chart.curve(rates, 14.0 + 4.0 * np.exp(-((rates / 0.12) ** 2)) + 4.0 * rates, BLUE)
        for speed in speeds:
            level = (
                17.0
                if len(speeds) == 1
                else 14.0 + 4.0 * np.exp(-((speed / 0.12) ** 2)) + 4.0 * speed
            )
            drawing.dot(chart.at(speed, level), 5, INK)
        chart.note(0.05, 27.5, words, GREY)
    return drawing
