"""Gains of the capture's controller, from what it moves, delay and how friction falls. Pure."""

import math
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import NamedTuple

from scissorcal.device.control import (
    GAIN_MARGIN,
    Axis,
    Gains,
    Margins,
    PHASE_MARGIN_deg,
    count_effort,
    greatest_fall,
    keeps_margins,
    loop_margins,
    open_loop,
    sag,
    spread_of_error,
)
from scissorcal.errors import DeviceError

FASTEST_CROSSOVER_rad_per_s = 3.0 * 2.0 * math.pi * 15.0
"""Three times the excitation's highest tone: a faster loop would follow no planned motion better,
and would meet resonances of blades and drive that nobody has measured."""
SLOWEST_CROSSOVER_rad_per_s = 5.0
STEPS = 40
LEADS = (2.0, 2.5, 3.0, 4.0)
"""Crossover over the corner at which the rate takes over from the error: 63 to 76 degrees of lead,
of which delay, filter and integral take their part."""
SLOW_LEADS = (6.0, 8.0, 12.0)
"""Further leads where sliding must be steady: damping for stiffness. The last leaves 4 degrees of
phase to the error, so that larger ones add little."""
KEPT_FALL = 0.9
"""Share of the greatest fall of friction that a design keeps where no more is known of friction.
The last tenth costs half of the stiffness, and weak gains let blades rest longer at each turn."""
MOST_LAG = math.radians(90.0 - PHASE_MARGIN_deg)
"""Lag by delay and hold at the crossover that leaves the margin, if the lead were complete."""
INTEGRALS = (1.25, 2.0, 4.0)
"""That corner over the integral's."""
LEAST_DELAY_S = 1e-4


class Demand(NamedTuple):
    """What a capture asks of an axis: it must not fall behind by ``error_limit``.

    ``rate`` and ``acceleration`` are the plan's largest, ``load`` is the effort that material may
    take beside friction.
    """

    rate: float
    acceleration: float
    load: float
    error_limit: float


class Design(NamedTuple):
    """Gains for an axis, with its rate filter, and the margins that they leave."""

    axis: Axis
    gains: Gains
    margins: Margins


def design_gains(
    axis: Axis,
    demand: Demand,
    cutoffs_Hz: tuple[float, ...],
    name: str = "opening",
    fall: float = 0.0,
) -> Design:
    """The gains, and one of ``cutoffs_Hz`` for the rate, that follow best with the stated margins.

    Sought is the smallest squared error after a step of friction or load, with a crossover of at
    most FASTEST_CROSSOVER_rad_per_s. A count of the encoder changes the effort by no more than
    ``most_per_count``: beyond dry friction the blades would buzz at rest (Diolaiti et al. 2006,
    doi:10.1109/TRO.2005.862487). Sliding is steady while friction falls by up to ``fall`` per rate
    (`greatest_fall`), or by KEPT_FALL of what the margins allow where that is less.
    Raises DeviceError, with the delay that would do, where the best gains are too weak.

    >>> axis = Axis(2.1e-4, 0.002, 0.015, delay_s=1e-3, tick_s=1e-3, step=4.8e-5,
    ...             rate_cutoff_Hz=0.0, most_per_count=0.015, inertia_factor=1.2)
    >>> design = design_gains(axis, Demand(1.5, 20.0, 0.1, 0.3), (400.0, 1000.0))
    >>> round(design.gains.kp, 1), round(design.margins.phase_deg), design.axis.rate_cutoff_Hz
    (3.0, 45, 1000.0)
    """
    found = _best(axis, cutoffs_Hz)
    if found is not None and _strong_enough(found, demand):
        return _steady(axis, demand, cutoffs_Hz, fall) if fall > 0.0 else found
    raise DeviceError(_refusal(axis, demand, cutoffs_Hz, name, found))


def _largest_deviation(axis: Axis, gains: Gains, demand: Demand) -> float:
    """How far the axis may fall behind: at a reversal, accelerating, as the load sets in.

    All of it at once, as a step: simulated captures fall behind by about half of it.
    """
    effort = (
        2.0 * axis.coulomb
        + axis.viscous * demand.rate
        + axis.inertia * demand.acceleration
        + demand.load
    )
    return effort * sag(axis, gains)


def _strong_enough(found: Design, demand: Demand) -> bool:
    return _largest_deviation(found.axis, found.gains, demand) <= demand.error_limit


def _best(axis: Axis, cutoffs_Hz: tuple[float, ...]) -> Design | None:
    """The design of least error that keeps the margins; None where there is none."""
    return min(_designs(axis, cutoffs_Hz, LEADS), key=_error, default=None)


def _steady(axis: Axis, demand: Demand, cutoffs_Hz: tuple[float, ...], fall: float) -> Design:
    """The design of least error among those that are strong enough and stand the fall."""
    every = _designs(axis, cutoffs_Hz, LEADS + SLOW_LEADS)
    strong = [one for one in every if _strong_enough(one, demand)]
    stood = [greatest_fall(one.axis, one.gains) for one in strong]
    least = min(fall, KEPT_FALL * max(stood))
    return min((one for one, most in zip(strong, stood, strict=True) if most >= least), key=_error)


def _designs(axis: Axis, cutoffs_Hz: tuple[float, ...], leads: tuple[float, ...]) -> list[Design]:
    """The fastest design of each shape and filter."""
    found = (
        fastest_design(axis.filtered(cutoff), lead, integral)
        for cutoff in cutoffs_Hz
        for lead in leads
        for integral in INTEGRALS
    )
    return [one for one in found if one is not None]


def _error(design: Design) -> float:
    return spread_of_error(design.axis, design.gains)


@lru_cache(maxsize=1024)  # captures, plans and refusals of a day ask for the same axis
def fastest_design(axis: Axis, lead: float, integral: float) -> Design | None:
    """The design of highest crossover of one shape; None where none keeps the margins.

    ``lead`` is the crossover over the corner at which the rate takes over from the error,
    ``integral`` that corner over the integral's (infinite: no integral).
    """
    ratio = FASTEST_CROSSOVER_rad_per_s / SLOWEST_CROSSOVER_rad_per_s
    for step in range(STEPS):
        omega = FASTEST_CROSSOVER_rad_per_s * ratio ** (-step / (STEPS - 1))
        lag = omega * (axis.delay_s + 0.5 * axis.tick_s)
        if lag > MOST_LAG + math.atan(axis.inertia_factor * axis.viscous / (axis.inertia * omega)):
            continue
        gains = _shaped(axis, omega, lead, integral)
        if count_effort(axis, gains) > axis.most_per_count:
            continue
        if keeps_margins(axis, gains):
            return Design(axis, gains, loop_margins(axis, gains))
    return None


def _shaped(axis: Axis, omega: float, lead: float, integral: float) -> Gains:
    """Gains whose loop crosses one at ``omega``."""
    corner = omega / lead
    shape = Gains(corner, 1.0, corner * corner / integral)
    size = 1.0 / abs(complex(open_loop(axis, shape, omega)))
    return Gains(size * shape.kp, size, size * shape.ki)


def _refusal(
    axis: Axis, demand: Demand, cutoffs_Hz: tuple[float, ...], name: str, found: Design | None
) -> str:
    enough = _enough_delay(axis, demand, cutoffs_Hz)
    behind = "and no gains keep that margin"
    if found is not None:
        far = _largest_deviation(found.axis, found.gains, demand)
        unit = "m" if name == "advance" else "rad"
        behind = (
            f"and the {name} would fall behind by up to {far:.2g} {unit}, beyond the "
            f"{demand.error_limit:.2g} {unit} at which a capture stops"
        )
    sentence = (
        f"An effort acts {1e3 * axis.delay_s:.2g} ms after the measurement that it answers. That "
        f"is too late for this capture: gains with {PHASE_MARGIN_deg:.0f} degrees of phase margin "
        f"and a gain margin of {GAIN_MARGIN:g} are weak, {behind}."
    )
    if enough is not None:
        return (
            f"{sentence} A delay of at most {1e3 * enough:.2g} ms would do: shorten the adapter's "
            "latency timer, raise the baud rate, or plan slower strokes."
        )
    return (
        f"{sentence} A shorter delay alone would not do: take a finer encoder or a faster tick, or "
        "plan slower strokes."
    )


def _enough_delay(axis: Axis, demand: Demand, cutoffs_Hz: tuple[float, ...]) -> float | None:
    """The longest delay, below the axis's own, with which the capture can be followed."""
    low, high, enough = 0.0, axis.delay_s, None
    while high - low > LEAST_DELAY_S:
        middle = 0.5 * (low + high)
        found = _best(replace(axis, delay_s=middle), cutoffs_Hz)
        if found is not None and _strong_enough(found, demand):
            enough = low = middle
        else:
            high = middle
    return enough


STEEPEST = math.sqrt(2.0 / math.e)
"""Greatest fall, in S / ws."""
ANY_RATE = 2.0 / math.e
"""Greatest fall at a rate v over all ws, in S / v: that of ws = v."""
LARGEST_SHARE = 0.6
"""Largest share of Stribeck friction in what breaks blades away: of the metals in a textbook's
table lubricated ones lose most, from 0.15 at rest to 0.06 (Serway and Jewett, Physics for
Scientists and Engineers, table of coefficients of friction, ISBN 978-1-133-95405-7)."""


@dataclass(frozen=True)
class StribeckFall:
    """How friction falls with speed: ``level`` S (N m) and ``rate`` ws (rad/s).

    ``rate`` is None where nobody knows it: ``level`` is then an upper bound, and so are the falls.
    """

    level: float
    rate: float | None

    @classmethod
    def within(cls, breakaway: float) -> "StribeckFall":
        """What can be said where only the torque is known that breaks the blades away."""
        return cls(LARGEST_SHARE * breakaway, None)

    @property
    def steepest(self) -> float:
        """Greatest fall at any speed, N m s/rad; infinite where the rate is not known."""
        return math.inf if self.rate is None else STEEPEST * self.level / self.rate

    def steady_from(self, stood: float) -> float:
        """Slowest rate (rad/s) from which on friction falls by no more than ``stood``.

        0 where it never does. In y = (v / ws)^2 the edge is y exp(-2 y) = (stood ws / S)^2 / 4,
        whose larger root is that of Lambert's W on its lower branch. Without ``rate`` it is the
        largest over all rates.

        >>> known = StribeckFall(4.1e-3, 0.075)
        >>> round(known.steepest, 4), known.steady_from(0.05), round(known.steady_from(0.03), 3)
        (0.0469, 0.0, 0.092)
        >>> round(StribeckFall(4.1e-3, None).steady_from(0.03), 3)
        0.101
        """
        if self.level <= 0.0 or self.steepest <= stood:
            return 0.0
        if stood <= 0.0:
            return math.inf
        if self.rate is None:
            return ANY_RATE * self.level / stood
        from scipy.special import lambertw

        share = stood * self.rate / self.level
        return self.rate * math.sqrt(-0.5 * float(lambertw(-0.5 * share * share, -1).real))
