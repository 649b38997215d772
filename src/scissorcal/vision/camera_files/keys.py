"""What each key of a camera file means: of the camera, without effect on it, or unknown.

The pinhole camera with radial and tangential distortion is plumb_bob and rational_polynomial in ROS
(REP 104), radtan in Kalibr, PINHOLE in VINS and ORB-SLAM, Brown-Conrady in RealSense. OpenCV's file
storage is read by Python alone: ``cv2.FileStorage`` 5.0 writes past its memory on a matrix with
``rows`` and without ``cols``.
"""

import base64
import math
import re
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from scissorcal.foreign.reading import TYPE_KEY
from scissorcal.vision.camera_files import vocabulary as words

Distortion = Literal["none", "plumb_bob", "rational_polynomial"]

ONLY_PINHOLE = (
    "scissorcal supports only the pinhole model with radial and tangential distortion (plumb_bob, "
    "radtan). Calibrate the camera with that model, or with 'scissorcal capture camera'."
)

_OTHERS = {
    "a fisheye model": r"fish ?eye|equidist|equi\b|kannala|brandt|\bkb ?[348]?\b|theta ?poly|"
    r"\bf ?theta\b|equisolid|stereographic|orthographic",
    "an omnidirectional model": r"omni|\bmei\b|catadiop|cata ?dioptric|mirror|\bunified\b|\bucm\b|"
    r"eucm|double ?sphere|\bds\b|scaramuzza|\bo ?cam|spherical|equirect|panoram|cylind",
    "a field-of-view model": r"\bfov\b|\batan\b|arctan|field ?of ?view|\btango\b",
    "a division model": r"division",
    "a thin-prism or tilted model": r"prism|tilt|scheimpflug",
    "an inverse or modified Brown-Conrady model": r"inverse|modified",
}
_OTHER = {name: re.compile(pattern) for name, pattern in _OTHERS.items()}
_WORDS = re.compile(
    r"(rational ?polynomial|plumb ?bob|rad ?tan|radial ?(and )?tangential|brown|conrady|pin ?hole|"
    r"perspective|full|open ?cv|none|no ?distortion|rectified|undistorted|standard|distortion|"
    r"model|camera|lens|null|[458]|[- ]){1,12}"
)


MOST_NAMED = 8
"""Names in one sentence; a file of a megabyte may have thousands."""


class RefusedError(ValueError):
    """What stands after the file's path in the sentence that refuses it.

    ``place`` is the key of the value that it is about.
    """

    def __init__(self, sentence: str, place: str = "") -> None:
        super().__init__(sentence)
        self.sentence = sentence
        self.place = place


MOST_NUMBERS = 100_000
"""Numbers of one matrix; a camera's have nine and fourteen."""

_LONGEST_NUMBER = 40
_DECIMAL = re.compile(r"[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d{1,4})?")
_NOT_FINITE = {".nan": math.nan, ".inf": math.inf, "+.inf": math.inf, "-.inf": -math.inf}
_TYPE = re.compile(r"(\d{0,2})([ucwsifdhbHIL])")
_BYTES = {"u": "<u1", "c": "<i1", "w": "<u2", "s": "<i2", "i": "<i4", "f": "<f4", "d": "<f8"}
_BINARY_HEAD = 24
"""Bytes of text before the numbers of a matrix in base64, which repeat its type."""


class Entry(NamedTuple):
    """One value of a file with its place: the keys that lead to it."""

    place: str
    value: Any


@dataclass
class Facts:
    """Entries of one camera by their meaning, and the keys that are not known."""

    of: dict[str, list[Entry]] = field(default_factory=dict)
    unknown: list[str] = field(default_factory=list)
    second: list[str] = field(default_factory=list)
    blocks: list[tuple[str, dict[str, Any]]] = field(default_factory=list)

    def get(self, *roles: str) -> list[Entry]:
        """All entries with these meanings."""
        return [entry for role in roles for entry in self.of.get(role, [])]


def facts_of(tree: dict[str, Any]) -> Facts:
    """Sort the entries of a document by what they mean for the camera.

    A mapping that holds a camera, such as Kalibr's ``cam0``, is looked into. Raises RefusedError
    where the document holds two cameras.
    """
    facts = Facts()
    _sort(tree, "", facts)
    while facts.blocks:
        names = [name for name, _ in facts.blocks]
        outer = [entry.place for entry in facts.get(*words.OWN)][:1]
        if len(names + outer) > 1:
            raise RefusedError(
                f"has {len(names + outer)} cameras ({shown(outer + names)}): keep only the rig's."
            )
        name, block = facts.blocks.pop()
        _sort(block, f"{name}.", facts)
    if facts.second:
        raise RefusedError(
            f"has a second camera ({shown(facts.second)}): keep only the rig's, as it is before "
            "rectification."
        )
    return facts


def plain(key: str) -> str:
    """A key in lower case without separators.

    >>> plain("Camera-Matrix"), plain("fisheye_model")
    ('cameramatrix', 'fisheyemodel')
    """
    return re.sub(r"[^a-z0-9]", "", key.lower())


def is_zero(value: Any) -> bool:
    """Whether a value is 0, or a list of zeros."""
    return all(map(is_zero, value)) if isinstance(value, list) else number_of(value) == 0.0


def _sort(tree: dict[str, Any], before: str, facts: Facts) -> None:
    for key, value in tree.items():
        place = before + key
        role = _role(key, value)
        if role == "unknown":
            facts.unknown.append(place)
        elif role == "second":
            facts.second.append(place)
        elif role == "block":
            facts.blocks.append((place, _camera_in(value)))
        elif role in words.GROUPS and _is_group(value):
            _sort(value, f"{place}.", facts)
        elif role != "ignored":
            facts.of.setdefault(role, []).append(Entry(place, value))


def _role(key: str, value: Any) -> str:
    head, dot, rest = key.partition(".")
    if dot and plain(head) in words.HEADS:
        role = words.HEADS[plain(head)]
        return _role(rest, value) if role == "camera" else role
    role = _role_of_name(key, plain(key), value)
    if role == "distortion" and _is_text(value) and value.lstrip()[:1].isalpha():
        return "model"
    if role == "group" and not _is_group(value) and not _camera_in(value):
        return "unknown" if isinstance(value, list) else "ignored"
    if role in words.GROUPS and isinstance(value, list) and any(isinstance(v, dict) for v in value):
        return "block" if _camera_in(value) else "unknown"
    looked_into = role in ("unknown", "model") or (role != "second" and not _is_group(value))
    return "block" if looked_into and _camera_in(value) else role


def _role_of_name(key: str, name: str, value: Any) -> str:
    structured = isinstance(value, (list, dict)) or _is_text(value)
    special = words.STRUCTURED if structured else words.SCALAR
    if name in special:
        return special[name]
    if name in words.ROLES:
        return words.ROLES[name]
    if name in words.IGNORED:
        return "ignored"
    if words.MODEL_KEY.fullmatch(name):
        return "model"
    if refused_model(key):
        return "ignored" if is_off(value) else "switch"
    return "ignored" if words.IGNORED_KINDS.fullmatch(name) else "unknown"


def is_off(value: Any) -> bool:
    """Whether a switch is off: false, no, none, nothing or zero."""
    off = ("false", "no", "off", "none", "null", "~", "")
    return is_zero(value) or (isinstance(value, str) and value.strip().lower() in off)


def _is_text(value: Any) -> bool:
    return isinstance(value, str) and bool(value) and number_of(value) is None


def _is_group(value: Any) -> bool:
    return isinstance(value, dict) and "data" not in value and TYPE_KEY not in value


def _camera_in(value: Any) -> dict[str, Any]:
    """The mapping with a camera that a value is, or has as its only part; else an empty one."""
    if isinstance(value, list):
        cameras = [item for item in value if isinstance(item, dict) and _holds_camera(item)]
        if len(cameras) > 1:
            raise RefusedError(f"has {len(cameras)} cameras in one list: keep only the rig's.")
        return cameras[0] if cameras and len(value) == 1 else {}
    return value if _is_group(value) and _holds_camera(value) else {}


def _holds_camera(tree: dict[str, Any]) -> bool:
    """Whether a mapping has a camera's matrix or focal length, itself or one level below."""
    inner = [key for value in tree.values() if isinstance(value, dict) for key in value]
    return any(plain(key.partition(".")[2] or key) in words.OF_A_CAMERA for key in [*tree, *inner])


def number_of(value: Any) -> float | None:
    """A decimal number, ``.Inf`` or ``.Nan``; None for anything else.

    >>> number_of("640."), number_of("-.Inf"), number_of("camera"), number_of("9" * 6000)
    (640.0, -inf, None, None)
    """
    word = value.strip() if isinstance(value, str) else ""
    if len(word) <= _LONGEST_NUMBER and _DECIMAL.fullmatch(word):
        return float(word)
    return _NOT_FINITE.get(word.lower())


def matrix_of(value: Any) -> NDArray[np.float64] | None:
    """A matrix (rows, cols), or (rows, cols, channels); None for what is no matrix.

    Raises ValueError where rows, columns, type and data of a matrix do not belong together.
    """
    if not isinstance(value, dict) or value.get(TYPE_KEY) != "opencv-matrix":
        return None
    rows, columns = (_count(value.get(name), name) for name in ("rows", "cols"))
    stated = _TYPE.fullmatch(str(value.get("dt", "")).strip().strip('"'))
    if stated is None:
        raise ValueError(f"a matrix of the type {str(value.get('dt'))[:20]!r}")
    channels = int(stated[1] or 1)
    wanted = rows * columns * channels
    if not 0 <= wanted <= MOST_NUMBERS:
        raise ValueError(f"a matrix of {rows} x {columns}")
    numbers = _numbers(value.get("data", ""), stated[2])
    if len(numbers) != wanted:
        raise ValueError(f"a matrix of {rows} x {columns} with {len(numbers)} numbers")
    shape = (rows, columns) if channels == 1 else (rows, columns, channels)
    return numbers.reshape(shape)


def _count(word: Any, name: str) -> int:
    if not isinstance(word, str) or not re.fullmatch(r"\s*[0-9]{1,6}\s*", word):
        raise ValueError(f"a matrix without {name}")
    return int(word)


def _numbers(data: Any, kind: str) -> NDArray[np.float64]:
    """The numbers of a matrix: a list, words, or the bytes of base64."""
    if isinstance(data, str):
        words = data.split()
        if not words or number_of(words[0]) is not None:
            data = words
        else:
            return _from_base64("".join(words), kind)
    values = [number_of(word) for word in data] if isinstance(data, list) else [None]
    if None in values:
        raise ValueError("a matrix with an entry that is no number")
    return np.array(values, dtype=np.float64)


def _from_base64(word: str, kind: str) -> NDArray[np.float64]:
    try:
        content = base64.b64decode(word.removeprefix("$base64$"), validate=True)
        dtype = np.dtype(_BYTES[kind])
        return np.frombuffer(content[_BINARY_HEAD:], dtype).astype(np.float64)
    except (ValueError, KeyError):
        raise ValueError("a matrix with an entry that is no number") from None


def shown(names: Sequence[str]) -> str:
    """Some names, separated by commas, each cut where it is long.

    >>> shown(["a"] * 10)
    'a, a, a, a, a, a, a, a and 2 more'
    """
    some = ", ".join(short(name) for name in names[:MOST_NAMED])
    more = len(names) - MOST_NAMED
    return f"{some} and {more} more" if more > 0 else some


def short(word: object) -> str:
    """A word of a file as it may stand in a sentence: one line of at most 40 characters."""
    return " ".join(str(word).split())[:40]


def refused_model(word: str) -> str | None:
    """The kind of model that a name means, with its article, where scissorcal has it not.

    >>> refused_model("KANNALA_BRANDT8"), refused_model("plumb_bob")
    ('a fisheye model', None)
    """
    spaced = _spaced(word)
    return next((name for name, pattern in _OTHER.items() if pattern.search(spaced)), None)


def distortion_of(word: str) -> Distortion | Literal["open"] | None:
    """The distortion that a name of a model states, "open" if it states none; None if unknown.

    >>> distortion_of("radial-tangential"), distortion_of("PinHole"), distortion_of("C920")
    ('plumb_bob', 'open', None)
    """
    spaced = _spaced(word)
    if not word.strip():
        return "open"
    if not _WORDS.fullmatch(spaced):
        return None
    if re.search(r"rational|full|8", spaced):
        return "rational_polynomial"
    if re.search(r"plumb|rad ?tan|radial|brown|conrady", spaced):
        return "plumb_bob"
    if re.search(r"none|no ?distortion|rectified|undistorted", spaced):
        return "none"
    return "open"


def _spaced(word: str) -> str:
    """A name in lower case, its words separated by one space.

    >>> _spaced("distortion.inverse_BrownConrady")
    'distortion inverse brown conrady'
    """
    parted = re.sub(r"(?<=[a-z])(?=[A-Z])", " ", word[:80])
    return " ".join(re.sub(r"[^a-z0-9]+", " ", parted.lower()).split())
