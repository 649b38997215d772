"""What a row of the table of friction terms is: a parameter, its unit, transform, prior and value.

The rows stand in :mod:`scissorcal.model.friction_terms`. numpy is imported where it is used, so
that reading a recipe does not load it.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum
from typing import TYPE_CHECKING, Any, Literal

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    Array = NDArray[np.float64]

Z_95 = 1.6448536269514722
"""Quantile 0.95 of the standard normal distribution: 90 % lie within +-1.645 sd."""


@dataclass(frozen=True)
class Transform:
    """The identity, and the base of the others: x = u.

    ``name`` is what files and reports call it. A prior of such a parameter is stated as ``mean``
    and ``sd``.
    """

    name: str = "identity"

    def natural(self, u: Array) -> Array:
        """Values x in the parameter's unit from unconstrained u, any shape."""
        import numpy as np

        return np.asarray(u)

    def unconstrained(self, x: Array) -> Array:
        """Unconstrained values u from x in the parameter's unit, any shape."""
        import numpy as np

        return np.asarray(x)

    def normal_prior(self, centre: float, width: float) -> tuple[float, float]:
        """Mean and standard deviation in u of the prior that two numbers of a recipe state."""
        return centre, width


@dataclass(frozen=True)
class _Log(Transform):
    """x = exp(u) > 0. A prior is stated as ``median`` and ``factor_90``."""

    def natural(self, u: Array) -> Array:
        import numpy as np

        return np.asarray(np.exp(u))

    def unconstrained(self, x: Array) -> Array:
        import numpy as np

        return np.asarray(np.log(x))

    def normal_prior(self, centre: float, width: float) -> tuple[float, float]:
        return math.log(centre), math.log(width) / Z_95


@dataclass(frozen=True)
class _Logit(Transform):
    """x = 1 / (1 + exp(-u)), in (0, 1). A prior is stated as ``median`` and ``odds_factor_90``."""

    def natural(self, u: Array) -> Array:
        import numpy as np

        return np.asarray(1.0 / (1.0 + np.exp(-np.asarray(u))))

    def unconstrained(self, x: Array) -> Array:
        import numpy as np

        return np.asarray(np.log(x) - np.log1p(-np.asarray(x)))

    def normal_prior(self, centre: float, width: float) -> tuple[float, float]:
        return math.log(centre / (1.0 - centre)), math.log(width) / Z_95


IDENTITY = Transform()
LOG = _Log("log")
LOGIT = _Logit("logit")


JointKind = Literal["rotary", "linear"]


class Role(Enum):
    """How a parameter enters the drive (see :class:`scissorcal.model.FrictionLaw`)."""

    DRIVE = "drive"
    """Added to the drive, and no friction: inertia, offset, cogging, delay, noise."""
    DRY = "dry"
    """A level of friction that the place changes and that builds up after a reversal."""
    SLIDING = "sliding"
    """Friction that the place changes and that is there at once."""
    PLAIN = "plain"
    """Added as it is: neither place nor reversals change it."""
    PLACE = "place"
    """Factor of a power of the distance from the law's centre, in the factor A of the place."""
    SCALE = "scale"
    """The scale of another row's shape: Stribeck's speed, Dahl's length."""
    BUILD_UP = "build-up"
    """Share of dry friction that builds up after a reversal."""


@dataclass(frozen=True)
class Motion:
    """What terms are evaluated on, arrays (n,) or shapes that broadcast.

    ``opening`` in rad (m for a linear joint), ``rate`` and ``acceleration`` its derivatives,
    ``load`` the effort that the joint bears (N m or N), None where it was not measured. The rate
    may be complex: a slope by a complex step then keeps its sign (doi:10.1137/S003614459631241X).
    """

    opening: Any
    rate: Any
    acceleration: Any
    load: Any = None

    @property
    def direction(self) -> Array:
        """Sign of the rate."""
        import numpy as np

        return np.asarray(np.sign(np.real(self.rate)))

    @property
    def speed(self) -> Array:
        """Magnitude of the rate."""
        import numpy as np

        return np.asarray(self.rate * self.direction)


@dataclass(frozen=True)
class Prior:
    """Default priors of one parameter by kind of joint, each (centre, width, why).

    By the row's transform: (median, factor_90) of a logarithm, (mean, sd) of the identity, (median,
    odds_factor_90) of a logit. ``key`` is the recipe's name without its unit, by default that of
    the parameter. ``in_ticks`` priors are stated in samples of the recording. ``beside`` names a
    level in whose proportion this one is: its median holds at that level's, its factor for their
    ratio.
    """

    rotary: tuple[float, float, str]
    linear: tuple[float, float, str]
    key: str = ""
    in_ticks: bool = False
    beside: str = ""

    def of(self, kind: JointKind) -> tuple[float, float, str]:
        """The default for one kind of joint."""
        return self.rotary if kind == "rotary" else self.linear


@dataclass(frozen=True)
class Term:
    """One parameter of a law, or one term that a recipe may adopt by name.

    ``powers`` are those of the joint's units in the parameter: effort, position, seconds.
    ``value`` (motion), or (motion, scale) where ``scale`` names a row, is what the parameter
    multiplies; a DRY row's is a magnitude. ``part`` is the word of a law's name that brings the
    row; without one a term is adopted by its name, or belongs to the drive. ``sided`` rows have one
    parameter for each direction, ``name_pos`` and ``name_neg``, in an asymmetric law. ``rotary``
    terms mean something for an angle only. ``nuisance`` rows are fitted and not reported.
    ``covers`` are terms that a law with this row need not adopt. ``remedy`` is what to do where the
    data want the level below zero.
    """

    name: str
    meaning: str
    role: Role
    powers: tuple[int, int, int]
    value: Callable[..., Any] | None = None
    part: str = ""
    transform: Transform = IDENTITY
    prior: Prior | None = None
    scale: str = ""
    sided: bool = False
    needs_load: bool = False
    rotary: bool = False
    nuisance: bool = False
    covers: tuple[str, ...] = ()
    units: tuple[str, str] = ("", "")
    remedy: str = ""

    @property
    def adoptable(self) -> bool:
        """Whether a recipe may adopt it: what belongs to the acceleration is no friction."""
        return not self.part and self.role is not Role.DRIVE

    @property
    def power(self) -> int:
        """Power of the distance from the centre that a PLACE row multiplies."""
        return -self.powers[1]

    def unit(self, position_unit: str, effort_unit: str) -> str:
        """Unit of the parameter, for a joint's units.

        >>> Term("rate^2", "drag", Role.SLIDING, (1, -2, 2)).unit("rad", "N m")
        'N m s^2/rad^2'
        """
        named = self.units[0 if position_unit == "rad" else 1]
        if named:
            return named
        units = (effort_unit, position_unit, "s")
        above = [_power(u, p) for u, p in zip(units, self.powers, strict=True) if p > 0]
        below = [_power(u, -p) for u, p in zip(units, self.powers, strict=True) if p < 0]
        return " ".join(above or ["1"]) + ("/" + " ".join(below) if below else "")

    def column(self, motion: Motion, *scale: Any) -> Array:
        """What the parameter multiplies, of the shape of the motion's rate."""
        import numpy as np

        if self.value is None:
            raise ValueError(f"{self.name} multiplies nothing by itself")
        return np.asarray(np.broadcast_to(self.value(motion, *scale), np.shape(motion.rate)))

    def names(self, symmetric: bool) -> tuple[str, ...]:
        """Names of the parameters that the row brings."""
        if self.sided and not symmetric:
            return (f"{self.name}_pos", f"{self.name}_neg")
        return (self.name,)

    def prior_key(self, kind: JointKind) -> str:
        """The recipe's name of the prior, with its unit.

        >>> Term("viscous", "viscous friction", Role.SLIDING, (1, -1, 1)).prior_key("rotary")
        'viscous_Nm_s_per_rad'
        """
        if self.prior and self.prior.in_ticks:
            return f"{self.name}_ticks"
        position, effort = ("rad", "N m") if kind == "rotary" else ("m", "N")
        unit = self.unit(position, effort).replace("N m", "Nm").replace("^", "")
        above, _, below = unit.partition("/")
        stem = (self.prior.key if self.prior else "") or self.name
        above = "" if above == "1" else "_" + above.replace(" ", "_")
        return stem + above + ("_per_" + below.replace(" ", "_per_") if below else "")


def _power(unit: str, power: int) -> str:
    return unit if power == 1 else f"{unit}^{power}"
