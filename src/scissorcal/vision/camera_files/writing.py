"""Camera files of OpenCV and of ROS, as they read them themselves."""

from pathlib import Path
from typing import Any, Literal

import numpy as np

from scissorcal.errors import InputError, file_error
from scissorcal.files import replacing
from scissorcal.vision.geometry.camera import Camera

Style = Literal["opencv", "ros"]


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
