"""Sentences for a person at the rig on why an estimated plate is not rendered, and what helps."""

import math

import numpy as np

from scissorcal.aliases import Array

ACROSS = (
    "The plate stands across the blades (more than 45 degrees from where it can be cut). Turn it "
    "so that its cut runs along the advance, its printed face up."
)
NONE_YET = (
    "No estimate of the plate's pose has come: check that the tracker runs and sees the plate's "
    "target."
)
_NAMES = ("place along the cut", "height", "pitch", "direction", "roll")


def lost(why: str) -> str:
    """The source has lost the plate."""
    cause = f": {why.rstrip('.')}" if why else ""
    return (
        f"The plate's pose was lost{cause}. Keep the plate's target in the camera's view; the "
        "force returns with the pose."
    )


def late(age_s: float) -> str:
    """The source gives nothing new."""
    return (
        f"No new estimate of the plate's pose came for {age_s:.2f} s. Check that the tracker runs, "
        "and close programs that load the processor."
    )


def leapt(by_m: float) -> str:
    """The pose went farther between two estimates than a plate moves."""
    return (
        f"The plate's pose leapt by {by_m * 1e3:.1f} mm between two estimates, farther than a "
        "plate moves. The force returns where the pose is now. If that repeats, check the tracker "
        "for mirrored or mistaken poses."
    )


def beside(height_m: float, pitch_rad: float, most_height_m: float, most_pitch_rad: float) -> str:
    """Two moving blades cannot be taken to hold the plate in their middle."""
    return (
        f"The plate's middle lies {height_m * 1e3:.1f} mm beside the blades' and is pitched by "
        f"{math.degrees(pitch_rad):.1f} deg; two moving blades are taken to hold it in their "
        f"middle, up to {most_height_m * 1e3:.0f} mm and {math.degrees(most_pitch_rad):.0f} deg. "
        "Bring it back between them."
    )


def uncertain(
    covariance: Array, half_width: float, worst: int, confidence: float, tolerance: float
) -> str:
    """The pose leaves the torque less certain than the scene allows."""
    sd = np.sqrt(np.maximum(np.diag(covariance), 0.0))
    return (
        f"The plate's pose was known to {sd[0] * 1e3:.2g} mm along the cut, {sd[1] * 1e3:.2g} mm "
        f"in height and {math.degrees(sd[2]):.2g} deg in pitch (sd), which leaves the torque "
        f"uncertain by {half_width:.1%} ({confidence:.0%}); the scene allows "
        f"{tolerance:.1%}. Most of it comes from its {_NAMES[worst]}. Bring the camera closer, "
        "touch the plate with the blades so that contact narrows the pose, or raise "
        "scene.tolerance_percent."
    )
