"""Read a camera file of OpenCV, ROS, Kalibr and others; write one of OpenCV or ROS."""

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import cv2
import numpy as np

from scissorcal.errors import InputError, file_error
from scissorcal.files import replacing
from scissorcal.foreign import read_foreign_text
from scissorcal.foreign.formats import CAMERA
from scissorcal.foreign.reading import TYPE_KEY, parse_xml, parse_yaml
from scissorcal.vision.camera_files.assembling import camera_of
from scissorcal.vision.camera_files.keys import Facts, RefusedError, facts_of, number_of, plain
from scissorcal.vision.geometry.camera import Camera

Style = Literal["opencv", "ros"]


_COLMAP = re.compile(
    r"\A(#[^\n]*\n)*\s*\d+\s+(SIMPLE_|FULL_|THIN_|RADIAL|PINHOLE|OPENCV|FOV|RAD_)\w*\s+\d+\s+\d+\s",
)
_INI = re.compile(r"\A\s*(#[^\n]*\n\s*)*\[image\]", re.IGNORECASE)
_ASSIGNED = re.compile(r"[\w.]+\s*=")
_AS_OPENCV = "width, height, camera_matrix and distortion_coefficients (k1, k2, p1, p2, k3)"


@dataclass(frozen=True)
class CameraFile:
    """A file's camera, the program that wrote it, its rms reprojection error in pixels, and notes.

    ``notes`` are sentences on what the file leaves open, such as its distortion model, and on
    numbers that are unusual.
    """

    camera: Camera
    style: str
    rms_px: float | None
    notes: tuple[str, ...]


def read_camera_file(path: Path) -> CameraFile:
    """Read a camera of the pinhole model with radial-tangential distortion, up to k6.

    The file is YAML, JSON or XML of OpenCV, ROS (camera_info), Kalibr, VINS, ORB-SLAM, OKVIS,
    RealSense, or of a program's own with the same names. Every key in it is known, or known to be
    without effect on the camera. None of these files holds a covariance. Raises InputError with
    what is unknown, missing, unsupported, or no camera's.
    """
    text = read_foreign_text(path, CAMERA)
    try:
        _refuse_other_text(text)
        return _one_of([_read(tree, text) for tree in _documents(text)])
    except RefusedError as refused:
        where = f"{path}, {refused.place}:" if refused.place else f"{path}"
        raise InputError(f"{where} {refused.sentence}") from None


def _one_of(cameras: list[CameraFile]) -> CameraFile:
    """The camera that all documents of a file state."""
    if not cameras:
        raise RefusedError("is not a camera file of OpenCV, ROS or Kalibr: it holds nothing.")
    if any(file.camera != cameras[0].camera for file in cameras):
        raise RefusedError(f"has {len(cameras)} documents with different cameras. Keep one.")
    return cameras[0]


def _documents(text: str) -> list[Any]:
    """What the text holds; several documents where it has them, as of ``ros2 topic echo``."""
    start = text.lstrip(" \t\r\n")
    try:
        trees = [parse_xml(text)] if start.startswith("<") else parse_yaml(text)
    except ValueError as error:
        marked = start.startswith(("%YAML", "<", "{")) or "!!opencv-matrix" in text
        what = "damaged" if marked else "not readable YAML"
        raise RefusedError(f"is {what} ({error}). {CAMERA.remedy}") from None
    return [tree for tree in trees if tree != ""]


def _read(tree: Any, text: str) -> CameraFile:
    while isinstance(tree, list) and len(tree) == 1:
        tree = tree[0]
    if isinstance(tree, list) and any(isinstance(item, dict) for item in tree):
        raise RefusedError(f"has {len(tree)} cameras in one list: keep only the rig's.")
    if not isinstance(tree, dict):
        raise RefusedError("is not a camera file of OpenCV, ROS or Kalibr: it has no names.")
    _refuse_other_names(tree)
    facts = facts_of(tree)
    camera, notes = camera_of(facts)
    return CameraFile(camera, origin_of(tree, text), _rms(facts), notes)


def _rms(facts: Facts) -> float | None:
    values = [number_of(entry.value) for entry in facts.get("rms")]
    return next((value for value in values if value is not None and math.isfinite(value)), None)


def _refuse_other_text(text: str) -> None:
    """Raise RefusedError on a text of a known program that is no YAML, JSON or XML of a camera."""
    if _COLMAP.match(text) or text.startswith("# Camera list with one line of data per camera"):
        raise RefusedError(
            "is a list of cameras of COLMAP, whose first pixel has its centre at 0.5, 0.5. Of the "
            f"models PINHOLE and OPENCV, write {_AS_OPENCV} with cx - 0.5 and cy - 0.5 as JSON."
        )
    if _INI.match(text):
        raise RefusedError(
            "is the INI file of ROS camera_calibration. Import the ost.yaml beside it, or convert "
            "it: ros2 run camera_calibration_parsers convert ost.ini ost.yaml."
        )
    if "<calibration" in text and re.search(r"<(f|projection)>", text):
        raise RefusedError(
            "is a calibration of Agisoft Metashape, which counts cx and cy from the picture's "
            "middle and exchanges p1 and p2. In Tools > Camera Calibration, save it in the "
            "format of OpenCV (*.xml), with b1, b2, k4, p3 and p4 fixed at zero."
        )
    if re.search(r"\bPPX\s*:", text) and "Distortion:" in text:
        raise RefusedError(
            "is what rs-enumerate-devices of RealSense prints. Import the topic of the camera: "
            "ros2 topic echo --once /camera/camera/color/camera_info > camera.yaml."
        )
    lines = (line.strip() for line in text.splitlines())
    first = next((line for line in lines if line and line[0] not in "#;%["), "")
    if _ASSIGNED.match(first):
        raise RefusedError(
            "is a text of assignments (name = value), as of an INI file or of MATLAB. Write "
            f"{_AS_OPENCV} as JSON."
        )
    if "numpy." in text and "_reconstruct" in text:
        raise RefusedError(
            "holds numpy arrays as yaml.dump writes them. Write camera_matrix.tolist() and "
            "dist_coeffs.tolist() instead."
        )


def _refuse_other_names(tree: Mapping[str, Any]) -> None:
    """Raise RefusedError on names of MATLAB, whose first pixel is at 1, 1, or of Android."""
    inner = [key for value in tree.values() if isinstance(value, Mapping) for key in value]
    names = {*tree, *inner}
    if "LENS_DISTORTION" in names:
        raise RefusedError(
            "has LENS_DISTORTION of Android, whose order is k1, k2, k3, p1, p2. Write them as "
            "distortion_coefficients in the order k1, k2, p1, p2, k3."
        )
    distortion = {"radialdistortion", "tangentialdistortion"} & {plain(key) for key in names}
    if distortion or {"FocalLength", "PrincipalPoint"} <= names or "IntrinsicMatrix" in names:
        raise RefusedError(
            "holds camera parameters with the names of MATLAB, whose first pixel is at 1, 1. "
            "Convert them with cameraIntrinsicsToOpenCV, and write "
            f"{_AS_OPENCV} with jsonencode."
        )


def origin_of(tree: Mapping[str, Any], text: str) -> str:
    """The program that wrote a file, by its keys; "no named program" where they tell none."""
    parts = [value for value in tree.values() if isinstance(value, Mapping)]
    parts += [item for value in tree.values() if isinstance(value, list) for item in value]
    inner = [key for part in parts if isinstance(part, Mapping) for key in part]
    names = {plain(key) for key in [*tree, *inner]}
    if "projectionparameters" in names:
        return "VINS"
    if any(re.match(r"Camera1?\.", key) for key in tree):
        return "ORB-SLAM"
    if "imagedimension" in names and "principalpoint" in names:
        return "OKVIS"
    if {"intrinsics", "resolution"} <= names and "sensortype" in names:
        return "EuRoC"
    if {"intrinsics", "resolution"} <= names and any(re.match(r"cam\d", key) for key in tree):
        return "Kalibr"
    if {"ppx", "ppy"} <= names:
        return "RealSense"
    if {"rectificationmatrix", "projectionmatrix"} & names or {"k", "d"} <= names:
        return "ROS"
    typed = any(
        part.get(TYPE_KEY) == "opencv-matrix" for part in parts if isinstance(part, Mapping)
    )
    if typed or text.startswith("%YAML:1.0"):
        return "OpenCV"
    return "no named program"


def write_camera_file(camera: Camera, path: Path, style: Style) -> Path:
    """Write a camera as OpenCV (.yml, .yaml, .xml or .json) or ROS camera_info (.yaml).

    Neither format holds a covariance. The file is written atomically. Raises
    InputError where the ending does not fit the style.
    """
    endings = (".yml", ".yaml", ".xml", ".json") if style == "opencv" else (".yaml", ".yml")
    if path.suffix.lower() not in endings:
        raise InputError(f"{path} must end in one of {', '.join(endings)} for {style}.")
    text = _opencv_text(camera, path.suffix.lower()) if style == "opencv" else _ros(camera)
    try:
        with replacing(path) as part:
            part.write_text(text, "utf-8")
    except OSError as error:
        raise file_error(error, path) or error from None
    return path


def _opencv_text(camera: Camera, ending: str) -> str:
    kinds = {".xml": cv2.FILE_STORAGE_FORMAT_XML, ".json": cv2.FILE_STORAGE_FORMAT_JSON}
    flags = cv2.FILE_STORAGE_WRITE | cv2.FILE_STORAGE_MEMORY
    storage = cv2.FileStorage("", flags | kinds.get(ending, cv2.FILE_STORAGE_FORMAT_YAML))
    storage.write("image_width", camera.width)
    storage.write("image_height", camera.height)
    storage.write("camera_matrix", camera.matrix)
    storage.write("distortion_coefficients", camera.coefficients.reshape(-1, 1))
    return str(storage.releaseAndGetString())


def _ros(camera: Camera) -> str:
    import yaml

    count = len(camera.distortion)
    projection = np.hstack([camera.matrix, np.zeros((3, 1))])

    def matrix(values: Any, rows: int, columns: int) -> dict[str, Any]:
        data = [float(value) for value in np.ravel(values)]
        return {"rows": rows, "cols": columns, "data": data}

    facts = {
        "image_width": camera.width,
        "image_height": camera.height,
        "camera_name": "camera",
        "camera_matrix": matrix(camera.matrix, 3, 3),
        "distortion_model": "plumb_bob" if count == 5 else "rational_polynomial",
        "distortion_coefficients": matrix(camera.distortion, 1, count),
        "rectification_matrix": matrix(np.eye(3), 3, 3),
        "projection_matrix": matrix(projection, 3, 4),
    }
    return yaml.safe_dump(facts, sort_keys=False, default_flow_style=None)
