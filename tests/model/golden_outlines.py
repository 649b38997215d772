"""Golden vectors of drawn plates: outlines, and the pieces on the line of the cut.

``python -m tests.model.golden_outlines`` writes them anew. What is wanted is worked out here from
closed forms, not by the code that is tested: Python and TypeScript are both held to it.
"""

import json
import math
from pathlib import Path
from typing import Any

FILE = Path(__file__).parents[1] / "golden" / "outlines.json"
THIN, THICK = 0.1, 0.25
EXACT_MM = 1e-9

Outline = list[list[float]]


def box(x0: float, x1: float, low: float = -10.0, high: float = 10.0) -> Outline:
    return [[x0, low], [x1, low], [x1, high], [x0, high]]


def circle(x: float, y: float, radius: float, corners: int = 360) -> Outline:
    """A polygon with corners at whole shares of a turn, the lowest and the highest among them."""
    turn = [2.0 * math.pi * k / corners for k in range(corners)]
    return [[x + radius * math.cos(a), y + radius * math.sin(a)] for a in turn]


def layer(outline: Outline, thickness: float = THIN, **more: Any) -> dict[str, Any]:
    plain = {"name": "sheet", "thickness_mm": thickness, "toughness_ratio": 1.0}
    return {**plain, "outline": outline, "holes": [], "regions": [], **more}


def region(ratio: float, outline: Outline) -> dict[str, Any]:
    return {"toughness_ratio": ratio, "outline": outline}


def piece(begin: float, *strips: float, top: float = THIN, thick: float = THIN) -> list[float]:
    """Begin, top, thickness, then end and ratio of each strip."""
    return [begin, top, thick, *strips]


def case(
    title: str,
    layers: list[dict[str, Any]],
    pieces: list[list[float]] | None,
    cut: float = 0.0,
    tolerance: float = EXACT_MM,
) -> dict[str, Any]:
    """``pieces`` of None: the drawing is refused."""
    return {
        "title": title,
        "tolerance_mm": tolerance,
        "drawn": {"cut_line_mm": cut, "layers": layers, "edge": None, "edge_points": []},
        "pieces": pieces,
    }


SHEET = box(0, 80)
WHOLE = piece(0, 80, 1)


def contours() -> list[dict[str, Any]]:
    triangle = [[0.0, 0.0], [40.0, 0.0], [10.0, 20.0]]
    corner = 5.0 * math.cos(math.pi / 6.0)
    notch = [[40.0, 10.0], [40.0, -5.0], [20.0, -5.0], [20.0, 10.0]]
    fork = [*box(0, 60)[:3], *notch, box(0, 60)[3]]
    flat = 5.0 * (1.0 - math.cos(math.pi / 360.0))  # of a circle, off its polygon
    return [
        case("a rectangle", [layer(SHEET)], [WHOLE]),
        case("turned the other way", [layer(SHEET[::-1])], [WHOLE]),
        case("a side on the line, material above", [layer(box(0, 80, 0, 10))], [WHOLE]),
        case("a side on the line, material below", [layer(box(0, 80, -10, 0))], None),
        case("the line misses it", [layer(SHEET)], None, cut=10.5),
        case("a triangle at a quarter", [layer(triangle)], [piece(2.5, 32.5, 1)], cut=5.0),
        case("a triangle at its base", [layer(triangle)], [piece(0.0, 40.0, 1)]),
        case("a triangle at its tip", [layer(triangle)], None, cut=20.0),
        case("a notch", [layer(fork)], [piece(0, 20, 1), piece(40, 60, 1)]),
        case("below a notch", [layer(fork)], [piece(0, 60, 1)], cut=-7.5),
        case(
            "the chord of a circle through corners of its polygon",
            [layer(circle(20, 0, 5))],
            [piece(20.0 - corner, 20.0 + corner, 1)],
            cut=2.5,
        ),
        case(
            "the chord of a circle, 3-4-5",
            [layer(circle(20, 0, 5))],
            [piece(16.0, 24.0, 1)],
            cut=3.0,
            tolerance=flat * 5.0 / 4.0,
        ),
    ]


def holes() -> list[dict[str, Any]]:
    depth = 0.1
    half = math.sqrt(2.0 * 5.0 * depth - depth**2)
    flat = 5.0 * (1.0 - math.cos(math.pi / 360.0))
    grazing = [circle(40, 5.0 - depth, 5)]

    def sheet(*found: Outline, **more: Any) -> list[dict[str, Any]]:
        return [layer(SHEET, holes=list(found), **more)]

    return [
        case("a hole", sheet(box(30, 40, -3, 3)), [piece(0, 30, 1), piece(40, 80, 1)]),
        case("a hole beside the line", sheet(box(30, 40, 1, 3)), [WHOLE]),
        case("a hole that ends on the line from below", sheet(box(30, 40, -3, 0)), [WHOLE]),
        case(
            "a hole that begins on the line",
            sheet(box(30, 40, 0, 3)),
            [piece(0, 30, 1), piece(40, 80, 1)],
        ),
        case("a round hole that touches from above", sheet(circle(40, 5, 5)), [WHOLE]),
        case("a round hole that touches from below", sheet(circle(40, -5, 5)), [WHOLE]),
        case(
            "a round hole that the line grazes by 0.1 mm",
            sheet(*grazing),
            [piece(0, 40.0 - half, 1), piece(40.0 + half, 80, 1)],
            tolerance=flat * 5.0 / half * 1.1,
        ),
        case("a gap of 0.008 mm is none", sheet(box(40, 40.008, -3, 3)), [WHOLE]),
        case(
            "a gap of 0.02 mm is one",
            sheet(box(40, 40.02, -3, 3)),
            [piece(0, 40, 1), piece(40.02, 80, 1)],
        ),
        case("a stretch of 0.008 mm is none", sheet(box(0.008, 40)), [piece(40, 80, 1)]),
        case(
            "holes that overlap are one gap",
            sheet(box(30, 40), box(35, 50)),
            [piece(0, 30, 1), piece(50, 80, 1)],
        ),
        case("a hole beyond the end shortens the sheet", sheet(box(70, 90)), [piece(0, 70, 1)]),
        case("a hole takes all of it", sheet(box(-1, 81)), None),
    ]


def stacks() -> list[dict[str, Any]]:
    upper = layer(box(20, 40), THICK, name="upper")
    on_lower = piece(20, 40, 1, top=THIN + THICK, thick=THICK)
    third = layer(box(30, 60), 0.5, name="third")
    on_both = piece(30, 60, 1, top=THIN + THICK + 0.5, thick=0.5)
    beside = layer(box(80, 90), THICK, name="beside")
    holed = layer(SHEET, holes=[box(15, 45)])
    parts = [piece(0, 15, 1), piece(45, 80, 1)]
    return [
        case("a layer on a sheet", [layer(SHEET), upper], [WHOLE, on_lower]),
        case("three, the last on the highest", [layer(SHEET), upper, third],
             [WHOLE, on_lower, on_both]),
        case("side by side", [layer(SHEET), beside],
             [WHOLE, piece(80, 90, 1, top=THICK, thick=THICK)]),
        case("in a hole it lies on the ground", [holed, upper],
             [*parts, piece(20, 40, 1, top=THICK, thick=THICK)]),
        case("over both sides of a hole", [holed, layer(box(10, 50), THICK, name="upper")],
             [*parts, piece(10, 50, 1, top=THIN + THICK, thick=THICK)]),
        case("apart on the line, above each other beside it",
             [layer(SHEET), layer(box(20, 40, 1, 5), name="upper")], None),
    ]  # fmt: skip


def toughness() -> list[dict[str, Any]]:
    slanted = [[20.0, -10.0], [40.0, -10.0], [40.0, 10.0], [24.0, 10.0]]

    def sheet(*found: dict[str, Any], **more: Any) -> list[dict[str, Any]]:
        return [layer(SHEET, regions=list(found), **more)]

    return [
        case("a band", sheet(region(3, box(20, 30))), [piece(0, 20, 1, 30, 3, 80, 1)]),
        case("in place of the layer's own", sheet(region(3, box(20, 30)), toughness_ratio=0.5),
             [piece(0, 20, 0.5, 30, 3, 80, 0.5)]),
        case("a slanted border", sheet(region(3, slanted)), [piece(0, 23, 1, 40, 3, 80, 1)],
             cut=5.0),
        case("across a hole", sheet(region(3, box(20, 60)), holes=[box(30, 40)]),
             [piece(0, 20, 1, 30, 3), piece(40, 60, 3, 80, 1)]),
        case("beyond the sheet", sheet(region(3, box(70, 99))), [piece(0, 70, 1, 80, 3)]),
        case("two that touch", sheet(region(3, box(20, 30)), region(2, box(30, 40))),
             [piece(0, 20, 1, 30, 3, 40, 2, 80, 1)]),
        case("two of one toughness that touch",
             sheet(region(3, box(20, 30)), region(3, box(30, 40))),
             [piece(0, 20, 1, 40, 3, 80, 1)]),
        case("two that overlap", sheet(region(3, box(20, 30)), region(2, box(25, 40))), None),
        case("two that overlap beside the line",
             sheet(region(3, box(20, 30)), region(2, box(25, 40, 1, 5))),
             [piece(0, 20, 1, 30, 3, 80, 1)]),
        case("as tough as the sheet", sheet(region(1, box(20, 30))), [WHOLE]),
    ]  # fmt: skip


def files() -> list[dict[str, Any]]:
    """SVG files and the ids of their shapes; of None: the file is refused."""
    head = '<svg xmlns="http://www.w3.org/2000/svg" width="80mm" height="60mm" viewBox="0 0 80 60">'

    def file(title: str, inner: str, shapes: str | None) -> dict[str, Any]:
        for name in "abc":
            inner = inner.replace(f"<{name}", f'<rect id="{name}" width="8" height="4"')
        return {
            "title": title,
            "text": f"{head}{inner}</svg>",
            "shapes": None if shapes is None else list(shapes),
        }

    return [
        file("nothing hidden", "<a/><g><b/></g>", "ab"),
        file("display none", '<a display="none"/><b/>', "b"),
        file("a group with display none", '<g display="none"><a display="inline"/></g><b/>', "b"),
        file("display none in a style", '<a style="fill:red; display: none"/><b/>', "b"),
        file("a style is above an attribute", '<a display="none" style="display:inline"/>', "a"),
        file("an important style", '<a style="DISPLAY:none !important"/><b/>', "b"),
        file("a comment before a style", '<a style="/* x */display:none"/><b/>', "b"),
        file("a comment with a semicolon",
             '<a style="fill:red;/* ; */display:/**/none"/><b/>', "b"),
        file("a style that is all comment", '<a style="/* display:none; */fill:red"/>', "a"),
        file("another property that ends alike",
             "<style>.x { backface-visibility: hidden; --display: none }</style><a/>", "a"),
        file("hidden", '<a visibility="hidden"/><b visibility="collapse"/><c/>', "c"),
        file("a hidden group", '<g visibility="hidden"><a/><g><b/></g></g><c/>', "c"),
        file("visible within a hidden group",
             '<g style="visibility:hidden"><a visibility="visible"/><b visibility="inherit"/></g>',
             "a"),
        file("of a symbol nothing is shown", "<symbol><a/></symbol><defs><b/></defs><c/>", "c"),
        file("a style that hides nothing", "<style>.x { display: inline; }</style><a/>", "a"),
        file("a style that hides by display",
             '<defs><style>.x{fill:red;display:/**/none}</style></defs><a class="x"/><b/>', None),
        file("a style that hides by visibility",
             "<style><![CDATA[ rect { visibility : Hidden } ]]></style><a/>", None),
        file("a comment in a style hides nothing",
             "<style>/* display:none */ .x { fill: red }</style><a/>", "a"),
    ]  # fmt: skip


def vectors() -> dict[str, Any]:
    cases = [*contours(), *holes(), *stacks(), *toughness()]
    return {"format": "scissorcal-golden-outlines/1", "cases": cases, "files": files()}


def text() -> str:
    found = json.dumps(vectors(), allow_nan=False, separators=(",", ":"))
    return found.replace('{"title"', '\n{"title"') + "\n"


if __name__ == "__main__":
    FILE.write_text(text(), encoding="utf-8")
