"""A camera of the entries of a file, and notes on what the file leaves open."""

from collections.abc import Sequence
from typing import Literal

import numpy as np

from scissorcal.aliases import Array
from scissorcal.vision.camera_files.keys import (
    ONLY_PINHOLE,
    Distortion,
    Entry,
    Facts,
    RefusedError,
    distortion_of,
    is_off,
    is_zero,
    refused_model,
    short,
    shown,
)
from scissorcal.vision.camera_files.values import (
    array_at,
    check_coefficients,
    check_matrix,
    check_size,
    number_at,
    size_at,
    vector_at,
)
from scissorcal.vision.camera_files.vocabulary import OWN
from scissorcal.vision.geometry.camera import Camera

_COEFFICIENTS = ("k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6")
_LENGTHS = (0, 4, 5, 8, 12, 14)
"""OpenCV's numbers of coefficients; beyond eight are thin prisms and a tilted sensor."""


def camera_of(facts: Facts) -> tuple[Camera, tuple[str, ...]]:
    """The camera that the entries state, and sentences on what they leave open.

    Raises RefusedError with the first cause: another model, a key that is not known, what is
    missing, and then what no camera has.
    """
    model = _model(facts)
    _refuse_other_parameters(facts)
    _refuse_unknown(facts)
    _refuse_unfinished(facts)
    width, height = _size(facts)
    _refuse_part_of_picture(facts, width, height)
    K, place = _matrix(facts)
    notes = check_matrix(K, width, height, place)
    coefficients = _distortion(facts, model)
    if model == "open":
        notes.append(_said_of_open_model(coefficients, facts))
    fx, fy, cx, cy = (float(K[at]) for at in ((0, 0), (1, 1), (0, 2), (1, 2)))
    bend = tuple(float(value) for value in coefficients)
    bend += (0.0,) * ((5 if len(bend) <= 5 else 8) - len(bend))
    return Camera(fx, fy, cx, cy, bend, int(width), int(height)), tuple(notes)


def _model(facts: Facts) -> Distortion | Literal["open"]:
    """The distortion that the file states, or "open"; raises RefusedError on another model."""
    for entry in facts.get("switch"):
        what = refused_model(entry.place) or "another model"
        of = f" of {short(entry.value)}" if isinstance(entry.value, str) else ""
        raise RefusedError(f"has {entry.place}{of}: the camera has {what}. {ONLY_PINHOLE}")
    stated = facts.get("model")
    for entry in stated:
        kind = refused_model(str(entry.value))
        if kind and not ("Brown" in kind and _without_distortion(facts)):
            name = "-".join(short(stated_distortion.value) for stated_distortion in stated)
            raise RefusedError(f"has the model {name} ({entry.place}), {kind}; {ONLY_PINHOLE}")
    distortion: Distortion | Literal["open"] = "open"
    for entry in stated:
        unused = refused_model(str(entry.value)) is not None
        stated_distortion = "none" if unused else distortion_of(str(entry.value))
        if stated_distortion is None or not isinstance(entry.value, str):
            raise RefusedError(
                f"has the model {short(entry.value)} ({entry.place}), which is not known. Where "
                f"that is the name of a product, delete it; otherwise {ONLY_PINHOLE}"
            )
        if stated_distortion != "open" and distortion not in ("open", stated_distortion):
            raise RefusedError(
                f"states two models ({shown([str(e.value) for e in stated])}): correct it."
            )
        distortion = stated_distortion if stated_distortion != "open" else distortion
    return distortion


def _without_distortion(facts: Facts) -> bool:
    entries = facts.get("distortion", *_COEFFICIENTS)
    return bool(entries) and all(is_zero(entry.value) for entry in entries)


def _refuse_other_parameters(facts: Facts) -> None:
    for entry in facts.get("zero"):
        if not is_zero(entry.value):
            raise RefusedError(
                f"has {entry.place} of {short(entry.value)}, a parameter of another model; "
                f"{ONLY_PINHOLE}"
            )
    for entry in facts.get("one"):
        if number_at(entry) != 1.0:
            raise RefusedError(
                f"a scale of {short(entry.value)} leaves open which picture the matrix is for. "
                "Write the matrix for the size that is stated, and delete the scale.",
                entry.place,
            )


def _refuse_unfinished(facts: Facts) -> None:
    for entry in facts.get("done"):
        if is_off(entry.value):
            raise RefusedError(
                f"states {entry.place} {short(entry.value)}: the calibration failed. Repeat it."
            )


def _refuse_unknown(facts: Facts) -> None:
    """Raise RefusedError on keys that are not known, with what is missing where that is so."""
    missing = []
    if not facts.get(*OWN):
        missing.append("no camera matrix (camera_matrix, K, intrinsics, or fx, fy, cx and cy)")
    if not facts.get("size", "shape") and not (facts.get("width") and facts.get("height")):
        missing.append("no picture size (image_width and image_height)")
    unknown = f"the keys {shown(facts.unknown)}, which are not known" if facts.unknown else ""
    if len(missing) > 1:
        has = " and ".join([*missing, unknown] if unknown else missing)
        raise RefusedError(f"has {has}. It is not a camera file of OpenCV, ROS or Kalibr.")
    if missing:
        also = f", and it has {unknown}" if unknown else ""
        raise RefusedError(f"has {missing[0]}{also}. Add what is missing, or save the file again.")
    if unknown:
        raise RefusedError(
            f"has {unknown}. Delete them if they leave the camera as it is, or calibrate with "
            "'scissorcal capture camera'."
        )


def _size(facts: Facts) -> tuple[float, float]:
    sizes = [(entry, size_at(entry)) for entry in facts.get("size")]
    sizes += [(entry, size_at(entry)[::-1]) for entry in facts.get("shape")]
    widths = [(entry.place, number_at(entry)) for entry in facts.get("width")]
    heights = [(entry.place, number_at(entry)) for entry in facts.get("height")]
    width = _agreed(widths + [(entry.place, size[0]) for entry, size in sizes])
    height = _agreed(heights + [(entry.place, size[1]) for entry, size in sizes])
    assert width is not None  # as _refuse_unknown has found them
    assert height is not None
    check_size(width, height)
    return width, height


def _agreed(stated: Sequence[tuple[str, float]]) -> float | None:
    """The one value of several entries; RefusedError where they differ."""
    for place, value in stated[1:]:
        if not np.isclose(value, stated[0][1], rtol=1e-6, atol=1e-9, equal_nan=True):
            raise RefusedError(
                f"states {stated[0][0]} {stated[0][1]:g} and {place} {value:g}. Keep one."
            )
    return stated[0][1] if stated else None


def _refuse_part_of_picture(facts: Facts, width: float, height: float) -> None:
    """Raise RefusedError where the pictures are binned, or a part of what the matrix is for."""
    for entry in facts.get("binning"):
        value = entry.value
        binned = list(value.values()) if isinstance(value, dict) else value
        binned = binned if isinstance(binned, list) else [binned]
        if any(number_at(Entry(entry.place, number)) not in (0.0, 1.0) for number in binned):
            raise RefusedError(
                f"it is {short(entry.value)}: pictures are smaller than the size of the matrix. "
                "Calibrate with pictures as the camera gives them, or switch binning off.",
                entry.place,
            )
    for entry in facts.get("roi"):
        part = entry.value if isinstance(entry.value, dict) else {"roi": entry.value}
        numbers = {key: number for key, number in part.items() if key != "do_rectify"}
        full = {"x_offset": 0.0, "y_offset": 0.0, "width": width, "height": height}
        for key, number in numbers.items():
            if not is_zero(number) and number_at(Entry(f"{entry.place}.{key}", number)) != full.get(
                key
            ):
                raise RefusedError(
                    f"{key} is {short(number)}: pictures are a part of {width:g} x {height:g}. "
                    "Calibrate with pictures as the camera gives them, or with its whole picture.",
                    entry.place,
                )


def _matrix(facts: Facts) -> tuple[Array, str]:
    """The matrix (3, 3) and its place."""
    matrices = [(entry.place, _square(entry)) for entry in facts.get("matrix")]
    for entry in facts.get("intrinsics"):
        values = array_at(entry)
        if values.ndim == 1 and values.size not in (4, 9):
            raise RefusedError(
                f"it has {values.size} numbers; fx, fy, cx and cy are needed. Save the file again.",
                entry.place,
            )
        matrices.append(
            (entry.place, _of_four(*values) if values.shape == (4,) else _square(entry))
        )
    for place, other in matrices[1:]:
        if not np.allclose(other, matrices[0][1], rtol=1e-6, atol=1e-6, equal_nan=True):
            raise RefusedError(f"states {matrices[0][0]} and {place}, which differ. Keep one.")
    named = {name: _named(facts, name, matrices) for name in ("fx", "fy", "cx", "cy")}
    if matrices:
        return matrices[0][1], matrices[0][0]
    missing = [name for name, value in named.items() if value is None]
    if missing:
        raise RefusedError(f"has no {' and no '.join(missing)}. Add what is missing.")
    fx, fy, cx, cy = (value or 0.0 for value in named.values())
    return _of_four(fx, fy, cx, cy), facts.get("fx", "f", "focal")[0].place


def _named(facts: Facts, name: str, matrices: list[tuple[str, Array]]) -> float | None:
    """fx, fy, cx or cy by its name, of a list of two, or of a matrix; all must agree."""
    at = {"fx": (0, 0), "fy": (1, 1), "cx": (0, 2), "cy": (1, 2)}[name]
    stated = [(place, float(K[at])) for place, K in matrices]
    stated += [(entry.place, number_at(entry)) for entry in facts.get(name)]
    focal = name in ("fx", "fy")
    stated += [(entry.place, number_at(entry)) for entry in facts.get("f") if focal]
    for entry in facts.get("focal" if focal else "centre"):
        structured = isinstance(entry.value, (list, dict))
        values = [number_at(entry)] * 2 if focal and not structured else list(vector_at(entry))
        if len(values) != 2:
            raise RefusedError("it is not two numbers.", entry.place)
        stated.append((entry.place, float(values[int(name in ("fy", "cy"))])))
    return _agreed(stated)


def _square(entry: Entry) -> Array:
    values = array_at(entry)
    if values.size != 9 or values.shape not in ((9,), (3, 3), (1, 9), (9, 1)):
        shape = " x ".join(map(str, values.shape))
        raise RefusedError(f"it is {shape} numbers where a 3 x 3 matrix is needed.", entry.place)
    return values.reshape(3, 3)


def _of_four(fx: float, fy: float, cx: float, cy: float) -> Array:
    return np.array([[fx, 0.0, cx], [0.0, fy, cy], [0.0, 0.0, 1.0]])


def _distortion(facts: Facts, model: str) -> Array:
    """Coefficients in OpenCV's order, as many as the file has; five where k6 to k4 are zero."""
    stated = [(entry.place, vector_at(entry)) for entry in facts.get("distortion")]
    if facts.get(*_COEFFICIENTS):
        stated.append(_by_name(facts))
    for place, values in stated:
        check_coefficients(values, place)
        if len(values) not in _LENGTHS:
            raise RefusedError(
                f"it has {len(values)} coefficients; 4 (k1, k2, p1, p2), 5 (k3) or 8 (k4, k5, k6) "
                "are supported. Write zeros for those that were not fitted.",
                place,
            )
        if any(values[8:]):
            raise RefusedError(
                f"it has {len(values)} coefficients, those of thin prisms or a tilted sensor not "
                f"zero; {ONLY_PINHOLE}",
                place,
            )
        others = stated[0][1]
        size = max(len(values), len(others))
        if not np.allclose(_padded(values, size), _padded(others, size), rtol=1e-6, atol=0.0):
            raise RefusedError(f"states {stated[0][0]} and {place}, which differ. Keep one.")
    if not stated and model in ("plumb_bob", "rational_polynomial"):
        raise RefusedError(f"names the model {model} and has no distortion coefficients. Add them.")
    place, values = stated[0] if stated else ("", np.zeros(0))
    values = values[:8] if any(values[5:8]) else values[:5]
    if model == "none" and values.any():
        raise RefusedError("the model is without distortion, and coefficients are not zero.", place)
    if model == "plumb_bob" and len(values) > 5:
        raise RefusedError(
            "the model has 5 coefficients, and k4 to k6 are not zero. Correct it.", place
        )
    return values


def _by_name(facts: Facts) -> tuple[str, Array]:
    """k1, k2, p1, p2, k3 to k6 by name, as far as they go; those between are zero."""
    stated = {
        name: _agreed([(entry.place, number_at(entry)) for entry in facts.get(name)])
        for name in _COEFFICIENTS
    }
    place = facts.get(*_COEFFICIENTS)[0].place
    if stated["k4"] and stated["p1"] is None and stated["p2"] is None:
        raise RefusedError(
            f"has k1 to k4 without p1 and p2, as a fisheye model has; {ONLY_PINHOLE}"
        )
    count = 8 if any(stated[name] is not None for name in _COEFFICIENTS[5:]) else 5
    count = 4 if count == 5 and stated["k3"] is None else count
    return place, np.array([stated[name] or 0.0 for name in _COEFFICIENTS[:count]])


def _padded(values: Array, size: int) -> Array:
    return np.concatenate([values, np.zeros(size - len(values))])


def _said_of_open_model(coefficients: Array, facts: Facts) -> str:
    count = len(coefficients)
    names = ", ".join(_COEFFICIENTS[:count])
    if not count:
        return (
            "The file states no distortion, so the camera was taken as a pinhole without any: add "
            "distortion_coefficients unless its pictures are undistorted."
        )
    sentence = f"The file names no distortion model; its coefficients were taken as {names} "
    sentence += "(rational_polynomial)." if count > 5 else "(plumb_bob)."
    if count == 4 and not facts.get("p1", "p2"):
        sentence += " A fisheye calibration has four, too: check that it is none."
    return sentence
