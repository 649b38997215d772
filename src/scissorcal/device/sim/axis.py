"""One axis of the mechanism: inertia, dry friction, two inelastic stops, and energy losses."""

from scissorcal.device.sim.friction import DryFriction


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
