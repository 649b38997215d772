"""Shapes of SVG drawings: exact places and areas, and files that are refused."""

import contextlib
import math
import re
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import scissorcal
from scissorcal.errors import InputError
from scissorcal.foreign import DRAWING
from scissorcal.model import Outline, spans_on_line
from scissorcal.recipe.drawing import parse_drawing, read_drawing
from scissorcal.recipe.svg.curves import FLAT_MM
from scissorcal.recipe.svg.elements import MOST_POINTS, MOST_POINTS_OF_FILE, MOST_SHAPES
from tests.guard import GUARD_S

HEAD = '<svg xmlns="http://www.w3.org/2000/svg" width="80mm" height="60mm" viewBox="0 0 80 60">'
LAUGHS = "".join(f'<!ENTITY l{i + 1} "{f"&l{i};" * 10}">' for i in range(9))


def drawn(tmp_path: Path, inner: str, head: str = HEAD) -> Outline:
    path = tmp_path / "plate.svg"
    path.write_text(f"{head}{inner}</svg>", encoding="utf-8")
    return read_drawing(path).shape("a")


TURNS = ("", "rotate(20 40 0)", "rotate(90)", "skewX(15)", "matrix(0 1 -1 0 5 7)", "translate(3 4)")


@pytest.mark.parametrize("transform", TURNS)
@pytest.mark.parametrize(
    ("shape", "area_mm2"),
    [
        ('<rect id="a" x="30" y="-5" width="20" height="10"', 200.0),
        ('<circle id="a" cx="40" r="5"', 25.0 * math.pi),
        ('<ellipse id="a" cx="40" rx="20" ry="3"', 60.0 * math.pi),
        ('<polygon id="a" points="0,0 10,0 0,10"', 50.0),
        ('<polyline id="a" points="0,0 10,0 0,10"', 50.0),
        ('<path id="a" d="M0 0h10v10h-10z"', 100.0),
    ],
)
def test_transforms_that_keep_areas_keep_them(
    tmp_path: Path, shape: str, area_mm2: float, transform: str
) -> None:
    outline = drawn(tmp_path, f'{shape} transform="{transform}"/>')
    assert outline.area_m2 * 1e6 == pytest.approx(area_mm2, rel=0.01)


def test_a_turned_rect_stands_where_the_transform_puts_it(tmp_path: Path) -> None:
    rect = '<g transform="translate(0 30)"><rect id="a" width="20" height="10" '
    outline = drawn(tmp_path, rect + 'transform="rotate(90)"/></g>')
    (contour,) = outline.contours
    assert contour.min(axis=0) * 1e3 == pytest.approx([-10.0, 30.0], abs=1e-9)
    assert contour.max(axis=0) * 1e3 == pytest.approx([0.0, 50.0], abs=1e-9)


@pytest.mark.parametrize(("unit", "millimetres"), [("mm", 1), ("cm", 10), ("in", 25.4)])
def test_lengths_follow_width_and_view_box(tmp_path: Path, unit: str, millimetres: float) -> None:
    head = HEAD.replace("mm", unit).replace("0 0 80 60", "0 0 160 120")
    outline = drawn(tmp_path, '<rect id="a" width="8" height="4"/>', head)
    assert np.ptp(outline.contours[0], axis=0) * 1e3 == pytest.approx(
        [4.0 * millimetres, 2.0 * millimetres], rel=1e-5
    )


@pytest.mark.parametrize("offset_mm", [0.0, 1.0, 3.0, 4.5])
def test_a_circle_is_cut_at_its_chord(tmp_path: Path, offset_mm: float) -> None:
    outline = drawn(tmp_path, '<circle id="a" cx="40" cy="30" r="5"/>')
    ((begin, end),) = spans_on_line(outline, (30.0 + offset_mm) * 1e-3)
    half = math.sqrt(25.0 - offset_mm**2)
    allowed = FLAT_MM * 5.0 / half * 1.1  # across the outline 0.01 mm, along the line more
    assert [begin * 1e3, end * 1e3] == pytest.approx([40.0 - half, 40.0 + half], abs=allowed)


@pytest.mark.parametrize(
    ("curve", "at"),
    [
        ("C 0 20 40 20 40 0", lambda t: (3 * (1 - t) * t**2 * 40 + t**3 * 40, 60 * (1 - t) * t)),
        ("Q 20 40 40 0", lambda t: (40 * (1 - t) * t + 40 * t**2, 80 * (1 - t) * t)),
    ],
)
def test_curves_are_flattened_to_the_stated_tolerance(tmp_path: Path, curve: str, at) -> None:  # type: ignore[no-untyped-def]
    (corners,) = drawn(tmp_path, f'<path id="a" d="M0 0 {curve} z"/>').contours
    exact = np.transpose(at(np.linspace(0.0, 1.0, 1001)))
    farthest = np.full(len(exact), np.inf)
    for start, end in zip(corners * 1e3, np.roll(corners, -1, axis=0) * 1e3, strict=True):
        side = end - start
        share = np.clip((exact - start) @ side / (side @ side), 0.0, 1.0)
        off = np.linalg.norm(exact - start - share[:, None] * side, axis=1)
        farthest = np.minimum(farthest, off)
    assert farthest.max() <= FLAT_MM


def test_a_contour_within_another_is_a_hole(tmp_path: Path) -> None:
    outline = drawn(tmp_path, '<path id="a" d="M0 0h40v40h-40z M10 5v10h10v-10z"/>')
    found = np.array(spans_on_line(outline, 10e-3)) * 1e3
    assert found == pytest.approx(np.array([[0.0, 10.0], [20.0, 40.0]]), abs=1e-9)


@pytest.mark.parametrize(
    ("text", "why"),
    [
        (f'<!DOCTYPE s [<!ENTITY l0 "l">{LAUGHS}]>{HEAD}<text>&l9;</text></svg>', "entities"),
        (f'<!DOCTYPE s SYSTEM "file:///x">{HEAD}&x;</svg>', "undefined entity"),
        (f"{HEAD}{'<g/>' * 20_000}</svg>", "elements"),
        (f"{HEAD}{'<g>' * 100}{'</g>' * 100}</svg>", "levels"),
        (f"{HEAD}{'<rect/>' * 401}</svg>", "400 shapes"),
        (f'{HEAD}<path d="M0 0{"h1v1" * 499_000}z"/></svg>', "20,000 in all"),
        (f'{HEAD}<path d="M0 0{"h1v1" * 2_000}h1z"/></svg>', "more than 4,000 points"),
        (f'{HEAD}<path d="M0 0 C{"1e4 1e5 9e4 -1e5 1 1 " * 9}z"/></svg>', "more than 4,000 points"),
        (f'{HEAD}<path d="M0 0{"h1v1" * 500_000}z"/></svg>', "more than 2 MB"),
        (f'{HEAD}<rect width="1" height="1" transform="{"scale(1)" * 200}"/></svg>', "1600 char"),
        (f'{HEAD}<defs><rect width="1" height="1"/></defs></svg>', "no closed shape"),
        (f'{HEAD}<rect width="1" height="1" style="display: none"/></svg>', "no closed shape"),
        (f'{HEAD[:-1]} display="none"><rect width="1" height="1"/></svg>', "no closed shape"),
        (f'{HEAD[:-1]} style="display:none"><g/></svg>', "no closed shape"),
        (f"{HEAD}<style>a{{color:red;visibility:hidden}}</style></svg>", "visibility in a <style>"),
        (f"{HEAD}<style>DISPLAY : none</style></svg>", "display in a <style>"),
        (f'{HEAD}<path d="M0 0L nan 5L5 nan z"/></svg>', "path breaks off at"),
        (f'{HEAD}<rect width="1e300" height="1e300"/></svg>', "no places"),
        (f'{HEAD}<rect width="1" height="1" transform="scale(1e400)"/></svg>', "no places"),
        (f"{HEAD}<script>1</script></svg>", "script"),
        (f'{HEAD}<rect onload="x()" width="1" height="1"/></svg>', "script"),
        (f'{HEAD}<image href="http://example.org/x.png"/></svg>', "another file"),
        (f'{HEAD}<use id="a" href="#a"/></svg>', "clones"),
        (HEAD.replace("mm", "") + "</svg>", "with a unit"),
        (HEAD.replace("80mm", "100%") + "</svg>", "with a unit"),
        (HEAD.replace("80mm", "80min") + "</svg>", "with a unit"),
        (HEAD.replace("80mm", "-80mm") + "</svg>", "with a unit"),
        (HEAD.replace("0 0 80 60", "0 0 80") + "</svg>", "four numbers"),
        (HEAD.replace("0 0 80 60", "a b c d") + "</svg>", "four numbers"),
        (HEAD.replace("0 0 80 60", "0 0 80 0") + "</svg>", "four numbers"),
        (f'{HEAD}<svg x="9"><rect width="9" height="9"/></svg></svg>', "within the drawing"),
        (f"{HEAD}</svg>", "no closed shape"),
        (f'{HEAD}<rect width="1"', "well-formed"),
        ("<html/>", "a web page, not a drawing"),
        ("<plan/>", "not <svg>"),
        ("", "empty"),
    ],
)
def test_what_is_no_drawing_of_a_plate_is_refused(tmp_path: Path, text: str, why: str) -> None:
    path = tmp_path / "plate.svg"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(InputError, match=why) as caught:
        read_drawing(path)
    assert str(path) in str(caught.value)


SLOW = {  # as many characters of one thing
    "segments of a path": lambda n: f'<path d="M0 0{"h1v1" * (n // 4)}z"/>',
    "numbers of one letter": lambda n: f'<path d="M0 0h{" 1" * (n // 2)}z"/>',
    "points": lambda n: f'<polygon points="{"1 1 " * (n // 4)}"/>',
    "a number": lambda n: f'<path d="M0 0L{"1" * n} 1z"/>',
    "signs": lambda n: f'<path d="M0 0L{"-" * n} 1z"/>',
    "styles": lambda n: f"<style>{'a{b:c}' * (n // 6)}</style>",
    "openings of styles": lambda n: f"<style>/*{'a{b' * (n // 3)}</style>",
    "a style": lambda n: f'<rect style="{"a:b;" * (n // 4)}"/>',
    "a colour": lambda n: f'<rect fill="{"rgb(" * (n // 4)}"/>',
    "classes": lambda n: f'<rect class="{"a " * (n // 2)}"/>',
    "attributes": lambda n: "<rect " + " ".join(f'a{i}="1"' for i in range(n // 12)) + "/>",
    "a view box": lambda n: f'<svg viewBox="0 0 1 {"1" * n}"/>',
    "a text": lambda n: f"<text>{'a' * n}</text>",
}
MOST_CHARACTERS = 1_900_000
"""With the rest, just below what a drawing may have."""


def slow(what: str, characters: int) -> bytes:
    return f'{HEAD}{SLOW[what](characters)}<rect width="1" height="1"/></svg>'.encode()


def calls(data: bytes) -> int:
    """How many functions are called, and return, until a drawing is read or refused."""
    count = 0

    def called(*_: object) -> None:
        nonlocal count
        count += 1

    sys.setprofile(called)
    try:
        with contextlib.suppress(InputError):
            parse_drawing(data, "plate.svg")
    finally:
        sys.setprofile(None)
    return count


@pytest.mark.parametrize("least", [1_900, 120_000], ids=["few enough", "too many"])
@pytest.mark.parametrize("what", SLOW)
def test_twice_as_much_of_one_thing_takes_at_most_twice_the_calls(what: str, least: int) -> None:
    calls(slow(what, 100))  # imports what is imported once
    one, two, four = (calls(slow(what, n * least)) for n in (1, 2, 4))
    assert four - two <= 2 * (two - one) + 100


@pytest.mark.parametrize("what", SLOW)
def test_two_megabytes_of_one_thing_are_read_or_refused_for_what_they_are(
    what: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Not for the processor time that they took, which grows with the square where a search of text
    goes back again and again: calls do not count that, and here it would be hours. The time on the
    wall, which depends on load, only guards against hanging."""
    monkeypatch.setattr("scissorcal.recipe.drawing.DRAWING", replace(DRAWING, wall_s=GUARD_S))
    path = tmp_path / "plate.svg"
    path.write_bytes(slow(what, MOST_CHARACTERS))
    said = ""
    try:
        read_drawing(path)
    except InputError as error:
        said = str(error)
    assert "processor time" not in said
    assert "did not end" not in said
    assert "memory" not in said


@pytest.mark.parametrize("letter", ["L", " "])
def test_a_drawing_of_the_most_points_is_read(tmp_path: Path, letter: str) -> None:
    turn = 2.0 * np.pi * np.arange(MOST_POINTS) / MOST_POINTS
    corners = letter.join(f"{40 + 5 * math.cos(a)} {30 + 5 * math.sin(a)}" for a in turn)
    path = tmp_path / "plate.svg"
    rings = MOST_POINTS_OF_FILE // MOST_POINTS
    path.write_text(HEAD + f'<path d="M{corners}z"/>' * rings + "</svg>")
    assert [len(shape.contours[0]) for _, shape in read_drawing(path).shapes] == [MOST_POINTS] * 5
    more = HEAD + f'<path d="M{corners}{letter}0 0z"/></svg>'
    path.write_text(more)
    with pytest.raises(InputError, match="more than 4,000 points"):
        read_drawing(path)


def test_what_only_looks_like_a_shape_is_passed_over(tmp_path: Path) -> None:
    """Shapes of another namespace, and of what is not shown; the style of a shape places it."""
    other = '<o:rect xmlns:o="urn:o" id="a" width="9" height="9"/>'
    clip = '<clipPath><g><rect id="a" width="9" height="9"/></g></clipPath>'
    moved = '<rect id="a" width="2" height="1" style="fill:red; transform: translate(3px,4px)"/>'
    (contour,) = drawn(tmp_path, other + clip + moved).contours
    assert contour.min(axis=0) * 1e3 == pytest.approx([3.0, 4.0], abs=1e-9)


@pytest.mark.parametrize(
    "style",
    [
        "/* x */display:none",
        "display:/* x */none",
        "fill:red;/* ; */display : none",
        "display:none/* not closed ; display:inline",
        "/* a */visibility:hidden/* b */",
    ],
)
def test_a_comment_in_the_style_of_a_shape_is_none_of_it(tmp_path: Path, style: str) -> None:
    hidden = f'<rect id="a" width="9" height="9" style="{style}"/>'
    shown = '<rect id="a" width="2" height="1" style="/* display:none; */fill:red"/>'
    (contour,) = drawn(tmp_path, hidden + shown).contours
    assert np.ptp(contour, axis=0) * 1e3 == pytest.approx([2.0, 1.0], abs=1e-9)


@pytest.mark.parametrize(
    "said",
    [
        "backface-visibility: hidden",
        "content-visibility:hidden",
        "--display: none",
        "-inkscape-display:none",
        "fill: url('a;display:none')",
    ],
)
def test_a_style_of_another_property_is_taken(tmp_path: Path, said: str) -> None:
    style = f"<style>rect {{ {said} }}</style>"
    assert drawn(tmp_path, f'{style}<rect id="a" width="2" height="1"/>').contours


def test_page_and_recipe_read_as_much_of_a_drawing() -> None:
    source = Path(scissorcal.__file__).parent / "prototype" / "page" / "src" / "svg_file.ts"
    found = dict(re.findall(r"^const (MOST_\w+) = ([\d_]+);", source.read_text(), re.MULTILINE))
    assert {name: int(value) for name, value in found.items()} == {
        "MOST_CHARACTERS": DRAWING.most_bytes,
        "MOST_SHAPES": MOST_SHAPES,
        "MOST_POINTS": MOST_POINTS,
        "MOST_POINTS_OF_FILE": MOST_POINTS_OF_FILE,
    }


def test_a_shape_that_is_not_there_is_named_with_those_that_are(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match=r'no shapes with id "a".*sheet, hole'):
        drawn(
            tmp_path,
            '<rect id="sheet" width="9" height="9"/><rect id="hole" width="1" height="1"/>',
        )
