"""OpenCV's storage as cv2 writes it, in every style, is read without cv2; hostile ones are not."""

from pathlib import Path

import cv2
import numpy as np
import pytest

from scissorcal.errors import InputError
from scissorcal.foreign.text_tree import parse_xml, parse_yaml
from scissorcal.vision import matrix_of, number_of, read_camera_file

STYLES = {
    "yml": cv2.FILE_STORAGE_FORMAT_YAML,
    "xml": cv2.FILE_STORAGE_FORMAT_XML,
    "json": cv2.FILE_STORAGE_FORMAT_JSON,
}
MATRICES = {
    "doubles": np.array([[500.25, 0.0, 3e-20], [0.0, np.nan, np.inf], [1e30, -np.inf, -1e-300]]),
    "floats": np.linspace(-1.0, 1.0, 7, dtype=np.float32).reshape(1, 7),
    "integers": np.arange(-3, 3, dtype=np.int32).reshape(2, 3),
    "bytes": np.arange(24, dtype=np.uint8).reshape(2, 4, 3),
    "words": np.arange(6, dtype=np.uint16).reshape(6, 1) * 10_000,
    "none": np.zeros((0, 0)),
}


def storage(style: str, base64: bool = False) -> str:
    flags = cv2.FILE_STORAGE_WRITE | cv2.FILE_STORAGE_MEMORY | STYLES[style]
    file = cv2.FileStorage("", flags | (cv2.FILE_STORAGE_BASE64 if base64 else 0))
    file.write("image_width", 640)
    file.write("rms", 1e-9)
    file.write("name", 'a <b> & "c": d # e\n f, {g} [h]')
    file.writeComment("written by a test")
    for name, matrix in MATRICES.items():
        file.write(name, matrix)
    file.startWriteStruct("points", cv2.FileNode_SEQ)
    file.write("", 1.5)
    file.write("", 2)
    file.endWriteStruct()
    file.startWriteStruct("inner", cv2.FileNode_MAP)
    file.write("a", 1.5)
    file.write("doubles", MATRICES["doubles"])
    file.endWriteStruct()
    return str(file.releaseAndGetString())


@pytest.mark.parametrize("base64", [False, True])
@pytest.mark.parametrize("style", STYLES)
def test_what_cv2_writes_is_read(style: str, base64: bool) -> None:
    text = storage(style, base64)
    found = parse_xml(text) if style == "xml" else parse_yaml(text)[0]
    assert isinstance(found, dict)
    assert number_of(found["image_width"]) == 640.0
    assert number_of(found["rms"]) == 1e-9
    assert number_of(found["name"]) is None
    for name, matrix in MATRICES.items():
        read = matrix_of(found[name])
        assert read is not None, name
        assert read.shape == matrix.shape
        np.testing.assert_allclose(read, matrix.astype(np.float64), rtol=1e-7, atol=0.0)
    np.testing.assert_array_equal(matrix_of(found["inner"]["doubles"]), MATRICES["doubles"])


GOOD = """%YAML:1.0
---
image_width: 640
image_height: 480
camera_matrix: !!opencv-matrix
   rows: 3
   cols: 3
   dt: d
   data: [ 500., 0., 320., 0., 500., 240., 0., 0., 1. ]
"""
XML = """<?xml version="1.0"?>
<opencv_storage><image_width>640</image_width><image_height>480</image_height>
<camera_matrix type_id="opencv-matrix"><rows>3</rows><cols>3</cols><dt>d</dt>
<data>500. 0. 320. 0. 500. 240. 0. 0. 1.</data></camera_matrix></opencv_storage>
"""
LAUGHS = "".join(
    f"l{i}: &l{i} [{', '.join([f'*l{i - 1}'] * 10 if i else ['ha'])}]\n" for i in range(9)
)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (GOOD.replace("   cols: 3\n", ""), "a matrix without cols"),
        (GOOD.replace("   rows: 3\n", ""), "a matrix without rows"),
        (GOOD.replace("rows: 3", "rows: -3"), "a matrix without rows"),
        (GOOD.replace("rows: 3", "rows: 99999999"), "a matrix without rows"),
        (GOOD.replace("rows: 3", "rows: 999999"), "a matrix of 999999 x 3"),
        (GOOD.replace("rows: 3", "rows: 4"), "4 x 3 with 9 numbers"),
        (GOOD.replace("dt: d", "dt: q"), "of the type 'q'"),
        (GOOD.replace("dt: d", "dt: 99d"), "with 9 numbers"),
        (GOOD.replace("500.,", f"{'5' * 6000}.,"), "an entry that is no number"),
        (GOOD.replace("500.,", "1e9999,"), "not finite"),
        (GOOD.replace("500.,", "1e300,"), "fx is 1e+300 px"),
        (GOOD.replace("640", "6.5e2"), None),
        (GOOD.replace("640", "1e12"), "picture size"),
        (GOOD.replace("640", ".nan"), "picture size"),
        (GOOD.replace("data: [", "data: !!binary |\n      MWQgICAg#") + "]", "is damaged"),
        (LAUGHS + GOOD.partition("---\n")[2], "anchors and aliases"),
        ("a: " + "[" * 5000, "nested too deeply"),
        ("{" * 3000, "nested too deeply"),
        (XML, None),
        (XML.replace("<cols>3</cols>", ""), "a matrix without cols"),
        (XML.replace("<opencv", '<!DOCTYPE a [<!ENTITY b "c">]><opencv', 1), "document type"),
        (XML.replace("500. 0.", "500. &b;"), "is damaged"),
        ('<?xml version="1.0"?>' + "<a>" * 5000, "nested too deeply"),
        ('<?xml version="1.0"?><a/>', "no camera matrix"),
        ("a: " + "x" * 1_000_001, "more than 1 MB"),
    ],
)
def test_hostile_camera_files_end_in_a_sentence(
    tmp_path: Path, text: str, words: str | None
) -> None:
    path = tmp_path / "camera.yaml"
    path.write_text(text)
    if words is None:
        assert read_camera_file(path).camera.fx == 500.0
        return
    with pytest.raises(InputError) as caught:
        read_camera_file(path)
    assert str(caught.value).startswith(str(path))
    assert words in str(caught.value)


def test_a_yaml_document_is_text_whatever_it_says() -> None:
    assert parse_yaml("a: !!python/object/apply:os.system ['x']\nb: 2001-01-01\nc: 0o7\n") == [
        {"a": ["x"], "b": "2001-01-01", "c": "0o7"}
    ]
