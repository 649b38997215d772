"""What each key of a camera file means: of the camera, without effect on it, or unknown."""

import re
from dataclasses import dataclass, field
from typing import Any

from scissorcal.foreign.text_tree import TYPE_KEY
from scissorcal.vision.camera_files import vocabulary as words
from scissorcal.vision.camera_files.models import refused_model
from scissorcal.vision.camera_files.refusal import RefusedError, shown
from scissorcal.vision.opencv_storage import number_of


@dataclass(frozen=True)
class Entry:
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
        own = [entry.place for entry in facts.get(*words.OWN)][:1]
        if len(names + own) > 1:
            raise RefusedError(
                f"has {len(names + own)} cameras ({shown(own + names)}): keep only the rig's."
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
        cameras = [one for one in value if isinstance(one, dict) and _holds_camera(one)]
        if len(cameras) > 1:
            raise RefusedError(f"has {len(cameras)} cameras in one list: keep only the rig's.")
        return cameras[0] if cameras and len(value) == 1 else {}
    return value if _is_group(value) and _holds_camera(value) else {}


def _holds_camera(tree: dict[str, Any]) -> bool:
    """Whether a mapping has a camera's matrix or focal length, itself or one level below."""
    inner = [key for value in tree.values() if isinstance(value, dict) for key in value]
    return any(plain(key.partition(".")[2] or key) in words.OF_A_CAMERA for key in [*tree, *inner])
