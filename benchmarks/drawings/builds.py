"""Mechanics and wiring of the builds: plan and section in mm, boxes with the pins between."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

from benchmarks.drawings.canvas import (
    BLUE,
    GREEN,
    GREY,
    INK,
    ORANGE,
    PALE,
    PURPLE,
    STEEL,
    Drawing,
    Point,
)

SCALE = 3.1
"""Points a millimetre."""
PIVOT: Point = (330.0, 330.0)
OPENING = math.radians(30.0)
"""At which the blades are drawn."""
LOW, HIGH = math.radians(8.0), math.radians(55.0)
BLADE, HANDLE, SECTOR = 75.0, 60.0, 60.0
SECTOR_FROM, SECTOR_TO = math.radians(88.0), math.radians(165.0)
"""Where the sector begins and ends, from the moving blade."""
DRUM_AT = math.radians(150.0)
"""Where the cable meets the drum, from the fixed blade."""
CABLE = 0.8


@dataclass(frozen=True)
class Mechanics:
    """Lengths in mm; ``drum`` is a diameter, ``encoder_at`` where the encoder sits."""

    title: str
    drum: float
    motor: float
    motor_length: float
    bearing: str
    encoder_at: str
    plate: str


COURSE = Mechanics(
    "Mechanics of the course build", 12.0, 25.0, 55.0, "2 x 608 (8 x 22 x 7)",
    "encoder on the motor's rear shaft", "base plate 280 x 180 x 10, plywood",
)  # fmt: skip
LAB = Mechanics(
    "Mechanics of the lab build", 12.0, 25.0, 55.0, "2 x 608 (8 x 22 x 7), preloaded",
    "encoder on the motor's rear shaft", "base plate 280 x 180 x 10, aluminium",
)  # fmt: skip
BEST = Mechanics(
    "Mechanics of the best build", 20.0, 35.0, 71.0, "2 angular contact, 8 x 22 x 7, preloaded",
    "encoder on the motor's rear shaft", "base plate 280 x 180 x 12, aluminium",
)  # fmt: skip


def _at(radius: float, angle: float) -> Point:
    return (
        PIVOT[0] + SCALE * radius * math.cos(angle),
        PIVOT[1] - SCALE * radius * math.sin(angle),
    )


def mechanics(build: Mechanics) -> Drawing:
    """Draw the plan with its dimensions, and the section through the pivot and the motor."""
    drawing = Drawing(1150, 640, build.title)
    drawing.text((24, 34), f"{build.title}: plan, in mm", INK, 18, font_weight="bold")
    _blades(drawing)
    _sector(drawing, build)
    _stops(drawing)
    _dimensions(drawing, build)
    _section(drawing, build)
    return drawing


def _blades(drawing: Drawing) -> None:
    fixed = [_at(BLADE, 0.0), _at(16.0, -0.55), _at(16.0, math.pi + 0.55), _at(40.0, math.pi)]
    drawing.area(fixed, STEEL, INK)
    handle = OPENING + math.pi
    moving = [_at(BLADE, OPENING), _at(12.0, OPENING + 0.7), _at(HANDLE + 14, handle - 0.1),
              _at(HANDLE + 14, handle + 0.1), _at(12.0, OPENING - 0.7)]  # fmt: skip
    drawing.area(moving, PALE, INK)
    drawing.dot(_at(HANDLE, handle), 0.5 * 22 * SCALE, "#ffffff", INK)
    x, y = _at(BLADE, OPENING)
    drawing.text((x + 8, y + 14), "moving blade, 75", INK, 14)
    x, y = _at(BLADE, 0.0)
    drawing.text((x - 110, y + 44), "fixed blade, 75", INK, 14)


def _sector(drawing: Drawing, build: Mechanics) -> None:
    angles = [SECTOR_FROM + OPENING + (SECTOR_TO - SECTOR_FROM) * i / 30 for i in range(31)]
    rim = [_at(SECTOR, angle) for angle in angles]
    drawing.area([*rim, _at(10.0, angles[-1]), _at(10.0, angles[0])], "#dcebdf", GREEN)
    drawing.dot(PIVOT, 0.5 * 22 * SCALE * 0.5, "#ffffff", INK)
    drawing.dot(PIVOT, 0.5 * 8 * SCALE, GREY, INK)
    centre = _at(SECTOR + 0.5 * build.drum, DRUM_AT)
    drawing.dot(centre, 0.5 * build.motor * SCALE, "#ffffff", GREY)
    drawing.dot(centre, 0.5 * build.drum * SCALE, "#f0d9c4", ORANGE)
    for end in (angles[0], angles[-1]):
        drawing.dot(_at(SECTOR - 5.0, end + (0.06 if end == angles[0] else -0.06)), 4.0, ORANGE)
    drawing.line(rim, ORANGE, 2.2, stroke_dasharray="7 4")
    x, y = centre
    drawing.text(
        (x - 20, y - 0.5 * build.motor * SCALE - 10),
        "motor, drum",
        ORANGE,
        14,
        text_anchor="middle",
    )
    x, y = _at(SECTOR - 20, SECTOR_FROM + OPENING + 0.35)
    drawing.text((x - 12, y), "sector", GREEN, 14)
    x, y = _at(SECTOR + 3, SECTOR_FROM + OPENING + 0.1)
    drawing.text((x, y - 26), "cable 0.8, three turns on the drum,", ORANGE, 14)
    drawing.text((x, y - 8), "pinned at one end, spring-loaded at the other", ORANGE, 14)


def _stops(drawing: Drawing) -> None:
    for angle, name in ((LOW, "closed stop, 8 deg"), (HIGH, "open stop, 55 deg")):
        drawing.dot(_at(48.0, angle), 7.0, PURPLE)
        x, y = _at(52.0, angle)
        drawing.text((x + 8, y + (16 if angle == LOW else -6)), name, PURPLE, 14)
        drawing.line([_at(14.0, angle), _at(46.0, angle)], PURPLE, 1.0, stroke_dasharray="3 4")


def _dimensions(drawing: Drawing, build: Mechanics) -> None:
    radius = 0.5 * build.drum
    distance = SECTOR + radius
    drawing.measure(PIVOT, _at(distance, DRUM_AT), INK)
    x, y = _at(0.55 * distance, DRUM_AT)
    _tag(drawing, (x, y), f"{distance:g}")
    handle = OPENING + math.pi
    drawing.measure(PIVOT, _at(HANDLE, handle), BLUE)
    _tag(drawing, _at(0.6 * HANDLE, handle), "R 60", BLUE)
    rows = [
        f"ratio {2 * SECTOR / build.drum:g} : 1 = sector's radius 60 over the drum's {radius:g}",
        f"turn the drum to {build.drum - CABLE:g}, the sector's groove to {2 * SECTOR - CABLE:g}: "
        "the cable's middle line then has the radii of the ratio",
        f"pivot to motor's axis {distance:g}; pivot's bearings {build.bearing}",
        "stop pins, diameter 6, 48 from the pivot; they take the blow, not the cable",
        f"handle: finger ring 22, {HANDLE:g} from the pivot (rig.handle_radius_mm)",
        f"{build.plate}; home: the open stop",
    ]
    for number, words in enumerate(rows):
        drawing.text((24, 520 + 20 * number), words, INK, 14)


def _tag(drawing: Drawing, at: Point, words: str, colour: str = INK) -> None:
    x, y = at
    wide = 9.0 * len(words) + 8
    corners = [
        (x - wide / 2, y - 10),
        (x + wide / 2, y - 10),
        (x + wide / 2, y + 10),
        (x - wide / 2, y + 10),
    ]
    drawing.area(corners, "#ffffff")
    drawing.text((x, y + 5), words, colour, 14, text_anchor="middle")


def _section(drawing: Drawing, build: Mechanics) -> None:
    left, top, scale = 760.0, 190.0, 2.2
    drawing.text((700, 34), "Section through pivot and motor", INK, 18, font_weight="bold")
    distance = SECTOR + 0.5 * build.drum

    def rect(x: float, y: float, w: float, h: float, fill: str, stroke: str = INK) -> None:
        a, b = left + scale * x, top + scale * y
        c, d = a + scale * w, b + scale * h
        drawing.area([(a, b), (c, b), (c, d), (a, d)], fill, stroke)

    rect(-22, 20, distance + 60, 10, PALE)
    rect(-4, -16, 8, 56, GREY)
    rect(-11, 21.5, 22, 7, "#ffffff")
    rect(-20, -2, 40, 3, STEEL)
    rect(-20, 2.5, 40, 3, PALE)
    rect(-6, 8, SECTOR + 6, 8, "#dcebdf", GREEN)
    rect(distance - build.drum / 2, 4, build.drum, 15, "#f0d9c4", ORANGE)
    rect(distance - build.motor / 2, 30, build.motor, build.motor_length, "#ffffff", INK)
    rect(distance - 14, 30 + build.motor_length, 28, 10, "#e3ecf7", BLUE)

    def point(x: float, y: float) -> Point:
        return (left + scale * x, top + scale * y)

    def note(x: float, y: float, words: str, colour: str = INK, anchor: str = "start") -> None:
        drawing.text(point(x, y), words, colour, 14, text_anchor=anchor)

    note(8, -24, "shaft 8, blades 3")
    note(24, 2, "sector, 8", GREEN)
    note(distance + build.drum / 2 + 4, 12, "drum, 15", ORANGE)
    note(-22, 50, "bearings in the plate", INK)
    note(distance - build.motor / 2 - 4, 60, f"motor {build.motor:g},", INK, "end")
    note(distance - build.motor / 2 - 4, 68, f"{build.motor_length:g} long", INK, "end")
    note(distance + 20, 30 + build.motor_length + 24, build.encoder_at, BLUE, "end")
    drawing.measure(point(0, -36), point(distance, -36))
    _tag(drawing, point(distance / 2, -36), f"{distance:g}")
    for x in (0.0, distance):
        drawing.line(
            [point(x, -40), point(x, -18 if x == 0.0 else 2)], GREY, 1.0, stroke_dasharray="3 4"
        )


@dataclass(frozen=True)
class Wiring:
    """What is written into the boxes and on the lines between them."""

    title: str
    supply: Sequence[str]
    driver: Sequence[str]
    motor: Sequence[str]
    current: Sequence[str]
    controller: Sequence[str]
    encoder: Sequence[str]
    home: Sequence[str]
    computer: Sequence[str]
    to_driver: str
    from_current: str
    from_encoder: str
    from_stop: str
    to_computer: str
    force: Sequence[str] = ()
    from_force: str = ""


STOP = ("latching, two contacts:", "one breaks the supply,", "one tells the controller")


def wiring(build: Wiring) -> Drawing:
    """Draw the boxes; power is orange, signals are blue, what turns together is grey."""
    drawing = Drawing(1150, 640, build.title)
    drawing.text((24, 34), build.title, INK, 18, font_weight="bold")
    drawing.box((24, 60), (190, 100), "supply", build.supply, ORANGE)
    drawing.box((290, 60), (190, 100), "stop button", STOP, ORANGE)
    drawing.box((560, 60), (220, 100), "driver", build.driver, ORANGE)
    drawing.box((900, 60), (220, 100), "motor", build.motor, INK)
    drawing.box((560, 220), (220, 84), "current sensor", build.current, BLUE)
    drawing.box((330, 380), (450, 130), "controller", build.controller, BLUE)
    drawing.box((900, 320), (220, 84), "encoder", build.encoder, BLUE)
    drawing.box((900, 440), (220, 84), "home", build.home, BLUE)
    drawing.box((24, 395), (190, 100), "computer", build.computer, INK)
    for a, b, words in ((214, 290, "+"), (480, 560, "+"), (780, 900, "two leads, twisted")):
        drawing.arrow([(a, 110), (b, 110)], ORANGE, 2.4)
        if words != "+":
            drawing.text(((a + b) / 2, 98), words, ORANGE, 13, text_anchor="middle")
    drawing.arrow([(700, 160), (700, 220)], BLUE)
    _label(drawing, (712, 194), "of the motor alone")
    drawing.arrow([(700, 304), (700, 380)], BLUE)
    _label(drawing, (712, 348), build.from_current)
    drawing.arrow([(520, 380), (520, 200), (600, 200), (600, 160)], BLUE)
    _label(drawing, (508, 290), build.to_driver, "end")
    drawing.arrow([(345, 160), (345, 380)], BLUE)
    _label(drawing, (333, 270), build.from_stop, "end")
    drawing.arrow([(900, 362), (840, 362), (840, 420), (780, 420)], BLUE)
    _label(drawing, (890, 354), build.from_encoder, "end")
    drawing.line([(1010, 160), (1010, 320)], GREY, 3.0, stroke_dasharray="6 5")
    _label(drawing, (1022, 245), "on its shaft", "start", GREY)
    drawing.arrow([(214, 432), (330, 432)], BLUE)
    drawing.arrow([(330, 462), (214, 462)], BLUE)
    _label(drawing, (272, 420), build.to_computer, "middle")
    if build.force:
        drawing.box((24, 540), (430, 66), "handle force", build.force, BLUE)
        drawing.arrow([(454, 573), (555, 573), (555, 510)], BLUE)
        _label(drawing, (566, 548), build.from_force)
    drawing.text(
        (1126, 600),
        "orange: power; blue: signals; one ground, joined at the driver",
        GREY,
        13,
        text_anchor="end",
    )
    return drawing


def _label(
    drawing: Drawing, at: Point, words: str, anchor: str = "start", colour: str = BLUE
) -> None:
    drawing.text(at, words, colour, 13, text_anchor=anchor)
