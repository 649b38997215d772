"""How slowly blades slide steadily on friction that falls with speed. Pure.

Friction at a rate v is Fc + S exp(-(v / ws)^2) + Fv v (the Stribeck law of docs/model.md). It falls
with speed by 2 S v / ws^2 exp(-(v / ws)^2), at most by sqrt(2 / e) S / ws, at ws / sqrt(2). A loop
that does not stand this fall sticks and slips instead of sliding (Armstrong-Helouvry, Dupont and
Canudas de Wit 1994, doi:10.1016/0005-1098(94)90209-7).
"""

import math
from dataclasses import dataclass

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
