"""Camera files of others: read as they mean it, refused where they mean another camera."""

from pathlib import Path

import cv2
import numpy as np
import pytest

from scissorcal.errors import InputError
from scissorcal.vision.camera_files import Style, read_camera_file, write_camera_file
from scissorcal.vision.geometry.camera import Camera

BEND = (0.1, -0.2, 0.001, 0.002, 0.3)
CAMERA = Camera(500.25, 501.5, 320.125, 240.5, BEND, 640, 480)
RATIONAL = Camera(500.25, 501.5, 320.125, 240.5, (*BEND, 0.01, 0.02, -0.03), 640, 480)

KALIBR = """cam0:
  cam_overlaps: []
  camera_model: pinhole
  distortion_coeffs: [-0.27, 0.06, 0.0009, 0.00003]
  distortion_model: radtan
  intrinsics: [461.6, 460.3, 362.7, 248.1]
  resolution: [752, 480]
  rostopic: /cam0/image_raw
"""

ROS_MESSAGE = """height: 480
width: 640
distortion_model: plumb_bob
d: [0.1, -0.2, 0.001, 0.002, 0.3]
k: [500.25, 0.0, 320.125, 0.0, 501.5, 240.5, 0.0, 0.0, 1.0]
"""

OPENCV_1 = """%YAML:1.0
---
image_width: 640
image_height: 480
cameraMatrix: !!opencv-matrix
   rows: 3
   cols: 3
   dt: d
   data: [ 500.25, 0., 320.125, 0., 501.5, 240.5, 0., 0., 1. ]
distCoeffs: !!opencv-matrix
   rows: 4
   cols: 1
   dt: d
   data: [ 0.1, -0.2, 0.001, 0.002 ]
avg_reprojection_error: 0.25
"""


@pytest.mark.parametrize("camera", [CAMERA, RATIONAL], ids=["five", "eight"])
@pytest.mark.parametrize(
    ("name", "style", "says"),
    [
        ("a.yml", "opencv", "OpenCV"),
        ("a.xml", "opencv", "OpenCV"),
        ("a.json", "opencv", "OpenCV"),
        ("a.yaml", "ros", "ROS"),
    ],
)
def test_what_is_written_is_read_back(
    tmp_path: Path, camera: Camera, name: str, style: Style, says: str
) -> None:
    read = read_camera_file(write_camera_file(camera, tmp_path / name, style))
    assert read.camera == camera
    assert read.style == says
    assert not list(tmp_path.glob("*.part"))


def test_opencv_reads_what_was_written_for_it(tmp_path: Path) -> None:
    path = write_camera_file(CAMERA, tmp_path / "a.yml", "opencv")
    storage = cv2.FileStorage(str(path), cv2.FILE_STORAGE_READ)
    assert np.array_equal(storage.getNode("camera_matrix").mat(), CAMERA.matrix)
    assert storage.getNode("distortion_coefficients").mat().ravel().tolist() == list(BEND)
    storage.release()


def read(tmp_path: Path, text: str, name: str = "camera.yaml") -> Camera:
    (tmp_path / name).write_text(text)
    return read_camera_file(tmp_path / name).camera


def test_camera_files_of_other_tools_are_read(tmp_path: Path) -> None:
    assert read(tmp_path, KALIBR) == Camera(
        461.6, 460.3, 362.7, 248.1, (-0.27, 0.06, 0.0009, 0.00003, 0.0), 752, 480
    )
    assert read(tmp_path, ROS_MESSAGE) == CAMERA
    assert read(tmp_path, OPENCV_1).distortion == (0.1, -0.2, 0.001, 0.002, 0.0)
    assert read_camera_file(tmp_path / "camera.yaml").rms_px == 0.25


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "is empty"),
        ("- 1\n", "is not a camera file"),
        ("a: 1\n", "no camera matrix (camera_matrix, K, intrinsics"),
        ("{{", "damaged"),
        ("%YAML:1.0\n---\ncamera_matrix: 5\n", "no picture size"),
        ("a: [1", "not readable YAML"),
        ("\x00\x01", "not readable YAML"),
        (OPENCV_1[:180], "damaged"),
        (OPENCV_1.replace("image_width", "breadth"), "image_height), and it has the keys breadth"),
        (OPENCV_1.replace("cameraMatrix", "matrix"), "no camera matrix (camera_matrix"),
        (OPENCV_1.replace("501.5", "-501.5"), "focal length is -501.5 px"),
        (OPENCV_1.replace("0.1, -0.2", ".nan, -0.2"), "not finite"),
        (KALIBR.replace("radtan", "equidistant"), "pinhole-equidistant"),
        (KALIBR.replace("[461.6, 460.3, 362.7, 248.1]", "[461.6]"), "1 numbers; fx, fy, cx"),
        (KALIBR + KALIBR.replace("cam0", "cam1"), "2 cameras (cam0, cam1)"),
        (ROS_MESSAGE.replace("plumb_bob", "equidistant"), "model equidistant"),
    ],
)
def test_unsupported_camera_files_are_refused(tmp_path: Path, text: str, words: str) -> None:
    with pytest.raises(InputError) as caught:
        read(tmp_path, text)
    assert words in str(caught.value)
    assert "camera.yaml" in str(caught.value)


def test_a_missing_file_and_a_wrong_ending_are_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="does not exist"):
        read_camera_file(tmp_path / "none.yaml")
    with pytest.raises(InputError, match="must end in"):
        write_camera_file(CAMERA, tmp_path / "a.txt", "ros")
    with pytest.raises(InputError, match="does not exist"):
        write_camera_file(CAMERA, tmp_path / "no" / "a.yaml", "ros")
