"""SVG of other programs: read as it is meant, or refused by the name of what is not read."""

import gzip
from pathlib import Path

import numpy as np
import pytest

from scissorcal.errors import InputError
from scissorcal.recipe.drawing import read_drawing

CASES = Path(__file__).resolve().parents[2].parent / "shared" / "cases" / "svg"
needs_cases = pytest.mark.skipif(not CASES.is_dir(), reason="the drawings are not here")
HEAD = '<svg xmlns="http://www.w3.org/2000/svg" width="100mm" height="60mm" viewBox="0 0 100 60">'
RECT = '<rect id="a" x="10" y="10" width="80" height="40"/>'
BOX = [10.0, 10.0, 90.0, 50.0]
TYPE = '"-//W3C//DTD SVG 1.1//EN" "http://www.w3.org/Graphics/SVG/1.1/DTD/svg11.dtd"'


def box_mm(path: Path) -> list[float]:
    """Least and greatest x and y of the only shape: x, y, x, y."""
    corners = np.concatenate(read_drawing(path).shape(None).contours) * 1e3
    return [*corners.min(axis=0), *corners.max(axis=0)]


def written(tmp_path: Path, inner: str, head: str = HEAD, before: str = "") -> Path:
    path = tmp_path / "plate.svg"
    path.write_text(f"{before}{head}{inner}</svg>", encoding="utf-8")
    return path


@needs_cases
def test_a_document_type_of_illustrator_is_read() -> None:
    assert box_mm(CASES / "illustrator_doctype.svg") == pytest.approx(BOX, abs=1e-9)


@needs_cases
@pytest.mark.parametrize(
    ("name", "why"),
    [
        ("attr_transform_origin.svg", "transform-origin as an attribute of <rect>"),
        ("css_transform_class.svg", "transform in a <style>"),
    ],
)
def test_what_would_move_a_shape_unseen_is_refused_by_name(name: str, why: str) -> None:
    with pytest.raises(InputError, match=why):
        read_drawing(CASES / name)


@pytest.mark.parametrize(
    ("inner", "why"),
    [
        ("<style>rect{transform-origin:50px 30px}</style>" + RECT, "transform-origin in a <style>"),
        ("<style>@media all{.t{-webkit-transform:scale(2)}}</style>" + RECT, "-webkit-transform"),
        ("<style>#a{x:20px}</style>" + RECT, "x in a <style>"),
        ("<style>#a{WIDTH:20px}</style>" + RECT, "width in a <style>"),
        ("<style>#a{fill:red;d:path('M0 0h9v9z')}</style>" + RECT, "d in a <style>"),
        ("<style>#a{rotate:90deg}</style>" + RECT, "rotate in a <style>"),
        ("<style>#a{\\74ransform:scale(2)}</style>" + RECT, "escape"),
        ("<style>#a{font-family:Bob's;x:20px}</style>" + RECT, "quote"),
        ("<style>@import 'a.css';</style>" + RECT, "another file"),
        ("<style>#a{display:inline}</style>" + RECT, "display in a <style>"),
        ("<style>#a{clip-path:url(#c)}</style>" + RECT, "clip-path in a <style>"),
        ("<style>#a{not-yet-known:1}</style>" + RECT, "not-yet-known in a <style>"),
        (RECT.replace("/>", ' style="transform-origin:center"/>'), "transform-origin in a style"),
        (RECT.replace("/>", ' style="transform:rotate(90)"/>'), "has no unit"),
        (RECT.replace("/>", ' style="transform:translate(10%)"/>'), "unit %"),
        (RECT.replace("/>", ' style="transform:rotate3d(1,1,1,9deg)"/>'), "no.*rotate3d|rotate"),
        (RECT.replace("/>", ' style="width:20px"/>'), "width in a style"),
        (RECT.replace("/>", ' style="display:none;display:inline"/>'), "display twice"),
        (RECT.replace("/>", ' style="offset-path:none;translate:9px"/>'), "offset-path in a style"),
        (RECT.replace("/>", ' display="initial"/>'), "display as an attribute"),
        (RECT.replace("/>", ' transform="translate(9mm)"/>'), "has the unit mm"),
        (RECT.replace("/>", ' transform="rotate(90) turned"/>'), "is not understood"),
        (RECT.replace("/>", ' transform="Rotate(90)"/>'), "Rotate"),
        (RECT.replace("/>", ' transform="rotate(90 1)"/>'), "too many or too few"),
        (RECT.replace("/>", ' clip-path="url(#c)"/>'), "clip-path as an attribute of <rect>"),
        (f'<g mask="url(#c)">{RECT}</g>', "mask as an attribute of <g>"),
        (f'<g x="9">{RECT}</g>', "x as an attribute of <g>"),
        (RECT.replace("/>", ' requiredFeatures="a"/>'), "requiredFeatures"),
        (RECT.replace("/>", ' wdith="9"/>'), "wdith as an attribute"),
        (RECT.replace("80", "80%"), r"relative \(%\)"),
        (RECT.replace("80", "8em"), r"relative \(em\)"),
        (RECT.replace("80", "calc(8px)"), "no length"),
        (RECT.replace("80", "-80"), "below 0"),
        (f"<switch>{RECT}</switch>", "<switch>"),
        ('<foreignObject width="9" height="9"/>' + RECT, "foreign objects"),
        (f"<metal>{RECT}</metal>", "<metal>, which is not read"),
        (RECT.replace("/>", '><animate attributeName="x" to="9"/></rect>'), "animated"),
        ('<defs><set href="#a" attributeName="x" to="9"/></defs>' + RECT, "animated"),
        ('<symbol id="s"><path d="M0 0h9v9z"/></symbol><use href="#s"/>', "clones"),
        ('<path id="a" d="M0 0 L10 0 10 10 0,z"/>', "breaks off"),
        ('<path id="a" d="10 0 L10 0 10 10z"/>', "breaks off"),
        ('<path id="a" d="M0 0 a9 9 0 2 0 5 5z"/>', "breaks off"),
        ('<polygon id="a" points="0 0 9 0 9 9 9"/>', "x without y"),
        ('<polygon id="a" points="0 0 9 0 9 9mm"/>', "no numbers"),
    ],
)
def test_a_feature_that_is_not_read_is_named(tmp_path: Path, inner: str, why: str) -> None:
    with pytest.raises(InputError, match=why) as caught:
        read_drawing(written(tmp_path, inner))
    assert "damaged" not in str(caught.value)


@pytest.mark.parametrize(
    ("head", "why"),
    [
        (HEAD.replace("viewBox", "viewbox"), "viewbox as an attribute"),
        (HEAD.replace(">", ' transform="scale(2)">'), "attribute of its root"),
        (HEAD.replace(">", ' style="width:50mm">'), "width in a style"),
        (HEAD.replace(">", ' preserveAspectRatio="defer none">'), "preserveAspectRatio"),
        (HEAD.replace("100mm", "100px"), "with a unit"),
        (HEAD.replace("0 0 100 60", "0 0 1e999 60"), "no places|four numbers"),
    ],
)
def test_a_page_that_is_placed_otherwise_is_refused(tmp_path: Path, head: str, why: str) -> None:
    with pytest.raises(InputError, match=why):
        read_drawing(written(tmp_path, RECT, head))


@pytest.mark.parametrize(
    "before",
    [
        f"<!DOCTYPE svg PUBLIC {TYPE}>",
        '<?xml version="1.0" standalone="no"?>\n<!-- <!DOCTYPE x> -->\n'
        f"<!DOCTYPE svg PUBLIC {TYPE} >",
        "<!DOCTYPE svg>",
        '<!DOCTYPE svg SYSTEM "svg.dtd">',
    ],
)
@pytest.mark.parametrize("codec", ["utf-8", "utf-16"])
def test_a_document_type_without_entities_is_read(tmp_path: Path, before: str, codec: str) -> None:
    path = written(tmp_path, RECT, before=before)
    path.write_bytes(path.read_text(encoding="utf-8").encode(codec))
    assert box_mm(path) == pytest.approx(BOX, abs=1e-9)


def test_entities_are_refused_in_words(tmp_path: Path) -> None:
    own = written(tmp_path, RECT, before='<!DOCTYPE svg [<!ENTITY ns_ai "http://x">]>')
    with pytest.raises(InputError, match=r"entities.*Illustrator"):
        read_drawing(own)
    theirs = RECT.replace('x="10"', 'x="&one;0"')  # expat alone would read x="0"
    for before in (f"<!DOCTYPE svg PUBLIC {TYPE}>", ""):
        with pytest.raises(InputError, match="undefined entity"):
            read_drawing(written(tmp_path, theirs, before=before))


def test_a_named_style_sheet_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="style sheet"):
        read_drawing(written(tmp_path, RECT, before='<?xml-stylesheet href="a.css"?>'))


def test_svgz_is_read_within_the_size_of_a_drawing(tmp_path: Path) -> None:
    path = written(tmp_path, RECT)
    text = path.read_bytes()
    path.write_bytes(gzip.compress(text))
    assert box_mm(path) == pytest.approx(BOX, abs=1e-9)
    for data, why in (
        (gzip.compress(text + b" " * 2_000_000), "more than 2 MB"),
        (gzip.compress(b" " * 500_000_000, compresslevel=1)[:1_000_000], "more than 2 MB"),
        (gzip.compress(text)[:-9], "cut short"),
        (gzip.compress(text) + b"more", "followed by"),
        (b"\x1f\x8bnothing of the kind", "damaged"),
    ):
        path.write_bytes(data)
        with pytest.raises(InputError, match=why):
            read_drawing(path)


@pytest.mark.parametrize(
    ("inner", "box"),
    [
        ('<path d="M10-10h1e1v.5.5H20zm5 5h-5v-5z"/>', [10, -10, 20, -5]),
        ('<path d="M0 0 10 0 10 10zl-5 0 0-5z"/>', [-5, -5, 10, 10]),
        ('<path d="M0 0a5 5 0 0110 0z"/>', [0, -5, 10, 0]),
        ('<path d="M0,0c0,10,10,10,10,0s10-10,10,0z"/>', [0, -7.5, 20, 7.5]),
        ('<path d="M0 0q5 10 10 0t10 0z"/>', [0, -5, 20, 5]),
        ('<path d="M0 0q5 10 10 0s20 10 20 5z"/>', [0, 0, 30, 6.4]),
        ('<path d="M0 0c0 9 9 9 9 0t20 5z"/>', [0, 0, 29, 6.75]),
        ('<rect width="4cm" height="1in" rx="99"/>', [0, 0, 40 * 96 / 25.4, 96]),
        ('<rect width="8" height="4" rx="auto" ry="9"/>', [0, 0, 8, 4]),
        ('<ellipse rx="5" ry="auto"/>', [-5, -5, 5, 5]),
        ('<polygon points="1,1 5-1,3,3"/>', [1, -1, 5, 3]),
        (f'<g transform="translate(5) scale(2,1)">{RECT}</g>', [25, 10, 185, 50]),
        (RECT.replace("/>", ' transform="rotate(90,50,30)"/>'), [30, -10, 70, 70]),
        (RECT.replace("/>", ' transform="skewX(45)"/>'), [20, 10, 140, 50]),
        (RECT.replace("/>", ' style="transform:rotate(.25turn)"/>'), [-50, 10, -10, 90]),
        (RECT.replace("/>", ' style="transform:none" transform="scale(2)"/>'), BOX),
        (RECT.replace("/>", ' clip-path="none"/>'), BOX),
        ('<g width="5" display="none"><use href="#b"/></g>' + RECT, BOX),
        ('<flowRoot><flowRegion><rect width="9" height="9"/></flowRegion></flowRoot>' + RECT, BOX),
        ('<clipPath id="c"><use href="#b"/></clipPath>' + RECT, BOX),
        ('<text x="5"><tspan dx="1">A</tspan></text><line x2="5"/>' + RECT, BOX),
        ("<style><![CDATA[.s{fill:url(#g);stroke:#000}/* x:1 */]]></style>" + RECT, BOX),
        (f'<a href="#top">{RECT}</a>', BOX),
        (RECT.replace(' width="80"', "") + '<path id="b" d="M0 0h9v9z"/>', [0, 0, 9, 9]),
    ],
)
def test_what_is_read_is_where_the_file_puts_it(
    tmp_path: Path, inner: str, box: list[float]
) -> None:
    assert box_mm(written(tmp_path, inner)) == pytest.approx(box, abs=0.02)


@pytest.mark.parametrize(
    ("fit", "box"),
    [
        ("", [20, 45, 180, 155 - 30]),
        ("none", [20, 10 / 60 * 170, 180, 50 / 60 * 170]),
        ("xMinYMin", [20, 20, 180, 100]),
        ("xMaxYMax meet", [20, 70, 180, 150]),
        ("xMidYMid slice", [-41.667 + 28.333, 28.333, 213.333, 141.667]),
    ],
)
def test_a_view_box_of_another_shape_is_fitted_as_stated(
    tmp_path: Path, fit: str, box: list[float]
) -> None:
    page = HEAD.replace("100mm", "200mm").replace("60mm", "170mm")
    said = f' preserveAspectRatio="{fit}">' if fit else ">"
    assert box_mm(written(tmp_path, RECT, page.replace(">", said))) == pytest.approx(box, abs=0.01)
