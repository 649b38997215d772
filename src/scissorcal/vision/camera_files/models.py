"""Names that tools give to camera models, and which of them scissorcal has.

The pinhole camera with radial and tangential distortion is plumb_bob and rational_polynomial in
ROS (REP 104), radtan in Kalibr, PINHOLE in VINS and ORB-SLAM, Brown-Conrady in RealSense.
"""

import re
from typing import Literal

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
