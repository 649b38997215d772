"""Terms of a whole course of motion: drift, waves over the range, slow memory, bumps of the speed.

The critic searches them; no law adopts them, since they are of the rig or of the day. Where a scale
is a share of the range or of the speeds, it is that of the course itself.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from scissorcal.model.friction_terms import TERMS
from scissorcal.model.terms import Motion, Role, Term

MOST_PERIODS, MOST_MISREAD = 3, 6
"""Periods over the range up to which waves of a torque and of a reading are searched: from six on a
fit finds cogging by itself. What a reading's error costs grows with their square."""
BUILT_UP = (0.125, 0.25, 0.5)
"""Shares of the range over which friction builds up: shorter ones are a law's presliding."""
CENTRES, BUMP = tuple(0.125 * place for place in range(1, 8)), 0.125
"""Places of bumps among the speeds, and their width (sd): one lies near every dip."""


@dataclass(frozen=True)
class Course(Motion):
    """A motion with what only the whole of it shows, all (n,).

    ``time`` in s, from the middle of its recording. ``phase`` of the opening, 2 pi over the range
    that was moved over, and ``turn`` its slope. ``way`` since the last reversal, as a share of that
    range. ``pace`` is the logarithm of the speed, 0 at the slowest and 1 at the fastest.
    """

    time: Any = None
    phase: Any = None
    turn: Any = None
    way: Any = None
    pace: Any = None


def _wave(quarters: int, periods: int) -> Callable[[Course], Any]:
    """A cosine of so many periods over the range, late by quarters of a period."""

    def wave(course: Course) -> Any:
        import numpy as np

        return np.cos(periods * course.phase - 0.5 * math.pi * quarters)

    return wave


def _misread(quarters: int, periods: int) -> Callable[[Course], Any]:
    """Second derivative in time of a wave in the reading of the opening."""
    wave, later = _wave(quarters, periods), _wave(quarters + 1, periods)

    def misread(course: Course) -> Any:
        turn = periods * course.turn
        bent = turn * course.rate**2 * wave(course)
        return -turn * (bent + course.acceleration * later(course))

    return misread


def _built_up(share: float) -> Callable[[Course], Any]:
    """What friction that builds up over a share of the range lacks after a reversal."""

    def built_up(course: Course) -> Any:
        import numpy as np

        return course.direction * np.exp(-course.way / share)

    return built_up


def _at_pace(centre: float) -> Callable[[Course], Any]:
    """Friction at speeds around a centre only."""

    def at_pace(course: Course) -> Any:
        import numpy as np

        return course.direction * np.exp(-0.5 * ((course.pace - centre) / BUMP) ** 2)

    return at_pace


def _directed(value: Callable[[Course], Any]) -> Callable[[Course], Any]:
    return lambda course: course.direction * value(course)


def _directed_wave(quarters: int, periods: int) -> Callable[[Course], Any]:
    return _directed(_wave(quarters, periods))


_TORQUE, _BY_TIME, _BY_READING = (1, 0, 0), (1, 0, -1), (1, 0, 2)


def _waves(periods: int) -> tuple[Term, ...]:
    """What repeats so many times over the range, each in two phases."""
    many = f"{periods} period{'s' if periods > 1 else ''}"
    kinds = (
        ("", "ripple of the torque", _TORQUE, _wave, MOST_PERIODS),
        ("sign*", "ripple of friction", _TORQUE, _directed_wave, MOST_PERIODS),
        ("misread ", "eccentric encoder", _BY_READING, _misread, MOST_MISREAD),
    )
    return tuple(
        Term(
            f"{kind}{phase}({many})",
            f"{meaning}, {many} over the range",
            Role.DRIVE,
            powers,
            value(quarters, periods),
            part=f"{kind}wave({many})",
            units=("kg m^2 rad", "kg m") if value is _misread else ("", ""),
        )
        for kind, meaning, powers, value, most in kinds
        for quarters, phase in enumerate(("cos", "sin"))
        if periods <= most
    )


COURSE = (
    Term("time", "drift of the torque", Role.DRIVE, _BY_TIME, lambda c: c.time),
    Term("sign*time", "drift of friction", Role.DRIVE, _BY_TIME, _directed(lambda c: c.time)),
    *(row for periods in range(1, MOST_MISREAD + 1) for row in _waves(periods)),
    *(
        Term(
            f"sign*exp(-way/{share:g})",
            f"hysteresis over {share:.1%} of the range".replace(".0%", "%"),
            Role.DRIVE,
            _TORQUE,
            _built_up(share),
        )
        for share in BUILT_UP
    ),
    *(
        Term(
            f"sign*bump({centre:g})",
            f"friction at speeds around {centre:.0%} of their range, in the logarithm",
            Role.DRIVE,
            _TORQUE,
            _at_pace(centre),
        )
        for centre in CENTRES
    ),
)
"""Rows in the form of :mod:`~scissorcal.model.friction_terms`; a wave's two phases are one part."""
LIBRARY = TERMS | {term.name: term for term in COURSE}
"""Terms that the critic searches: those that a recipe adopts, then those of a whole course."""
