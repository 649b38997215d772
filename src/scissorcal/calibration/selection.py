"""Which rungs cannot be told apart, in words, and what to measure to tell them."""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from scissorcal.calibration.candidates import (
    POSITIVE_EVIDENCE,
    RELIABLE_STROKES,
    Climbed,
    best_of,
)
from scissorcal.calibration.psis_loo import RELIABLE
from scissorcal.calibration.signals.filtering import Bins
from scissorcal.recording.recording import Joint

Array = NDArray[np.float64]

PLACES = 5
"""Stretches of speed, and of contact or opening, among which the place of most difference lies."""
FEWEST_BINS = 10


def selection_sentence(
    climbed: list[Climbed], chosen: Climbed, bins: Bins, contact: Array, joint: Joint
) -> str:
    """Say which rungs cannot be told apart, which is used, and what would separate them.

    ``contact`` (n,) is where the material is met, NaN for empty motion. The place named is where,
    within the recorded motion, the predictions of the rung used and of any it cannot be told from
    lie furthest apart, and the time (the number of segments, where those are of the path and not of
    time) is what it would take there for 3 nats.
    """
    if len(climbed) == 1:
        return f"{chosen.rung.name} was named in the recipe and compared with no other."
    doubt = _unreliable(climbed)
    others = [
        candidate
        for candidate in climbed
        if candidate.rung.name in chosen.alike and candidate.rung.name != chosen.rung.name
    ]
    if not others:
        return (
            f"Every other rung predicts unseen strokes worse than {chosen.rung.name}, which is "
            f"used.{doubt}"
        )
    names = ", ".join(candidate.rung.name for candidate in others)
    text = (
        f"{chosen.rung.name} is used, the cheapest of those that unseen strokes cannot tell from "
        f"the best or that nobody would feel apart; the others are {names}."
    )
    found = max((_apart(chosen, other, bins, contact) for other in others), key=lambda p: p.nats)
    return f"{text} {_advice(found, chosen, bins, joint)}{doubt}"


@dataclass(frozen=True)
class _Place:
    """Where two rungs differ: stretches of speed and place, and nats that one bin there is worth.

    ``difference`` is the rms of their difference there, in the unit of the effort.
    """

    other: str
    speed: tuple[float, float]
    place: tuple[float, float]
    by_contact: bool
    difference: float
    nats: float


def _apart(chosen: Climbed, other: Climbed, bins: Bins, contact: Array) -> _Place:
    residuals = [c.rung.likelihood.residuals(c.optimum.point) for c in (chosen, other)]
    difference = residuals[0] - residuals[1]
    variance = float(np.mean(residuals[0] ** 2))
    speed = np.abs(bins.rate)
    by_contact = bool(np.any(np.isfinite(contact)))
    place = contact if by_contact else bins.opening
    known = np.isfinite(place)
    speeds, places = (_stretches(values[known]) for values in (speed, place))
    best = _Place(other.rung.name, (0.0, 0.0), (0.0, 0.0), by_contact, 0.0, 0.0)
    for low, high in pairwise(speeds):
        for near, far in pairwise(places):
            here = known & (speed >= low) & (speed <= high) & (place >= near) & (place <= far)
            if np.count_nonzero(here) < FEWEST_BINS:
                continue
            squared = float(np.mean(difference[here] ** 2))
            nats = 0.5 * chosen.share * squared / variance
            if nats > best.nats:
                span, reach = (float(low), float(high)), (float(near), float(far))
                best = _Place(best.other, span, reach, by_contact, float(np.sqrt(squared)), nats)
    return best


def _stretches(values: Array) -> Array:
    return np.unique(np.quantile(values, np.linspace(0.0, 1.0, PLACES + 1)))


def _advice(place: _Place, chosen: Climbed, bins: Bins, joint: Joint) -> str:
    if place.nats <= 0.0:
        return "Over the recorded motion they predict the same."
    unit = "m" if place.by_contact else joint.position_unit
    where = "contact" if place.by_contact else "opening"
    count = POSITIVE_EVIDENCE / place.nats
    more = f"{count * bins.bin_s:.2g} s more of motion"
    if not np.isfinite(bins.bin_s):
        more = f"{max(1, round(count))} more segments of the path"
    return (
        f"{chosen.rung.name} and {place.other} differ most at {place.speed[0]:.2g} to "
        f"{place.speed[1]:.2g} {joint.position_unit}/s and {where} {place.place[0]:.2g} to "
        f"{place.place[1]:.2g} {unit}, by {place.difference:.2g} {joint.effort_unit} (rms): about "
        f"{more} there would tell them apart if one of them is true."
    )


def _unreliable(climbed: list[Climbed]) -> str:
    """Where PSIS-LOO had no say."""
    best = best_of(climbed)
    good = float(np.mean(best.left_out.reliable))
    if good >= RELIABLE_STROKES:
        return ""
    return (
        f" PSIS-LOO had no say: for {1 - good:.0%} of the strokes its k-hat is {RELIABLE:.2f} or "
        "more, as single strokes decide a parameter; record more strokes of each kind."
    )
