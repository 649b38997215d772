"""A valid file of every format that scissorcal reads, how a command reads it, what it must give.

``seal`` changes what checksums and hashes protect and makes them right again, so that changes get
past them.
"""

import json
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from PIL import Image
from scipy.io import savemat

from scissorcal.calibration import VerifyResult, load, read_header, save
from scissorcal.foreign.formats import PHOTO_INDEX
from scissorcal.identity import bytes_digest
from scissorcal.inference import Walk, load_walks, save_walks
from scissorcal.package import Review, holds, read_public_keys, signer
from scissorcal.recipe import (
    load_recipe,
    parse_recipe,
    plate_pieces,
    plate_sentence,
    probed_surface,
    recipe_path,
)
from scissorcal.recording import (
    PICTURE,
    Recording,
    import_table,
    read_attachments,
    read_recording,
    read_telemetry,
    summary,
)
from scissorcal.recording import (
    read_header as read_recording_header,
)
from scissorcal.vision import read_camera_file, read_photo, read_rig_positions, write_camera_file
from tests.calibration.results import results
from tests.calibration.test_store import checked
from tests.foreign.seals import (
    Seal,
    changed_member,
    sealed_fit,
    sealed_package,
    sealed_png,
    sealed_recording,
)
from tests.recording.logs import COLUMNS, UNITS, rows, written
from tests.recording.made import made_samples, written_live
from tests.recording.test_import_formats import MAT_COLUMNS, MAT_UNITS, mat_variables, written_mat73
from tests.vision.test_camera_files import CAMERA, KALIBR, OPENCV_1, ROS_MESSAGE


@dataclass(frozen=True)
class Sample:
    """A format: its file's name, how one is made, how it is read; ``read`` checks what it gives."""

    file: str
    make: Callable[[Path], Any]
    read: Callable[[Path], Any]
    seal: Seal | None = None


DRAWN = """
[plate]
cut_line_mm = 30.0
[[plate.layers]]
name = "sheet"
thickness_mm = 0.1
outline = "plate.svg"
id = "sheet"
holes = ["hole", "slot"]
[[plate.layers.regions]]
toughness_ratio = 3.0
id = "band"
"""
DRAWING = """<?xml version="1.0" encoding="UTF-8"?>
<svg xmlns="http://www.w3.org/2000/svg" width="100mm" height="60mm" viewBox="0 0 200 120">
<title>a plate</title><style>.a{fill:none}</style>
<g transform="translate(0 60) scale(1.5 2)" style="fill:none;stroke:#000">
<path id="sheet" d="M0-20h120v40l-20 5c-10 4-20 4-30 0s-20-4-30 0L0,20zM80-1.5v3h5v-3z"/>
<circle id="hole" class="a" cx="40" cy="0" r="3" transform="rotate(30 40 0)"/>
<path id="slot" d="M50 2a4 3 20 1 0 6-4q-4-2-6 0t-1e0 2Z" transform="matrix(1 .1 0 1 0 0)"/>
<polygon id="band" points="60,-20 70,-20 75,20 60,20"/>
<ellipse cx="9" rx="3" ry="4"/><rect x="1" y="2" width="3" height="4" rx="1"/>
</g></svg>
"""


def _drawing(path: Path) -> None:
    path.write_text(DRAWING, encoding="utf-8")


def _read_drawing(path: Path) -> None:
    recipe = parse_recipe(recipe_path("paper-80gsm").read_text(encoding="utf-8") + DRAWN)
    pieces = plate_pieces(recipe.plate, path.parent)
    places = [[one.begin_m, *(strip.end_m for strip in one.strips)] for one in pieces]
    assert places
    for place in places:
        assert np.isfinite(place).all()
        assert (np.diff(place) > 0.0).all()
    assert plate_sentence(recipe.plate, recipe.material.name, recipe.material.thickness_mm, pieces)


def _recipe(path: Path) -> None:
    recipe = load_recipe(path)
    assert recipe.material.thickness_mm > 0.0


def _log(columns: dict[str, str | int], units: dict[str, str]) -> Callable[[Path], None]:
    def read(path: Path) -> None:
        scale: dict[str, str | float] = {"motor_torque": "gain"} if path.suffix == ".mat" else {}
        _finite(import_table(path, columns=columns, units=units, scale=scale))

    return read


def _finite(recording: Recording) -> None:
    for name in ("opening", "motor_torque"):
        assert np.isfinite(recording.samples[name]).all()
    assert recording.content_hash
    summary(recording)


def _parquet(path: Path) -> None:
    import pyarrow as pa
    import pyarrow.parquet as pq

    table = np.array(rows())
    columns = {name: table[:, index] for index, name in enumerate(("t", "angle", "torque"))}
    pq.write_table(pa.table({**columns, "remark": ["a"] * len(table)}), path)


def _recording(path: Path) -> None:
    written_live(path, made_samples(600))


def _read_recording(path: Path) -> None:
    header = read_recording_header(path)
    assert header.sample_count >= 0
    recording = read_recording(path)
    summary(recording)
    read_attachments(path)
    read_telemetry(path, PICTURE)


def _fit(name: str) -> Callable[[Path], None]:
    return lambda path: save(results()[name], path)


def _read_fit(name: str) -> Callable[[Path], None]:
    kind = type(results()[name])

    def read(path: Path) -> None:
        if path.suffix == ".nc":
            read_header(path)
        assert isinstance(load(path, kind), kind)

    return read


def _trust_check(path: Path) -> None:
    save(checked(), path)


def _read_trust_check(path: Path) -> None:
    assert load(path, VerifyResult).what is not None


def _camera(text: str) -> Callable[[Path], None]:
    return lambda path: path.write_text(text) and None


def _read_camera(path: Path) -> None:
    camera = read_camera_file(path).camera
    assert camera.fx > 0.0
    assert camera.width >= 1
    assert np.isfinite(camera.parameters).all()
    camera.project([[0.0, 0.0, 1.0]])


def _photo(kind: str, **options: Any) -> Callable[[Path], None]:
    def make(path: Path) -> None:
        rng = np.random.default_rng(3)
        pixels = cv2.GaussianBlur(rng.integers(0, 255, (90, 120, 3), np.uint8), (0, 0), 3)
        Image.fromarray(pixels).save(path, format=kind, **options)

    return make


def _deep_photo(path: Path) -> None:
    Image.fromarray(np.arange(90 * 120, dtype=np.uint16).reshape(90, 120) * 6).save(path)


def _read_photo(path: Path) -> None:
    photo = read_photo(path)
    assert photo.image.dtype == np.uint8
    assert photo.grey.ndim == 2
    assert photo.sha256 == bytes_digest(path.read_bytes())


def _package(path: Path) -> None:
    from scissorcal.package import build_package
    from tests.package.fits import cut_fit, friction_fit, recipe

    chosen = recipe()
    build_package(chosen, friction_fit(), cut_fit(chosen, kappa=0.75), path, _rng(3))


def _read_package(path: Path) -> None:
    from scissorcal.package import open_package

    package = open_package(path, warn=False)
    ranges = package.manifest.ranges
    opening, contact = (sum(pair) / 2.0 for pair in (ranges.opening_rad, ranges.contact_m))
    with np.errstate(all="ignore"):
        assert np.isfinite(package.torque(opening, -0.2, contact)).all()
        package.band(opening, -0.2, contact)
    _ = package.warnings, package.kernel()


def _report(path: Path) -> None:
    from scissorcal.report import ReportDocument, document_of_fit, twin_text
    from tests.report.fits import cut_fit

    document: ReportDocument = document_of_fit(cut_fit(), None)
    path.write_text(twin_text(replace(document, inputs_hash="1f")))


def _read_report(path: Path) -> None:
    from scissorcal.workday import facts, load_side

    assert isinstance(facts.report(path)["inputs"], str)
    load_side(path)


def _signature(path: Path) -> None:
    review = Review.of(
        name="A. Lovelace",
        decision="accept",
        note="",
        time_utc="2025-01-31T15:02:00Z",
        content={"report/report.json": "0" * 64},
        fit_hashes={"cut": "1f"},
    )
    path.write_text(review.model_dump_json())


def _read_signature(path: Path) -> None:
    from scissorcal.workday import facts

    assert facts.signature(path)["label"]


def _private_key(path: Path) -> None:
    from cryptography.hazmat.primitives.asymmetric.ed25519 import Ed25519PrivateKey
    from cryptography.hazmat.primitives.serialization import (
        Encoding,
        NoEncryption,
        PrivateFormat,
    )

    key = Ed25519PrivateKey.from_private_bytes(bytes(range(32)))
    path.write_bytes(key.private_bytes(Encoding.PEM, PrivateFormat.OpenSSH, NoEncryption()))
    path.chmod(0o600)


def _read_private_key(path: Path) -> None:
    text = "a text"
    path.chmod(0o600)
    assert holds(signer(path)(text), text)


def _public_keys(path: Path) -> None:
    private = path.with_name("of-it")
    _private_key(private)
    path.write_text(f"# of the laboratory\n{signer(private)('a text').public_key} lab\n")


def _photo_index(path: Path) -> None:
    one = {"file": "a.jpg", "source": "a.jpg", "sha256": "0" * 64, "ids": [1], "pixels": [[1, 2]]}
    one |= {"width": 640, "height": 480}
    path.write_text(json.dumps({"kind": "camera", "photographs": [one]}))


def _read_photo_index(path: Path) -> None:
    from scissorcal.foreign import read_foreign, reading
    from scissorcal.workday import PhotoIndex, facts

    with reading(path, PHOTO_INDEX):
        PhotoIndex.model_validate_json(read_foreign(path, PHOTO_INDEX))
    facts.photographs(path)


def _path(path: Path) -> None:
    lines = [f"{x},{0.5 * x},2,{10 + x}" for x in range(40)]
    path.write_text("x_mm,y_mm,force_N,speed_mm_per_s\n" + "\n".join(lines) + "\n")


def _read_path(path: Path) -> None:
    from scissorcal.control import read_path

    points = read_path(path)
    assert np.isfinite(points.x).all()


def _surface(path: Path) -> None:
    lines = [f"{x},{y},{0.01 * x}" for x in range(-20, 25, 5) for y in range(-20, 25, 5)]
    path.write_text("x_mm,y_mm,z_mm\n" + "\n".join(lines) + "\n")


def _read_surface(path: Path) -> None:
    assert probed_surface(path, 0.02).surface is not None


def _positions(path: Path) -> None:
    lines = "".join(f"r-{i}.jpg,3{i},2{i}\n" for i in range(3))
    path.write_text(f"file,advance_mm,opening_deg\n{lines}")


def _read_positions(path: Path) -> None:
    assert np.isfinite(list(read_rig_positions(path).values())).all()


def _track_lines(path: Path) -> None:
    head = {"source": "0", "started_utc": "x", "frame": "rig", "camera_inputs_hash": "1f"}
    pose = {"quaternion": [1, 0, 0, 0], "translation_m": [0, 0, 0.1]}
    lines = [{"number": i, "time_s": 0.1 * i, "state": "seen", "pose": pose} for i in range(9)]
    path.write_text("\n".join(json.dumps(one) for one in (head, *lines)) + "\n")


def _read_track_lines(path: Path) -> None:
    from scissorcal.calibration import read_track_lines

    read_track_lines(path)


def _checkpoint(path: Path) -> None:
    state = ("MT19937", np.arange(624, dtype=np.uint32), 3, 0, 0.0)
    walk = Walk(np.zeros((5, 4, 2)), 3.0, 5, 1, np.ones((4, 2)), -np.ones(4), state)
    save_walks(path, [walk, walk])


def _read_checkpoint(path: Path) -> None:
    walks = load_walks(path, lambda _: -1.0, (4, 2))
    assert walks


def _state_index(path: Path) -> None:
    from scissorcal.workday import FileIndex

    (path.parent / "a").write_bytes(b"content")
    index = FileIndex(path.parent)
    index.digest(path.parent / "a")
    index.save()
    index.path.replace(path)


def _read_state_index(path: Path) -> None:
    from scissorcal.workday import FileIndex

    folder = path.parent / "indexed"
    (folder / ".scissorcal").mkdir(parents=True, exist_ok=True)
    (folder / ".scissorcal" / "index.json").write_bytes(path.read_bytes())
    (folder / "a").write_bytes(b"content")
    assert FileIndex(folder).digest(folder / "a") == bytes_digest(b"content")


def _rng(seed: int) -> np.random.Generator:
    return np.random.default_rng(seed)


def _mat(path: Path) -> None:
    savemat(path, mat_variables(), do_compression=True)


def _plain_mat(path: Path) -> None:
    savemat(path, mat_variables())


def _opencv(path: Path) -> None:
    write_camera_file(CAMERA, path, "opencv")


def _ros(path: Path) -> None:
    write_camera_file(CAMERA, path, "ros")


def _csv(path: Path) -> None:
    written(path, rows(200))


def _copied_recipe(path: Path) -> None:
    path.write_bytes(recipe_path("paper-80gsm").read_bytes())


SAMPLES: dict[str, Sample] = {
    "recipe TOML": Sample("recipe.toml", _copied_recipe, _recipe),
    "log CSV": Sample("log.csv", _csv, _log(COLUMNS, UNITS)),
    "log Parquet": Sample("log.parquet", _parquet, _log(COLUMNS, UNITS)),
    "MATLAB 5": Sample("log5.mat", _mat, _log(MAT_COLUMNS, MAT_UNITS)),
    "MATLAB 5, not packed": Sample("plain5.mat", _plain_mat, _log(MAT_COLUMNS, MAT_UNITS)),
    "MATLAB 7.3": Sample("log73.mat", written_mat73, _log(MAT_COLUMNS, MAT_UNITS)),
    "recording MCAP": Sample("a.mcap", _recording, _read_recording, sealed_recording),
    "fit netCDF": Sample("plate.nc", _fit("plate"), _read_fit("plate"), sealed_fit),
    "fit of friction": Sample("friction.nc", _fit("friction"), _read_fit("friction"), sealed_fit),
    "fit of a camera": Sample("camera.nc", _fit("camera"), _read_fit("camera"), sealed_fit),
    "trust check": Sample("cut.verify.json", _trust_check, _read_trust_check),
    "OpenCV YAML": Sample("camera.yml", _opencv, _read_camera),
    "OpenCV YAML 1.0": Sample("camera1.yml", _camera(OPENCV_1), _read_camera),
    "OpenCV XML": Sample("camera.xml", _opencv, _read_camera),
    "OpenCV JSON": Sample("opencv.json", _opencv, _read_camera),
    "ROS YAML": Sample("ros.yaml", _ros, _read_camera),
    "ROS message": Sample("message.yaml", _camera(ROS_MESSAGE), _read_camera),
    "Kalibr YAML": Sample("kalibr.yaml", _camera(KALIBR), _read_camera),
    "JPEG": Sample("a.jpg", _photo("JPEG", exif=b"Exif\0\0II*\0\x08\0\0\0\0\0"), _read_photo),
    "PNG": Sample("a.png", _photo("PNG"), _read_photo, sealed_png),
    "PNG, 16 bits": Sample("deep.png", _deep_photo, _read_photo, sealed_png),
    "TIFF": Sample("a.tif", _photo("TIFF", compression="tiff_lzw"), _read_photo),
    "BMP": Sample("a.bmp", _photo("BMP"), _read_photo),
    "WebP": Sample("a.webp", _photo("WEBP"), _read_photo),
    "model package": Sample("paper.zip", _package, _read_package, sealed_package),
    "report.json": Sample("report.json", _report, _read_report),
    "signature.json": Sample("signature.json", _signature, _read_signature),
    "private key": Sample("key", _private_key, _read_private_key),
    "public keys": Sample("keys.pub", _public_keys, read_public_keys),
    "capture.json": Sample("capture.json", _photo_index, _read_photo_index),
    "path CSV": Sample("path.csv", _path, _read_path),
    "drawing SVG": Sample("plate.svg", _drawing, _read_drawing),
    "surface CSV": Sample("heights.csv", _surface, _read_surface),
    "positions CSV": Sample("positions.csv", _positions, _read_positions),
    "track of lines": Sample("track.jsonl", _track_lines, _read_track_lines),
    "checkpoint": Sample("walks.npz", _checkpoint, _read_checkpoint, changed_member),
    "file index": Sample("index.json", _state_index, _read_state_index),
}
"""By the names of the table."""
