"""Read a camera file of OpenCV, ROS, Kalibr and others, recognised by its content."""

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from scissorcal.errors import InputError
from scissorcal.foreign import read_foreign_text
from scissorcal.foreign.formats import CAMERA
from scissorcal.foreign.text_tree import parse_xml, parse_yaml
from scissorcal.vision.camera_files.assembling import camera_of
from scissorcal.vision.camera_files.keys import Facts, facts_of
from scissorcal.vision.camera_files.origins import origin_of, refuse_other_names, refuse_other_text
from scissorcal.vision.camera_files.refusal import RefusedError
from scissorcal.vision.geometry.camera import Camera
from scissorcal.vision.opencv_storage import number_of


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
        refuse_other_text(text)
        return _one_of([_read(tree, text) for tree in _documents(text)])
    except RefusedError as refused:
        where = f"{path}, {refused.place}:" if refused.place else f"{path}"
        raise InputError(f"{where} {refused.sentence}") from None


def _one_of(found: list[CameraFile]) -> CameraFile:
    """The camera that all documents of a file state."""
    if not found:
        raise RefusedError("is not a camera file of OpenCV, ROS or Kalibr: it holds nothing.")
    if any(one.camera != found[0].camera for one in found):
        raise RefusedError(f"has {len(found)} documents with different cameras. Keep one.")
    return found[0]


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
    if isinstance(tree, list) and any(isinstance(one, dict) for one in tree):
        raise RefusedError(f"has {len(tree)} cameras in one list: keep only the rig's.")
    if not isinstance(tree, dict):
        raise RefusedError("is not a camera file of OpenCV, ROS or Kalibr: it has no names.")
    refuse_other_names(tree)
    facts = facts_of(tree)
    camera, notes = camera_of(facts)
    return CameraFile(camera, origin_of(tree, text), _rms(facts), notes)


def _rms(facts: Facts) -> float | None:
    values = [number_of(entry.value) for entry in facts.get("rms")]
    return next((value for value in values if value is not None and math.isfinite(value)), None)
