"""A joint with dry friction: it holds at rest, and slides with a level that depends on speed.

No smoothing stands in for stiction. One step of time solves for the friction impulse: the body
first moves freely, and friction then takes off at most what brings it to rest (the time-stepping
scheme of Moreau, see Acary and Brogliato 2008, doi:10.1007/978-3-540-75392-6). So a body at rest
stays exactly at rest, and nothing chatters.
"""

import math

from scissorcal.device.sim.specimen import AdvanceAxis, Friction


class DryFriction:
    """Coulomb, viscous and Stribeck friction with a factor that depends on the position.

    Levels in N m against rates in rad/s (N against m/s for a sliding axis).
    """

    __slots__ = (
        "center",
        "coulomb_neg",
        "coulomb_pos",
        "curvature",
        "inverse_rate",
        "slope",
        "stribeck",
        "viscous_neg",
        "viscous_pos",
    )

    def __init__(
        self,
        coulomb: tuple[float, float],
        viscous: tuple[float, float],
        stribeck: float = 0.0,
        stribeck_rate: float = 1.0,
        angle: tuple[float, float, float] = (0.0, 0.0, 0.0),
    ) -> None:
        """``coulomb`` and ``viscous`` are (positive rate, negative rate), ``angle`` (c, a1, a2)."""
        self.coulomb_pos, self.coulomb_neg = coulomb
        self.viscous_pos, self.viscous_neg = viscous
        self.stribeck = stribeck
        self.inverse_rate = 1.0 / stribeck_rate
        self.center, self.slope, self.curvature = angle

    @classmethod
    def of_joint(cls, law: Friction) -> "DryFriction":
        """Friction of the opening axis as the specimen states it."""
        return cls(
            (law.coulomb_opening_Nm, law.coulomb_closing_Nm),
            (law.viscous_opening_Nm_s_per_rad, law.viscous_closing_Nm_s_per_rad),
            law.stribeck_Nm,
            law.stribeck_rate_rad_per_s,
            (
                math.radians(law.angle_center_deg),
                law.angle_slope_per_rad,
                law.angle_curvature_per_rad2,
            ),
        )

    @classmethod
    def of_advance(cls, axis: AdvanceAxis) -> "DryFriction":
        """Friction of the advance axis."""
        return cls(
            (axis.coulomb_N, axis.coulomb_N), (axis.viscous_N_s_per_m, axis.viscous_N_s_per_m)
        )

    def factor(self, position: float) -> float:
        """Factor on all levels at ``position``."""
        away = position - self.center
        return 1.0 + away * (self.slope + away * self.curvature)

    def sliding(self, position: float, rate: float) -> float:
        """Friction while sliding, with the sign of ``rate``; 0 at rest."""
        if rate == 0.0:
            return 0.0
        speed = abs(rate)
        relative = speed * self.inverse_rate
        level = self.stribeck * math.exp(-relative * relative)
        if rate > 0.0:
            return (level + self.coulomb_pos + self.viscous_pos * speed) * self.factor(position)
        return -(level + self.coulomb_neg + self.viscous_neg * speed) * self.factor(position)

    def next_rate(
        self, position: float, rate: float, free: float, mobility: float, brake: float
    ) -> float:
        """Rate after one step in which the body would reach ``free`` without friction.

        ``mobility`` is dt / inertia, ``brake`` extra viscous damping. Coulomb and viscous parts
        are implicit; the Stribeck part is taken at the rate before. The result never has the
        opposite sign of ``free``: friction stops motion, it does not drive it.
        """
        if free > 0.0:
            level, viscous, speed = self.coulomb_pos, self.viscous_pos, free
        else:
            level, viscous, speed = self.coulomb_neg, self.viscous_neg, -free
        if self.stribeck:
            if rate * free > 0.0:
                relative = rate * self.inverse_rate
                level += self.stribeck * math.exp(-relative * relative)
            else:
                level += self.stribeck
        away = position - self.center
        scale = (1.0 + away * (self.slope + away * self.curvature)) * mobility
        left = speed - scale * level
        if left <= 0.0:
            return 0.0
        left /= 1.0 + scale * viscous + mobility * brake
        return left if free > 0.0 else -left


class Axis:
    """A body that turns or slides; one step is :meth:`coast`, then :meth:`push`.

    Together they are one step of the leapfrog scheme (half a step of position, one of velocity,
    half a step of position), which keeps the energy of elastic forces that are taken in between.
    ``place`` and ``rate`` are the state, in rad or m; ``friction_J`` and ``stops_J`` what is lost.
    """

    __slots__ = (
        "_half",
        "_law",
        "_mobility",
        "friction_J",
        "high",
        "inertia",
        "low",
        "place",
        "rate",
        "stops_J",
    )

    def __init__(
        self,
        inertia: float,
        law: DryFriction,
        bounds: tuple[float, float],
        place: float,
        step: float,
    ) -> None:
        """``step`` is the length of a step in seconds; ``place`` is clipped to ``bounds``."""
        self.inertia = inertia
        self.low, self.high = bounds
        self.place = min(max(place, self.low), self.high)
        self.rate = 0.0
        self.friction_J = 0.0
        self.stops_J = 0.0
        self._law = law
        self._half = 0.5 * step
        self._mobility = step / inertia

    def coast(self) -> None:
        """Move on for half a step."""
        self.place += self._half * self.rate

    def push(self, effort: float, brake: float) -> float:
        """Apply an effort for one step, move on for half a step; give how far it went in all.

        ``effort`` is torque or force, ``brake`` a viscous damping.
        """
        before, place, half = self.rate, self.place, self._half
        free = before + self._mobility * effort
        after = self._law.next_rate(place, before, free, self._mobility, brake)
        moved = half * (before + after)
        place += half * after
        self.rate = after
        if not self.low < place < self.high:
            beyond = place - (self.low if place <= self.low else self.high)
            place -= beyond
            moved -= beyond
            self._strike(beyond, moved, before)
        self.place = place
        self.friction_J += (free - after) * moved / self._mobility
        return moved

    @property
    def kinetic_energy(self) -> float:
        """Kinetic energy in joules."""
        return 0.5 * self.inertia * self.rate * self.rate

    def _strike(self, beyond: float, moved: float, before: float) -> None:
        """Stop at the stop, and add the lost kinetic energy to ``stops_J``."""
        after = self.rate
        kept = 0.0 if after * beyond > 0.0 else after
        work = self.inertia * (after - before) / (2.0 * self._half) * moved
        self.stops_J += work + 0.5 * self.inertia * (before * before - kept * kept)
        self.rate = kept
