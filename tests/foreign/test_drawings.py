"""SVG of other programs: read as it is meant, or refused by the name of what is not read."""

import gzip
from pathlib import Path

import numpy as np
import pytest

from scissorcal.errors import InputError
from scissorcal.recipe import read_drawing
from tests.foreign.drawings import BOX, HEAD, MISPLACED, READ, RECT, UNREAD

CASES = Path(__file__).resolve().parents[2].parent / "shared" / "cases" / "svg"
needs_cases = pytest.mark.skipif(not CASES.is_dir(), reason="the drawings are not here")
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


@pytest.mark.parametrize(("inner", "why"), UNREAD)
def test_a_feature_that_is_not_read_is_named(tmp_path: Path, inner: str, why: str) -> None:
    with pytest.raises(InputError, match=why) as caught:
        read_drawing(written(tmp_path, inner))
    assert "damaged" not in str(caught.value)


@pytest.mark.parametrize(("head", "why"), MISPLACED)
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


@pytest.mark.parametrize(("inner", "box"), READ)
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
