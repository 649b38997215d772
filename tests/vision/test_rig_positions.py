"""The table of rig positions: columns in any order; a wrong table names its line."""

from pathlib import Path

import pytest

from scissorcal.errors import InputError
from scissorcal.vision.rig_positions import read_rig_positions

WANTED = {"rig-01.jpg": (30.0, 25.0), "rig-02.jpg": (40.5, -1.0)}


def read(tmp_path: Path, text: str) -> object:
    path = tmp_path / "positions.csv"
    path.write_bytes(text.encode())
    return read_rig_positions(path)


@pytest.mark.parametrize(
    "text",
    [
        "file,advance_mm,opening_deg\nrig-01.jpg,30,25\nrig-02.jpg,40.5,-1\n",
        "opening_deg,file,advance_mm\n25,rig-01.jpg,30\n-1,rig-02.jpg,40.5",
        "advance_mm,opening_deg,file\r\n30,25,rig-01.jpg\r\n40.5,-1,rig-02.jpg\r\n",
        "\ufefffile, advance_mm ,opening_deg\n\nrig-01.jpg, 30 ,25\n,,\nrig-02.jpg,4.05e1,-1\n",
        'remark,file,advance_mm,opening_deg\n"a, b",a/rig-01.jpg,30,25\n'
        ",C:\\b\\rig-02.jpg,40.5,-1\n",
        "file,advance_mm,opening_deg\nrig-01.jpg,30,25\nrig-02.jpg,40.5,-1\nrig-01.jpg,30,25\n",
        'file, advance_mm, opening_deg\n"rig-01.jpg", "30", 25\n"rig-02.jpg", "40.5", -1\n',
    ],
)
def test_columns_stand_in_any_order(tmp_path: Path, text: str) -> None:
    assert read(tmp_path, text) == WANTED


@pytest.mark.parametrize(
    ("rows", "words"),
    [
        (
            "opening_deg,advance_mm,file\n25,30\n",
            r"line 2: the first line names . columns, and this one has 2",
        ),
        (
            "advance_mm,opening_deg,file\n30,25,a.jpg\n30\n",
            r"line 3: the first line names . columns, and this one has 1",
        ),
        (
            "file,advance_mm,opening_deg\na.jpg,30,5,25\n",
            r"line 2: the first line names . columns, and this one has 4",
        ),
        (
            "file,advance_mm,opening_deg\na.jpg;30;25\n",
            r"line 2: the first line names . columns, and this one has 1",
        ),
        ("file,advance_mm,opening_deg,advance_mm\na.jpg,30,25,60\n", "needs a first line"),
        ("file;advance_mm;opening_deg\na.jpg;30;25\n", "needs a first line"),
        ("File,advance_mm,opening_deg\na.jpg,30,25\n", "needs a first line"),
        ("a.jpg,30,25\n", "needs a first line"),
        ("file,advance_mm,opening_deg\n", "has no line below its first"),
        ("file,advance_mm,opening_deg\n\n  \n", "has no line below its first"),
        ("file,advance_mm,opening_deg\n,30,25\n", "line 2: the name"),
        ("file,advance_mm,opening_deg\nfolder/,30,25\n", "line 2: the name"),
        ("file,advance_mm,opening_deg\na.jpg,,25\n", "line 2: advance_mm"),
        ('file,advance_mm,opening_deg\na.jpg,"30,5",25\n', "line 2: advance_mm"),
        ("file,advance_mm,opening_deg\na.jpg,30,nan\n", "line 2: advance_mm"),
        ("file,advance_mm,opening_deg\na.jpg,1_0,25\n", "line 2: advance_mm"),
        ("file,advance_mm,opening_deg\na.jpg,30 mm,25\n", "line 2: advance_mm"),
        ("file,advance_mm,opening_deg\na.jpg,30000,25\n", "line 2: 30000 mm"),
        ("file,advance_mm,opening_deg\na.jpg,30,2500\n", "line 2: 30 mm and 2500 deg"),
        ("file,advance_mm,opening_deg\na.jpg,30,25\nb/a.jpg,31,25\n", "line 3: a.jpg has another"),
        ('file,advance_mm,opening_deg\n"a.jpg,30,25\nb.jpg,31,25\n', "no line of CSV"),
        ('file,advance_mm,opening_deg\n"a"b.jpg,30,25\n', "no line of CSV"),
        ("file,advance_mm,opening_deg\n" + "a" * 200_000 + ",30,25\n", "no line of CSV"),
    ],
)
def test_what_is_no_position_names_its_line(tmp_path: Path, rows: str, words: str) -> None:
    with pytest.raises(InputError, match=words):
        read(tmp_path, rows)
