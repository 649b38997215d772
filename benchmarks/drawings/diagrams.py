"""Boxes and arrows: which file goes where, and the modes of the servo loop."""

from benchmarks.drawings.canvas import (
    BLUE,
    GREEN,
    GREY,
    INK,
    ORANGE,
    PALE,
    PURPLE,
    Drawing,
    Point,
)


def dataflow() -> Drawing:
    """Show which file each command reads and writes."""
    drawing = Drawing(1100, 500, "Data flow: captures to fits to report and package to the loop")
    wide, tall = 176.0, 84.0
    recipe = ["rig, material, scene, limits, priors; decides which steps are needed ('plan')"]
    drawing.box((24.0, 18.0), (1052, 60), "recipe.toml", recipe, GREY)
    columns = (24.0, 243.0, 462.0, 681.0, 900.0)
    above, below = 160.0, 330.0
    boxes: dict[str, tuple[Point, str, list[str], str]] = {
        "rig": ((columns[0], above), "rig or sim", ["empty strokes,", "cuts"], BLUE),
        "camera": (
            (columns[0], below),
            "camera or sim",
            ["board, blade,", "plate, rig card"],
            BLUE,
        ),
        "mcap": ((columns[1], above), "captures/*.mcap", ["samples at 1 kHz,", "strokes"], INK),
        "photos": ((columns[1], below), "captures/<kind>-*/", ["photographs,", "corners"], INK),
        "fits": (
            (columns[2], above),
            "fits: friction, cut",
            ["posterior draws,", "verdicts"],
            GREEN,
        ),
        "geometry": (
            (columns[2], below),
            "fits: blade, plate, ...",
            ["edge and pose with", "their covariance"],
            GREEN,
        ),
        "report": (
            (columns[3], above),
            "report/report.html",
            ["review, then sign:", "signature.json"],
            PURPLE,
        ),
        "verify": (
            (columns[3], below),
            "fits/*.verify.json",
            ["coverage in", "simulated refits"],
            PURPLE,
        ),
        "package": (
            (columns[4], above),
            "package/*.zip",
            ["tables with an error", "bound, draws"],
            ORANGE,
        ),
        "loop": (
            (columns[4], below),
            "servo loop (C)",
            ["answers each frame", "of the rig"],
            ORANGE,
        ),
    }
    for at, title, lines, colour in boxes.values():
        drawing.box(at, (wide, tall), title, lines, colour)
    level = {"above": above + tall / 2, "below": below + tall / 2}
    for column, row, words in (
        (0, "above", "capture"),
        (1, "above", "fit"),
        (2, "above", "report"),
        (3, "above", "sign"),
        (0, "below", "capture"),
        (1, "below", "fit"),
    ):
        x0, x1, y = columns[column] + wide, columns[column + 1], level[row]
        drawing.arrow([(x0 + 2, y), (x1 - 2, y)], INK)
        at = ((x0 + x1) / 2, y - tall / 2 - 8)
        drawing.text(at, words, INK, 14, text_anchor="middle", font_style="italic")
    middle = columns[2] + wide / 2
    drawing.arrow([(middle - 30, below - 2), (middle - 30, above + tall + 2)], INK)
    drawing.text((middle - 38, below - 38), "edge", INK, 14, text_anchor="end", font_style="italic")
    bend = above + tall + 34
    drawing.arrow(
        [
            (middle + 40, above + tall + 2),
            (middle + 40, bend),
            (columns[3] + 50, bend),
            (columns[3] + 50, below - 2),
        ],
        INK,
    )
    drawing.text(
        (columns[2] + wide + 20, bend + 20),
        "verify",
        INK,
        14,
        font_style="italic",
        text_anchor="middle",
    )
    up = columns[3] + 126
    drawing.arrow([(up, below - 2), (up, above + tall + 2)], INK)
    down = columns[4] + wide / 2
    drawing.arrow(
        [
            (middle + 40, above - 2),
            (middle + 40, above - 40),
            (down, above - 40),
            (down, above - 2),
        ],
        INK,
    )
    drawing.text(
        (columns[3] + wide / 2, above - 48),
        "package build",
        INK,
        14,
        text_anchor="middle",
        font_style="italic",
    )
    drawing.arrow([(down, above + tall + 2), (down, below - 2)], INK)
    drawing.text((down - 8, below - 38), "render", INK, 14, text_anchor="end", font_style="italic")
    foot = below + tall + 44
    drawing.arrow(
        [
            (down, below + tall + 2),
            (down, foot),
            (12, foot),
            (12, level["above"]),
            (22, level["above"]),
        ],
        ORANGE,
    )
    drawing.text(
        (middle, foot - 9),
        "torque and force commands, one per frame",
        ORANGE,
        15,
        text_anchor="middle",
    )
    drawing.arrow([(middle - 40, 78), (middle - 40, above - 2)], GREY, 1.4)
    return drawing


def loop() -> Drawing:
    """Show the modes of the servo (kernel/c/sc_servo.h) and what changes them."""
    drawing = Drawing(1100, 560, "Modes of the servo loop and the transitions between them")
    size = (210.0, 82.0)
    boxes = {
        "idle": ((40.0, 60.0), "IDLE", ["motors off", "zero commands, no ENABLE"], GREY),
        "track": ((330.0, 60.0), "TRACK", ["PID on a reference", "of opening and advance"], BLUE),
        "render": (
            (620.0, 60.0),
            "RENDER, CONTROL",
            ["torque of the model; force on", "a surface; both from 0"],
            GREEN,
        ),
        "damp": ((475.0, 270.0), "DAMP", ["torque = -b · rate,", "no force"], PURPLE),
        "fault": ((40.0, 270.0), "FAULT", ["zero torque, CLEAR_FAULT;", "integrals reset"], ORANGE),
        "stop": (
            (475.0, 450.0),
            "STOP (latched)",
            ["motors off until the loop", "is started anew"],
            "#B00020",
        ),
    }
    drawing.parts.append(
        f'<rect x="20" y="22" width="850" height="140" rx="12" fill="#f4f7fa" stroke="{PALE}"/>'
    )
    drawing.text(
        (34, 44), "An order of the supervisor engages any mode, from any mode (DAMP too)", INK, 14
    )
    for at, title, lines, colour in boxes.values():
        drawing.box(at, size, title, lines, colour)
    for x in (252.0, 542.0):
        drawing.measure((x, 101), (x + 76, 101))
    drawing.arrow([(460, 142), (520, 268)], INK)
    drawing.arrow([(700, 142), (640, 268)], INK)
    drawing.text((694, 214), "supervisor silent for", INK, 14)
    drawing.text((694, 232), "supervisor_ms; when it beats", INK, 14)
    drawing.text((694, 250), "again, RENDER ramps up", INK, 14)
    drawing.arrow([(580, 352), (580, 448)], INK)
    drawing.text((594, 396), "supervisor silent five times as long", INK, 14)
    drawing.text((594, 414), "(from every mode)", INK, 14)
    drawing.arrow([(120, 162), (120, 268)], INK)
    drawing.text((112, 216), "device latched", INK, 14, text_anchor="end")
    drawing.text((112, 233), "a fault", INK, 14, text_anchor="end")
    drawing.arrow([(190, 268), (190, 164)], INK)
    drawing.text((200, 206), "fault cleared: the mode goes on,", INK, 14)
    drawing.text((200, 223), "force ramps up again, the", INK, 14)
    drawing.text((200, 240), "reference has waited", INK, 14)
    drawing.arrow([(145, 352), (145, 491), (473, 491)], INK)
    drawing.text((157, 440), "more than fault_clearings faults, or", INK, 14)
    drawing.text((157, 457), "100 CLEAR_FAULT sent for one;", INK, 14)
    drawing.text((157, 474), "encoder fault: at once", INK, 14)
    drawing.arrow([(870, 92), (955, 92), (955, 491), (687, 491)], INK)
    for number, words in enumerate(
        (
            "From every mode:",
            "stop asked for",
            "no frame for 1 s",
            "line error, hang-up",
            "unsound orders",
            "a watch of the list",
            "in docs/loop.md",
            "From TRACK:",
            "error beyond its limit",
        )
    ):
        drawing.text((970, 160 + 19 * number), words, INK, 14 if words.endswith(":") else 13)
    drawing.text(
        (40, 548),
        "Every command passes the same limits: torque, force and their slew "
        "rates; a number that is not finite becomes 0.",
        GREY,
        14,
    )
    return drawing
