"""Ripple over the position that the law leaves in its residuals."""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from scissorcal.aliases import Array
from scissorcal.calibration.friction.noise import (
    BACKGROUND,
    FALSE_ALARM,
    FEWEST_PERIODS,
    MARGIN,
    MEDIAN_OF_EXPONENTIAL,
)

MOST_ORDERS = 400
"""Periods within the travel up to which ripple is looked for."""
LEAST_ORDERS = 8


@dataclass(frozen=True)
class Ripple:
    """The strongest sine of one range of periods: ``amplitude`` with its 90 % interval.

    ``speed`` is "slow" for fewer than 6 periods within the travel, else "fast". ``signed`` says
    that it changes sign with the direction, as friction does; else it is a torque that repeats,
    such as cogging. ``period`` is in the position's unit. ``shown`` says that noise alone has it
    in one log of 10,000 at most; where it is not, ``high`` bounds what may be there.
    """

    speed: Literal["slow", "fast"]
    signed: bool
    period: float
    amplitude: float
    low: float
    high: float
    shown: bool


def ripples_of(position: Array, direction: Array, left: Array) -> tuple[Ripple, ...]:
    """Slow and fast ripple of residuals ``left`` (n,), with and without the sign of the motion.

    The periodogram over the position, at whole numbers of periods within the travel; noise is the
    median power of the orders about each, as in the search for cogging of a fit.
    """
    travel = float(np.ptp(position))
    steps = np.abs(np.diff(position))
    step = float(np.median(steps)) if len(steps) else 0.0
    if travel <= 0.0 or step <= 0.0:
        return ()
    orders = np.arange(1.0, min(MOST_ORDERS, travel / (4.0 * step)) + 1.0)
    if len(orders) < LEAST_ORDERS:
        return ()
    turned = np.exp(-2j * np.pi * np.outer(orders, (position - position.min()) / travel))
    found = []
    for signed in (False, True):
        sizes = np.abs(2.0 * turned @ (left * direction if signed else left)) / len(left)
        noise = np.array(
            [
                np.median(sizes[max(0, at - BACKGROUND) : at + BACKGROUND + 1] ** 2)
                for at in range(len(orders))
            ]
        )
        noise /= MEDIAN_OF_EXPONENTIAL
        least = MARGIN * float(np.log(len(orders) / FALSE_ALARM))
        for speed, here in (("slow", orders < FEWEST_PERIODS), ("fast", orders >= FEWEST_PERIODS)):
            best = int(np.flatnonzero(here)[np.argmax(sizes[here] ** 2 / noise[here])])
            size, spread = float(sizes[best]), 1.645 * float(np.sqrt(0.5 * noise[best]))
            found.append(
                Ripple(
                    "slow" if speed == "slow" else "fast",
                    signed,
                    float(travel / orders[best]),
                    size,
                    max(size - spread, 0.0),
                    size + spread,
                    bool(size**2 > least * noise[best]),
                )
            )
    return tuple(found)
