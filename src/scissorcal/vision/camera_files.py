"""Camera files: read from OpenCV, ROS and Kalibr, written for OpenCV and ROS."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np

from scissorcal.errors import InputError, file_error
from scissorcal.files import replacing
from scissorcal.foreign import read_foreign_text
from scissorcal.foreign.formats import CAMERA
from scissorcal.foreign.text_tree import parse_yaml
from scissorcal.vision.geometry.camera import Camera
from scissorcal.vision.opencv_storage import matrix_of, number_of, read_storage
from scissorcal.vision.photo_decoding import MOST_SIDE_PX

Style = Literal["opencv", "ros"]

MATRIX_KEYS = ("camera_matrix", "cameraMatrix", "Camera_Matrix", "K", "M1", "intrinsic_matrix")
DISTORTION_KEYS = (
    "distortion_coefficients",
    "dist_coeffs",
    "distCoeffs",
    "Distortion_Coefficients",
    "D",
    "D1",
)

_WIDTHS, _HEIGHTS = (
    ("image_width", "image_Width", "width"),
    ("image_height", "image_Height", "height"),
)
_RMS = ("avg_reprojection_error", "rms")
LARGEST_NUMBER = 1e7
"""Of focal lengths and centres in pixels, and of distortion coefficients."""
_ROS_MODELS = ("plumb_bob", "rational_polynomial")


@dataclass(frozen=True)
class CameraFile:
    """A file's camera, its format, and its rms reprojection error in pixels."""

    camera: Camera
    style: Literal["OpenCV", "ROS", "Kalibr"]
    rms_px: float | None


def read_camera_file(path: Path) -> CameraFile:
    """Read an OpenCV (YAML or XML), ROS camera_info or Kalibr camchain file, recognised by content.

    Distortion must be the pinhole camera's radial-tangential one (plumb_bob, radtan; up to k6).
    None of these files holds a covariance. Raises InputError with what is missing or unsupported.
    """
    text = read_foreign_text(path, CAMERA)
    start = text.lstrip(" \t\r\n")
    of_opencv = start.startswith(("%YAML", "<?xml", "<opencv_storage", "{"))
    try:
        if of_opencv or "!!opencv-matrix" in text:
            return _opencv(path, read_storage(text))
        facts = parse_yaml(text)
    except ValueError as error:
        what = "damaged" if of_opencv else "not readable YAML"
        raise InputError(f"{path} is {what} ({error}). {CAMERA.remedy}") from None
    return _plain_yaml(path, facts)


def write_camera_file(camera: Camera, path: Path, style: Style, name: str = "camera") -> Path:
    """Write a camera as OpenCV (.yml, .yaml, .xml or .json) or ROS camera_info (.yaml).

    Neither format holds a covariance. The file is written atomically. Raises
    InputError where the ending does not fit the style.
    """
    endings = (".yml", ".yaml", ".xml", ".json") if style == "opencv" else (".yaml", ".yml")
    if path.suffix.lower() not in endings:
        raise InputError(f"{path} must end in one of {', '.join(endings)} for {style}.")
    text = _opencv_text(camera, path.suffix.lower()) if style == "opencv" else _ros(camera, name)
    try:
        with replacing(path) as part:
            part.write_text(text, "utf-8")
    except OSError as error:
        raise file_error(error, path) or error from None
    return path


def _opencv(path: Path, facts: Mapping[str, Any]) -> CameraFile:
    def first(keys: Sequence[str], read: Callable[[Any], Any]) -> Any:
        found = (read(facts[key]) for key in keys if key in facts)
        return next((value for value in found if value is not None), None)

    K, bend = first(MATRIX_KEYS, matrix_of), first(DISTORTION_KEYS, matrix_of)
    if K is None or np.shape(K) != (3, 3):
        raise InputError(f"{path} has no 3 x 3 matrix called {' or '.join(MATRIX_KEYS[:2])}.")
    if number_of(facts.get("fisheye_model")):
        raise InputError(f"{path} has a fisheye model; {_ONLY_PINHOLE}")
    size = first(_WIDTHS, number_of), first(_HEIGHTS, number_of)
    camera = _camera(path, K, np.zeros(5) if bend is None else bend, size)
    return CameraFile(camera, "OpenCV", first(_RMS, number_of))


def _plain_yaml(path: Path, facts: Any) -> CameraFile:
    if not isinstance(facts, Mapping):
        raise InputError(f"{path} is not a camera file of OpenCV, ROS or Kalibr.")
    try:
        if any(str(key).startswith("cam") and _is_kalibr(facts[key]) for key in facts):
            return _kalibr(path, facts)
        if "camera_matrix" in facts or "K" in facts or "k" in facts:
            return _from_ros(path, facts)
    except (KeyError, TypeError, ValueError, IndexError) as error:
        raise InputError(f"{path} is incomplete ({error}): save it again.") from None
    raise InputError(
        f"{path} is not a camera file of OpenCV, ROS or Kalibr: it has neither camera_matrix nor "
        "cam0."
    )


def _is_kalibr(part: Any) -> bool:
    return isinstance(part, Mapping) and "intrinsics" in part


def _kalibr(path: Path, facts: Mapping[str, Any]) -> CameraFile:
    cameras = [key for key in facts if _is_kalibr(facts[key])]
    if len(cameras) > 1:
        raise InputError(
            f"{path} has {len(cameras)} cameras ({', '.join(cameras)}): keep only the rig's."
        )
    part = facts[cameras[0]]
    model = part.get("camera_model", "pinhole"), part.get("distortion_model", "radtan")
    if model not in (("pinhole", "radtan"), ("pinhole", "none")):
        raise InputError(f"{path} has the model {'-'.join(map(str, model))}; {_ONLY_PINHOLE}")
    fx, fy, cx, cy = _numbers(part["intrinsics"])
    K = np.array([[fx, 0.0, cx], [0.0, fy, cy], [0.0, 0.0, 1.0]])
    bend = np.array(_numbers(part.get("distortion_coeffs", [])))
    width, height = _numbers(part["resolution"])
    return CameraFile(_camera(path, K, bend, (width, height)), "Kalibr", None)


def _from_ros(path: Path, facts: Mapping[str, Any]) -> CameraFile:
    def data(*keys: str) -> Any:
        found: Any = next((facts[key] for key in keys if key in facts), [])
        return np.array(_numbers(found["data"] if isinstance(found, Mapping) else found))

    model = facts.get("distortion_model", "plumb_bob")
    if model not in _ROS_MODELS:
        raise InputError(f"{path} has the model {model}; {_ONLY_PINHOLE}")
    size = tuple(
        next((_number(facts[key]) for key in keys if key in facts), None)
        for keys in (_WIDTHS, _HEIGHTS)
    )
    K = data("camera_matrix", "K", "k").reshape(3, 3)
    bend = data("distortion_coefficients", "D", "d")
    return CameraFile(_camera(path, K, bend, (size[0], size[1])), "ROS", None)


def _numbers(words: Any) -> list[float]:
    if not isinstance(words, list):
        raise ValueError("an entry that is no list of numbers")  # noqa: TRY004 - of a file
    return [_number(word) for word in words]


def _number(word: Any) -> float:
    value = number_of(word)
    if value is None:
        raise ValueError(f"{str(word)[:40]!r} is no number")
    return value


_ONLY_PINHOLE = (
    "scissorcal supports only the pinhole model with radial and tangential distortion (plumb_bob, "
    "radtan). Calibrate the camera with 'scissorcal capture camera'."
)


def _camera(path: Path, K: Any, bend: Any, size: tuple[float | None, float | None]) -> Camera:
    width, height = size
    if not width or not height:
        raise InputError(f"{path} has no picture size: add image_width and image_height.")
    if not all(1.0 <= side <= MOST_SIDE_PX and side == int(side) for side in (width, height)):
        raise InputError(f"{path} has a picture size of {width:g} x {height:g}: correct it.")
    coefficients = [float(value) for value in np.ravel(bend)]
    if any(coefficients[8:]):
        raise InputError(f"{path} has {len(coefficients)} distortion coefficients; {_ONLY_PINHOLE}")
    coefficients = coefficients[:8] if any(coefficients[5:8]) else coefficients[:5]
    coefficients += [0.0] * (5 - len(coefficients))
    if len(coefficients) > 5:
        coefficients += [0.0] * (8 - len(coefficients))
    fx, fy, cx, cy = (float(K[at]) for at in ((0, 0), (1, 1), (0, 2), (1, 2)))
    if not all(math.isfinite(value) for value in (fx, fy, cx, cy, *coefficients)):
        raise InputError(f"{path} has numbers that are not finite.")
    if max(map(abs, (fx, fy, cx, cy, *coefficients))) > LARGEST_NUMBER:
        raise InputError(f"{path} has a number above {LARGEST_NUMBER:g}, which no camera has.")
    if min(fx, fy) <= 0.0 or abs(float(K[0, 1])) > 1e-6 * fx:
        raise InputError(f"{path} has a camera matrix with a negative focal length or a skew.")
    return Camera(fx, fy, cx, cy, tuple(coefficients), int(width), int(height))


def _opencv_text(camera: Camera, ending: str) -> str:
    import cv2

    kinds = {".xml": cv2.FILE_STORAGE_FORMAT_XML, ".json": cv2.FILE_STORAGE_FORMAT_JSON}
    flags = cv2.FILE_STORAGE_WRITE | cv2.FILE_STORAGE_MEMORY
    storage = cv2.FileStorage("", flags | kinds.get(ending, cv2.FILE_STORAGE_FORMAT_YAML))
    storage.write("image_width", camera.width)
    storage.write("image_height", camera.height)
    storage.write("camera_matrix", camera.matrix)
    storage.write("distortion_coefficients", camera.coefficients.reshape(-1, 1))
    return str(storage.releaseAndGetString())


def _ros(camera: Camera, name: str) -> str:
    import yaml

    count = len(camera.distortion)
    projection = np.hstack([camera.matrix, np.zeros((3, 1))])

    def matrix(values: Any, rows: int, columns: int) -> dict[str, Any]:
        data = [float(value) for value in np.ravel(values)]
        return {"rows": rows, "cols": columns, "data": data}

    facts = {
        "image_width": camera.width,
        "image_height": camera.height,
        "camera_name": name,
        "camera_matrix": matrix(camera.matrix, 3, 3),
        "distortion_model": "plumb_bob" if count == 5 else "rational_polynomial",
        "distortion_coefficients": matrix(camera.distortion, 1, count),
        "rectification_matrix": matrix(np.eye(3), 3, 3),
        "projection_matrix": matrix(projection, 3, 4),
    }
    return yaml.safe_dump(facts, sort_keys=False, default_flow_style=None)
