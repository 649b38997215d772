"""A good file of another kind is named as what it is; it is never called damaged."""

import gzip
import io
import json
import zipfile
from collections.abc import Callable
from pathlib import Path

import h5py
import numpy as np
import pytest
from PIL import Image

import scissorcal
from scissorcal.calibration import save
from scissorcal.errors import InputError, OtherKindError
from scissorcal.foreign import formats, open_foreign
from scissorcal.foreign.formats import Format
from scissorcal.foreign.kinds import kind_of
from scissorcal.package import open_package
from scissorcal.recipe import builtin_recipe, load_recipe, recipe_path
from scissorcal.recording import import_table, read_recording, write_recording
from scissorcal.vision import read_camera_file, read_photo
from tests.calibration.results import results
from tests.recording.made import made_recording

RESULTS = results()
FITS = ("friction", "cut", "camera", "blade", "plate")


def picture(form: str) -> bytes:
    stream = io.BytesIO()
    Image.new("RGB", (8, 6)).save(stream, form)
    return stream.getvalue()


def zipped(name: str, text: str) -> bytes:
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w") as archive:
        archive.writestr(name, text)
    return stream.getvalue()


def netcdf_of_others() -> bytes:
    stream = io.BytesIO()
    with h5py.File(stream, "w") as file:
        file["temperature"] = np.arange(3.0)
        file.attrs["title"] = "weather"
    return stream.getvalue()


def arrays() -> bytes:
    stream = io.BytesIO()
    np.savez(stream, draws=np.arange(3))
    return stream.getvalue()


MADE: dict[str, tuple[str, Callable[[], bytes]]] = {
    "photo.jpg": ("image", lambda: picture("JPEG")),
    "photo.png": ("image", lambda: picture("PNG")),
    "photo.bmp": ("image", lambda: picture("BMP")),
    "photo.webp": ("image", lambda: picture("WEBP")),
    "photo.tiff": ("image", lambda: picture("TIFF")),
    "film.mp4": ("video", lambda: b"\0\0\0\x18ftypisom" + bytes(40)),
    "weather.nc": ("hdf5", netcdf_of_others),
    "old.nc": ("netcdf3", lambda: b"CDF\x01" + bytes(60)),
    "draws.npz": ("npz", arrays),
    "notes.zip": ("zip", lambda: zipped("a.txt", "hello")),
    "table.xlsx": ("office", lambda: zipped("[Content_Types].xml", "<Types/>")),
    "log.csv.gz": ("gzip", lambda: gzip.compress(b"time,angle\n0,1\n")),
    "paper.pdf": ("pdf", lambda: b"%PDF-1.7\n1 0 obj\n"),
    "run.bag": ("bag", lambda: b"#ROSBAG V2.0\n" + bytes(60)),
    "run.db3": ("sqlite", lambda: b"SQLite format 3\0" + bytes(60)),
    "page.html": ("html", lambda: b"<!DOCTYPE html>\n<html></html>"),
    "drawing.svg": ("svg", lambda: b'<?xml version="1.0"?>\n<svg width="9mm"></svg>'),
    "report.json": ("report", lambda: b'{"format": "scissorcal-report/2", "panels": []}'),
    "cut.verify.json": ("verify", lambda: b'{"format":"scissorcal-verify/1","what":"cut"}'),
    "facts.json": ("json", lambda: json.dumps({"a": 1}).encode()),
    "recipe.toml": ("recipe", lambda: recipe_path("paper-80gsm").read_bytes()),
    "camera.yml": ("yaml", lambda: b"%YAML:1.0\n---\ncamera_matrix: []\n"),
    "log.csv": ("text", lambda: b"time_s,angle_rad\n0,0.1\n0.001,0.2\n"),
    "excel.csv": ("utf16", lambda: "time_s\tangle_rad\n0\t0.1\n".encode("utf-16")),
    "stored.csv": (
        "lfs",
        lambda: b"version https://git-lfs.github.com/spec/v1\noid sha256:0a\nsize 9\n",
    ),
    "matlab.mat": ("matlab", lambda: b"MATLAB 5.0 MAT-file".ljust(126) + b"IM" + bytes(40)),
}


@pytest.fixture(scope="module")
def zoo(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Good files of many kinds: those of others, a recording, and a fit of each kind."""
    folder = tmp_path_factory.mktemp("zoo")
    for name, (_, make) in MADE.items():
        (folder / name).write_bytes(make())
    write_recording(made_recording(), folder / "friction.mcap")
    for what in FITS:
        save(RESULTS[what], folder / f"{what}.nc")
    return folder


@pytest.mark.parametrize("name", MADE)
def test_a_file_is_what_its_bytes_are(zoo: Path, name: str) -> None:
    with (zoo / name).open("rb") as file:
        kind = kind_of(file)
        assert file.tell() == 0
    assert kind is not None
    assert kind.key == MADE[name][0]


FORMATS = {name: one for name, one in vars(formats).items() if isinstance(one, Format)}


@pytest.mark.parametrize("form", FORMATS)
def test_every_format_refuses_every_known_kind_that_it_does_not_hold(zoo: Path, form: str) -> None:
    kind = FORMATS[form]
    for name, (key, _) in MADE.items():
        if key in kind.holds or "*" in kind.holds:
            continue
        with pytest.raises(OtherKindError) as error, open_foreign(zoo / name, kind):
            pytest.fail(f"{name} was opened")
        said = str(error.value)
        assert said.startswith(f"{zoo / name} is ")
        assert f", not {kind.name}. " in said
        assert "damaged" not in said
        assert "emove" not in said


READERS: dict[str, tuple[str, Callable[[Path], object]]] = {
    "a recording": ("recording", read_recording),
    "a model package": ("package", open_package),
    "a photograph": ("image", read_photo),
    "a recipe": ("recipe", load_recipe),
    "a camera file": ("yaml", read_camera_file),
    "a table in text": ("text", lambda path: import_table(path, columns={"opening": 1})),
    "a fit of scissorcal": ("fit", scissorcal.open_fit),
}


@pytest.mark.parametrize("reader", READERS)
def test_readers_name_a_good_file_of_another_kind(zoo: Path, reader: str) -> None:
    """By content alone: each file is also given the ending that the reader expects."""
    own, read = READERS[reader]
    text = ("json", "xml", "text") if own == "yaml" else ("text",) if own == "recipe" else ()
    others = [*MADE, "friction.mcap", *(f"{what}.nc" for what in FITS)]
    for name in others:
        key = MADE[name][0] if name in MADE else "recording" if name.endswith("mcap") else "fit"
        if own == "yaml" and key == "utf16":
            continue  # a camera's XML may be in UTF-16
        if key in (own, *text) or (reader == "a table in text" and name == "matlab.mat"):
            continue
        if reader == "a model package" and key == "zip":
            continue  # a package may be zipped again; what it lacks is told by name
        with pytest.raises(InputError) as error:
            read(zoo / name)
        said = str(error.value)
        assert isinstance(error.value, OtherKindError), said
        assert "damaged" not in said
        assert "emove" not in said


@pytest.mark.parametrize("what", FITS)
def test_open_fit_opens_all_kinds_of_fit(zoo: Path, what: str) -> None:
    assert scissorcal.open_fit(zoo / f"{what}.nc").what == what


def test_a_fit_is_named_by_what_it_is_of(zoo: Path) -> None:
    with pytest.raises(OtherKindError, match=r"cut\.nc is a cut fit, not a recording\."):
        read_recording(zoo / "cut.nc")
    with pytest.raises(OtherKindError, match=r"weather\.nc is an HDF5 file of another program"):
        scissorcal.open_fit(zoo / "weather.nc")


@pytest.mark.parametrize("keep", [0.2, 0.5, 0.95])
def test_a_fit_that_was_cut_off_is_damaged_and_no_file_of_others(zoo: Path, keep: float) -> None:
    data = (zoo / "cut.nc").read_bytes()
    part = zoo / "part.nc"
    part.write_bytes(data[: int(keep * len(data))])
    with pytest.raises(InputError, match="or it is damaged") as error:
        scissorcal.open_fit(part)
    assert not isinstance(error.value, OtherKindError)
    assert "scissorcal fit part" not in str(error.value)


def test_a_folder_for_a_file_and_a_file_for_a_folder(zoo: Path) -> None:
    for read in (scissorcal.open_fit, scissorcal.open_recording, scissorcal.open_package):
        with pytest.raises(InputError, match="is a folder, not a file"):
            read(zoo)
    with pytest.raises(InputError, match="is a file, not a folder"):
        scissorcal.open_workspace(zoo / "recipe.toml")


def test_a_table_whose_first_words_are_those_of_a_format_is_read(tmp_path: Path) -> None:
    """PAR1 and BM begin a Parquet table and a bitmap, and may be headings."""
    for heading in ("PAR1", "BM", "MATLAB", "II", "RIFF", "format"):
        log = tmp_path / f"{heading}.csv"
        rows = "".join(f"{0.001 * i:.3f},{0.1 + 0.001 * i:.4f},0.5\n" for i in range(400))
        log.write_text(f"{heading},angle_rad,torque_Nm\n{rows}")
        wanted = {"time": 0, "opening": 1, "motor_torque": 2}
        units = {"time": "s", "opening": "rad", "motor_torque": "N m"}
        assert len(import_table(log, columns=wanted, units=units).samples) == 400
    assert builtin_recipe("paper-80gsm").name
