"""Which program wrote a camera file, and what it can export where its own file is not read."""

import re
from collections.abc import Mapping
from typing import Any

from scissorcal.foreign.text_tree import TYPE_KEY
from scissorcal.vision.camera_files.keys import plain
from scissorcal.vision.camera_files.refusal import RefusedError

_COLMAP = re.compile(
    r"\A(#[^\n]*\n)*\s*\d+\s+(SIMPLE_|FULL_|THIN_|RADIAL|PINHOLE|OPENCV|FOV|RAD_)\w*\s+\d+\s+\d+\s",
)
_INI = re.compile(r"\A\s*(#[^\n]*\n\s*)*\[image\]", re.IGNORECASE)
_ASSIGNED = re.compile(r"[\w.]+\s*=")
_AS_OPENCV = "width, height, camera_matrix and distortion_coefficients (k1, k2, p1, p2, k3)"


def refuse_other_text(text: str) -> None:
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


def refuse_other_names(tree: Mapping[str, Any]) -> None:
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
    parts += [one for value in tree.values() if isinstance(value, list) for one in value]
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
