"""Sizes that no pair of scissors has: numbers that were read in another unit than they are in."""

import math
from typing import NamedTuple

import numpy as np

from scissorcal.aliases import Array
from scissorcal.recipe.everyday import EVERYDAY
from scissorcal.recipe.unlikely import MARGIN
from scissorcal.recording.recording import Joint

MOST_BEYOND = 0.1
"""Share of the samples that may be marks or spikes: a size is what the others have."""


class _Slip(NamedTuple):
    """A channel's everyday range, the unit that people read, and the smaller one it may be in."""

    quantity: str
    unit: str
    per_si: float
    smaller: str
    factor: float


_SLIPS = {
    "opening": _Slip("opening", "deg", math.degrees(1.0), "deg", math.degrees(1.0)),
    "motor_torque": _Slip("torque_limit", "N m", 1.0, "mN m", 1e3),
    "handle_force": _Slip("force_limit", "N", 1.0, "mN", 1e3),
}


def size_note(channel: str, values: Array, joint: Joint) -> str:
    """A sentence where a channel (m,), in SI, is as large as in a smaller unit; else empty.

    Too large is what lies within a factor of 1.5 of the least everyday value written in that unit,
    or beyond, as in a recipe (:mod:`scissorcal.recipe.unlikely`). Of an opening the range counts,
    of others the magnitude. Of a linear joint only the force on the handle is judged.

    >>> size_note("handle_force", np.array([1200.0, 2900.0, 2400.0]), Joint())[:44]
    'handle_force reaches 2900 N, where scissors '
    """
    slip = _SLIPS.get(channel)
    if slip is None or (joint.kind == "linear" and channel != "handle_force"):
        return ""
    everyday = EVERYDAY[slip.quantity]
    tail = 0.5 * MOST_BEYOND
    low, high = np.quantile(values, (tail, 1.0 - tail), method="nearest")
    size = float(high - low if channel == "opening" else max(abs(low), abs(high)))
    if not size >= everyday.low * slip.factor / MARGIN:
        return ""
    verb = "covers" if channel == "opening" else "reaches"
    least, most = (f"{slip.per_si * value:.3g}" for value in everyday.ends)
    return (
        f"{channel} {verb} {slip.per_si * size:.4g} {slip.unit}, where scissors have {least} to "
        f"{most} {slip.unit} ({everyday.why}). If its numbers are in {slip.smaller}, import it "
        f"with -u {channel}={slip.smaller.replace(' ', '')}."
    )
