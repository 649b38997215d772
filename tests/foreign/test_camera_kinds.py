"""Camera files of many tools: read as they mean it, or refused for the true reason."""

import itertools
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st

from scissorcal.errors import InputError
from scissorcal.vision import CameraFile, read_camera_file

CASES = Path(__file__).parents[3] / "shared" / "cases" / "cameras"
MATRIX = [[900.0, 0.0, 642.0], [0.0, 905.0, 358.0], [0.0, 0.0, 1.0]]
FLAT = [number for row in MATRIX for number in row]
BEND = [-0.28, 0.09, 0.0004, -0.0007, 0.01]
PLAIN: dict[str, Any] = {
    "image_width": 1280,
    "image_height": 720,
    "camera_matrix": FLAT,
    "dist_coeffs": BEND,
}
ROS: dict[str, Any] = {
    "header": {"stamp": {"sec": 1, "nanosec": 2}, "frame_id": "cam"},
    "height": 720,
    "width": 1280,
    "distortion_model": "plumb_bob",
    "d": BEND,
    "k": FLAT,
    "r": np.eye(3).ravel().tolist(),
    "p": [900.0, 0.0, 642.0, 0.0, 0.0, 905.0, 358.0, 0.0, 0.0, 0.0, 1.0, 0.0],
    "binning_x": 1,
    "binning_y": 1,
    "roi": {"x_offset": 0, "y_offset": 0, "height": 0, "width": 0, "do_rectify": False},
}
KALIBR: dict[str, Any] = {
    "cam0": {
        "camera_model": "pinhole",
        "distortion_coeffs": BEND[:4],
        "distortion_model": "radtan",
        "intrinsics": [900.0, 905.0, 642.0, 358.0],
        "resolution": [1280, 720],
        "rostopic": "/cam0/image_raw",
    }
}
VINS: dict[str, Any] = {
    "model_type": "PINHOLE",
    "camera_name": "camera",
    "image_width": 1280,
    "image_height": 720,
    "distortion_parameters": dict(zip(("k1", "k2", "p1", "p2"), BEND, strict=False)),
    "projection_parameters": {"fx": 900.0, "fy": 905.0, "cx": 642.0, "cy": 358.0},
}
ORB = """%YAML:1.0
#----------------------------------
File.version: "1.0"
Camera.type: "PinHole"
Camera1.fx: 900.0
Camera1.fy: 905.0
Camera1.cx: 642.0
Camera1.cy: 358.0
Camera1.k1: -0.28
Camera1.k2: 0.09
Camera1.p1: 0.0004
Camera1.p2: -0.0007
Camera.width: 1280
Camera.height: 720
Camera.fps: 30
Camera.RGB: 1
ORBextractor.nFeatures: 1000
Viewer.KeyFrameSize: 0.05
"""
REALSENSE = {
    "width": 1280,
    "height": 720,
    "ppx": 642.0,
    "ppy": 358.0,
    "fx": 900.0,
    "fy": 905.0,
    "model": "distortion.brown_conrady",
    "coeffs": BEND,
}
BASALT = {
    "value0": {
        "T_imu_cam": [{"px": 0.0, "py": 0.0, "pz": 0.0}],
        "intrinsics": [
            {
                "camera_type": "pinhole-radtan8",
                "intrinsics": VINS["projection_parameters"]
                | VINS["distortion_parameters"]
                | {"k3": 0.01, "k4": 0.0, "k5": 0.0, "k6": 0.0, "rpmax": 2.7},
            }
        ],
        "resolution": [[1280, 720]],
    }
}
OKVIS = {
    "cameras": [
        {
            "T_SC": np.eye(4).ravel().tolist(),
            "image_dimension": [1280, 720],
            "distortion_coefficients": BEND[:4],
            "distortion_type": "radialtangential",
            "focal_length": [900.0, 905.0],
            "principal_point": [642.0, 358.0],
        }
    ]
}


class WrittenOut(yaml.SafeDumper):
    """Writes a list that stands twice, twice."""

    def ignore_aliases(self, data: Any) -> bool:
        return True


def written(content: Any) -> str:
    return yaml.dump(content, Dumper=WrittenOut, sort_keys=False)


def read(tmp_path: Path, content: Any, before: str = "") -> CameraFile:
    """Read a camera of a text, or of a mapping written as YAML after ``before``."""
    path = tmp_path / "camera.yaml"
    text = content if isinstance(content, str) else before + written(content)
    path.write_text(text, "utf-8")
    return read_camera_file(path)


def refusal(tmp_path: Path, content: Any) -> str:
    with pytest.raises(InputError) as caught:
        read(tmp_path, content)
    said = str(caught.value)
    assert said.startswith(str(tmp_path / "camera.yaml"))
    return said.removeprefix(str(tmp_path))


def is_the_camera(found: CameraFile) -> bool:
    camera = found.camera
    four = (camera.fx, camera.fy, camera.cx, camera.cy)
    size = (camera.width, camera.height)
    known = camera.distortion[:4] == tuple(BEND[:4]) and camera.distortion[4] in (0.0, BEND[4])
    return four == (900.0, 905.0, 642.0, 358.0) and size == (1280, 720) and known


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("cv_transposed.yml", "the matrix is transposed"),
        ("ros_melodic_fisheye_camera_model.yaml", "has the model fisheye"),
        ("kalibr_opencv_header.yaml", None),
        ("python_dump_flat.yaml", None),
        ("ros2_topic_echo.yaml", None),
    ],
)
def test_the_cases_are_read_or_refused_for_the_true_reason(name: str, words: str | None) -> None:
    path = CASES / name
    if not path.is_file():
        pytest.skip(f"{path} is absent")
    if words is None:
        assert is_the_camera(read_camera_file(path))
        return
    with pytest.raises(InputError, match=words):
        read_camera_file(path)


@pytest.mark.parametrize("before", ["", "%YAML:1.0\n---\n"])
@pytest.mark.parametrize(
    ("content", "origin"),
    [
        (PLAIN, "no named program"),
        (ROS, "ROS"),
        (KALIBR, "Kalibr"),
        (VINS, "VINS"),
        (REALSENSE, "RealSense"),
        (OKVIS, "OKVIS"),
        (BASALT, "no named program"),
    ],
)
def test_tools_are_read_and_named_whatever_the_heading(
    tmp_path: Path, content: dict[str, Any], origin: str, before: str
) -> None:
    found = read(tmp_path, content, before)
    assert is_the_camera(found)
    if not before or origin != "no named program":
        assert found.style == origin
    assert is_the_camera(read(tmp_path, json.dumps(content, indent=1)))


def test_orb_slam_is_read_and_named(tmp_path: Path) -> None:
    found = read(tmp_path, ORB)
    assert is_the_camera(found)
    assert found.style == "ORB-SLAM"
    assert found.notes[0].endswith("taken as k1, k2, p1, p2 (plumb_bob).")


MATRICES = {
    "flat": FLAT,
    "nested": MATRIX,
    "ros": {"rows": 3, "cols": 3, "data": FLAT},
    "rows only": {"data": FLAT},
    "named": {"fx": 900.0, "fy": 905.0, "cx": 642.0, "cy": 358.0},
}
BENDS = {"flat": BEND, "row": [BEND], "column": [[one] for one in BEND]}


@pytest.mark.parametrize("matrix_key", ["camera_matrix", "cameraMatrix", "K", "mtx", "intrinsics"])
@pytest.mark.parametrize("bend_key", ["dist_coeffs", "distCoeffs", "D", "dist", "distortion"])
def test_keys_and_forms_of_a_program_of_ones_own_are_read(
    tmp_path: Path, matrix_key: str, bend_key: str
) -> None:
    for matrix, bend in itertools.product(MATRICES.values(), BENDS.values()):
        found = read(tmp_path, {matrix_key: matrix, bend_key: bend, "image_size": [1280, 720]})
        assert is_the_camera(found)
        assert found.camera.distortion == tuple(BEND)
        assert "k1, k2, p1, p2, k3 (plumb_bob)" in found.notes[0]


def test_documents_of_one_camera_are_read_and_of_two_refused(tmp_path: Path) -> None:
    message = written(ROS)
    assert is_the_camera(read(tmp_path, f"{message}---\n"))
    later = message.replace("sec: 1", "sec: 7")
    assert is_the_camera(read(tmp_path, f"---\n{message}---\n{later}---\n"))
    assert "different cameras" in refusal(
        tmp_path, f"{message}---\n{message.replace('905', '906')}"
    )
    assert "has no names" in refusal(tmp_path, f"{message}---\nA message was lost\n")


MODEL_KEYS = [
    "camera_model",
    "distortion_model",
    "distortion_type",
    "model_type",
    "camera-model",
    "lens_model",
    "projection_model",
    "cam_model",
    "Camera.type",
    "model",
    "distortion_model_name",
]
OTHER_MODELS = [
    "fisheye",
    "equidistant",
    "KANNALA_BRANDT",
    "KannalaBrandt8",
    "kb4",
    "OPENCV_FISHEYE",
    "omni",
    "MEI",
    "omni-radtan",
    "fov",
    "atan",
    "ds",
    "double_sphere",
    "eucm",
    "thin_prism",
    "division",
    "ftheta",
    "cylindrical",
    "a model of tomorrow",
    "3",
]


@pytest.mark.parametrize("model", OTHER_MODELS)
def test_another_model_is_refused_as_that_model_under_any_key(tmp_path: Path, model: str) -> None:
    for key in MODEL_KEYS:
        said = refusal(tmp_path, PLAIN | {key: model})
        assert f"has the model {model} ({key})" in said
        assert "scissorcal supports only the pinhole model" in said
        wrapped = {"camera": PLAIN | {key: model, "camera_name": "left"}}
        assert f"has the model {model} (camera.{key})" in refusal(tmp_path, wrapped)


@pytest.mark.parametrize(
    "model", ["pinhole", "PinHole", "plumb_bob", "radtan", "radial-tangential", "Brown-Conrady"]
)
def test_the_supported_model_is_read_under_any_key(tmp_path: Path, model: str) -> None:
    for key in MODEL_KEYS:
        found = read(tmp_path, PLAIN | {key: model})
        assert is_the_camera(found)
        assert bool(found.notes) == (model.lower() == "pinhole")


@pytest.mark.parametrize(
    ("more", "words"),
    [
        ({"fisheye_model": 1}, "has fisheye_model of 1: the camera has a fisheye model"),
        ({"is_fisheye": True}, "the camera has a fisheye model"),
        ({"bFishEye": "yes"}, "the camera has a fisheye model"),
        ({"mirror_parameters": {"xi": 1.2}}, "a parameter of another model"),
        ({"xi": 0.9}, "a parameter of another model"),
        ({"skew": 0.4}, "skew of 0.4"),
        ({"b1": -1.2}, "b1 of -1.2"),
        ({"dist_coeffs": [*BEND, 0, 0, 0, 0.001, 0, 0, 0]}, "12 coefficients"),
        ({"dist_coeffs": [*BEND, 0.1]}, "6 coefficients"),
        ({"dist_coeffs": BEND[:2]}, "2 coefficients"),
        ({"dist_coeffs": [BEND[:4], BEND[:4]]}, "2 x 4 numbers where one row"),
        ({"dist_coeffs": [*BEND[:4], "nan"]}, "'nan' is no number"),
        ({"dist_coeffs": [*BEND[:4], ".nan"]}, "not finite"),
        ({"dist_coeffs": [*BEND[:4], 1e9]}, "which no camera has"),
        ({"dist_coeffs": "[-0.28, 0.09]"}, "'[-0.28, 0.09]' is no list of numbers"),
        ({"distortion_model": "none"}, "without distortion"),
        ({"distortion_model": "plumb_bob", "dist_coeffs": [*BEND, 0.1, 0, 0]}, "5 coefficients"),
        ({"distortion_model": "plumb_bob", "camera_model": "rational"}, "has the model rational"),
        ({"distortion_model": "plumb_bob", "model": "rational_polynomial"}, "states two models"),
        ({"D": [0.0] * 5}, "states dist_coeffs and D, which differ"),
        ({"K": MATRIX[::-1]}, "states camera_matrix and K, which differ"),
        ({"fx": 901.0}, "states camera_matrix 900 and fx 901"),
        ({"resolution": [640, 480]}, "states image_width 1280 and resolution 640"),
        ({"binning": {"x": 2, "y": 2}}, "pictures are smaller"),
        ({"binning_x": 2}, "binning_x: it is 2: pictures are smaller"),
        ({"roi": {"x_offset": 16, "width": 640}}, "roi: x_offset is 16"),
        ({"image_scale": 0.5}, "image_scale: a scale of 0.5"),
        ({"calibrated": False}, "calibrated false"),
        ({"calibrated_width": 2560}, "keys calibrated_width"),
        ({"calibration_valid": False}, "keys calibration_valid"),
        ({"refraction": 1.33}, "has the keys refraction, which are not known"),
        ({"camera_matrix": {"rows": 3, "cols": 3, "data": FLAT, "unit": "mm"}}, "keys unit are"),
        ({"M2": MATRIX}, "has a second camera (M2)"),
        ({"cam1": {"camera_matrix": FLAT}}, "has 2 cameras (camera_matrix, cam1)"),
        ({"camera_matrix": [*FLAT, 1.0]}, "10 numbers where a 3 x 3"),
        ({"camera_matrix": [[*row, 0.0] for row in MATRIX]}, "3 x 4 numbers where a 3 x 3"),
        ({"camera_matrix": [MATRIX[0], MATRIX[1], [0.0, 1.0]]}, "rows differ in length"),
        ({"RadialDistortion": [0.1, 0.2]}, "of MATLAB"),
        ({"FocalLength": [900, 905], "PrincipalPoint": [642, 358]}, "of MATLAB"),
        ({"K": "900 0 642; 0 905 358; 0 0 1"}, "K: '900 0 642; 0 905 358; 0 0 1' is no list"),
        ({"distortion_parameters": [0.1, 0.0, 0.0, 0.0]}, "which differ"),
        ({"lens": [16.0]}, "keys lens, which are not known"),
    ],
)
def test_what_would_change_the_camera_is_refused_by_name(
    tmp_path: Path, more: dict[str, Any], words: str
) -> None:
    assert words in refusal(tmp_path, PLAIN | more)


@pytest.mark.parametrize(
    "more",
    [
        {"fisheye_model": 0, "skew": 0, "xi": 0.0, "binning_x": 0, "scale": 1.0},
        {"roi": {"x_offset": 0, "y_offset": 0, "width": 1280, "height": 720}},
        {"calibration_time": "Fri", "flags": 2, "avg_reprojection_error": 0.2, "rvecs": [[1.0]]},
        {"camera_name": "left", "serial_number": "1", "date": "2026-01-02", "notes": ["fisheye"]},
        {"fx": 900.0, "fy": 905.0, "cx": 642.0, "cy": 358.0, "K": MATRIX, "resolution": "1280x720"},
    ],
)
def test_keys_without_effect_are_passed_over(tmp_path: Path, more: dict[str, Any]) -> None:
    assert is_the_camera(read(tmp_path, PLAIN | more))


def with_number(row: int, column: int, value: float) -> list[list[float]]:
    return [
        [value if (i, j) == (row, column) else one for j, one in enumerate(numbers)]
        for i, numbers in enumerate(MATRIX)
    ]


@pytest.mark.parametrize(
    ("matrix", "words"),
    [
        (np.transpose(MATRIX).tolist(), "transposed: its last row is 642, 358, 1"),
        (np.transpose(MATRIX).ravel().tolist(), "transposed"),
        (with_number(2, 2, 0.0), "the last row of the matrix is 0, 0, 0"),
        ((2.0 * np.array(MATRIX)).tolist(), "the last row of the matrix is 0, 0, 2"),
        (with_number(0, 1, 0.9), "skew of 0.9 (row 1, column 2), which shifts pixels by 0.64 px"),
        (with_number(1, 0, 0.9), "skew of 0.9 (row 2, column 1)"),
        (with_number(0, 0, -900.0), "focal length is -900 px"),
        (with_number(0, 0, 0.7), "fx is 0.7 px, 0.000547 picture widths"),
        (with_number(1, 1, 255.0), "fy is 255 px, 0.199 picture widths"),
        (with_number(0, 0, 25700.0), "fx is 25700 px, 20.1 picture widths"),
        (with_number(0, 0, 2000.0), "fx is 2.21 times fy"),
        (with_number(0, 2, -1.0), "outside the picture"),
        (with_number(1, 2, 721.0), "outside the picture"),
        (np.diag([900.0, 905.0, 1.0]).tolist(), "outside the picture"),
        (with_number(0, 2, float("nan")), "row 1, column 3 of the matrix is not finite"),
        ([[900.0, 0, 15.0], [0, 905.0, 18.0], [0, 0, 1]], "in its corner"),
        (np.zeros((3, 3)).tolist(), "the camera was not calibrated"),
    ],
)
def test_a_matrix_of_no_camera_is_refused_with_the_figure(
    tmp_path: Path, matrix: Any, words: str
) -> None:
    assert words in refusal(tmp_path, PLAIN | {"camera_matrix": matrix})


@pytest.mark.parametrize(
    "size",
    [
        {"image_width": 720, "image_height": 1280},
        {"image_size": [720, 1280]},
        {"image_shape": [1280, 720]},
        {"resolution": "720x1280"},
    ],
)
def test_swapped_width_and_height_are_named(tmp_path: Path, size: dict[str, Any]) -> None:
    lens = {"camera_matrix": FLAT, "dist_coeffs": BEND}
    assert "width and height are swapped" in refusal(tmp_path, lens | size)


@given(
    fx=st.floats(300.0, 10_000.0),
    stretch=st.floats(0.95, 1.05),
    centre=st.tuples(st.floats(0.42, 0.58), st.floats(0.42, 0.58)),
    size=st.sampled_from([(1280, 720), (720, 1280), (640, 480), (512, 512), (1280, 1024)]),
    skew=st.floats(-1e-6, 1e-6),
)
def test_no_usual_camera_is_refused_or_noted(
    tmp_path_factory: pytest.TempPathFactory,
    fx: float,
    stretch: float,
    centre: tuple[float, float],
    size: tuple[int, int],
    skew: float,
) -> None:
    cx, cy = centre[0] * size[0], centre[1] * size[1]
    matrix = [fx, skew, cx, 0.0, fx * stretch, cy, 0.0, 0.0, 1.0]
    content = ROS | {"k": matrix, "width": size[0], "height": size[1]}
    found = read(tmp_path_factory.mktemp("usual"), content)
    assert not found.notes
    assert (found.camera.fx, found.camera.cx) == (fx, cx)


def test_what_the_file_leaves_open_is_noted(tmp_path: Path) -> None:
    (note,) = read(tmp_path, PLAIN | {"dist_coeffs": []}).notes
    assert "taken as a pinhole without any" in note
    (note,) = read(tmp_path, ROS | {"distortion_model": "", "d": []}).notes
    assert "taken as a pinhole without any" in note
    (note,) = read(tmp_path, PLAIN | {"dist_coeffs": BEND[:4]}).notes
    assert "fisheye calibration has four, too" in note
    notes = read(tmp_path, ROS | {"k": [900.0, 0, 642, 0, 905, 216, 0, 0, 1]}).notes
    assert "20% of the picture off its middle" in notes[0]


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("# Camera list with one line of data per camera:\n1 PINHOLE 640 480 5 5 3 2\n", "COLMAP"),
        ("1 OPENCV 640 480 500 500 320 240 0 0 0 0\n", "cx - 0.5"),
        ("# oST version 5.0 parameters\n\n[image]\n\nwidth\n640\n", "ost.yaml"),
        (
            '<?xml version="1.0"?>\n<calibration>\n  <projection>frame</projection>\n'
            "<width>640</width></calibration>",
            "save it in the format of OpenCV",
        ),
        (" Intrinsic of Color:\n  PPX:  \t642\n  Distortion: Inverse Brown Conrady\n", "RealSense"),
        ("m: !!python/object/apply:numpy.core.multiarray._reconstruct\n- 1\n", "tolist()"),
        ("camera_matrix: [1]\ncamera_matrix: [2]\n", "camera_matrix stands there twice"),
        ("<a><width>6</width><width>5</width></a>", "width stands there twice"),
        (json.dumps([PLAIN, PLAIN | {"dist_coeffs": [0.0] * 5}]), "has 2 cameras in one list"),
        (written({"left": PLAIN, "right": PLAIN}), "has 2 cameras (left, right)"),
        (written(KALIBR).replace("radtan", "equidistant"), "pinhole-equidistant"),
        (written(VINS).replace("PINHOLE", "MEI"), "has the model MEI (model_type)"),
        (ORB.replace("PinHole", "KannalaBrandt8"), "has the model KannalaBrandt8 (Camera.type)"),
        ("[LEFT_CAM_HD]\nfx=700.1\nfy=700.1\n", "a text of assignments"),
        ("% Caltech\n\nfc = [ 657.4 ; 657.8 ];\n", "a text of assignments"),
        (json.dumps(PLAIN | {"LENS_DISTORTION": BEND}), "order is k1, k2, k3, p1, p2"),
        (json.dumps({"intrinsics": [{"key": 0, "value": {}}]}), "the keys intrinsics"),
        (ORB + "Camera2.fx: 1.0\n", "has a second camera (Camera2.fx)"),
        (ORB + "Camera.bFishEye: 1\n", "the camera has a fisheye model"),
        (json.dumps(REALSENSE | {"model": "distortion.inverse_brown_conrady"}), "inverse"),
        (json.dumps(REALSENSE | {"cy": 359.0}), "states ppy 358 and cy 359"),
        (json.dumps({key: REALSENSE[key] for key in REALSENSE if key != "ppy"}), "has no cy"),
    ],
)
def test_the_tool_is_named_with_what_to_export_instead(
    tmp_path: Path, text: str, words: str
) -> None:
    assert words in refusal(tmp_path, text)


def test_an_unused_inverse_model_is_a_pinhole(tmp_path: Path) -> None:
    """RealSense states it for colour streams whose pictures are without distortion."""
    unused = REALSENSE | {"model": "distortion.inverse_brown_conrady", "coeffs": [0.0] * 5}
    found = read(tmp_path, unused)
    assert not any(found.camera.distortion)
    assert not found.notes


@pytest.mark.parametrize(("rows", "columns"), [(-3, -3), (1.5, 6), (-1, -9), (0, 9)])
def test_a_matrix_of_impossible_sides_is_refused(
    tmp_path: Path, rows: float, columns: float
) -> None:
    matrix = {"rows": rows, "cols": columns, "data": FLAT}
    assert "with 9 numbers" in refusal(tmp_path, PLAIN | {"camera_matrix": matrix})


def test_thousands_of_unknown_keys_give_a_short_sentence(tmp_path: Path) -> None:
    more = {f"key{number}" * 9: number for number in range(2000)}
    assert len(refusal(tmp_path, PLAIN | more)) < 800
