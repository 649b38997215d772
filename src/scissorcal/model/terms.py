"""Terms by name that a law of friction may lack: the critic proposes them, a recipe adopts them."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Motion:
    """What a term is evaluated on, all arrays (n,).

    ``opening`` in rad (m for a linear joint), ``rate`` and ``acceleration`` its derivatives,
    ``load`` the effort that the joint bears (N m or N), None where it was not measured.
    """

    opening: Array
    rate: Array
    acceleration: Array
    load: Array | None = None


@dataclass(frozen=True)
class Term:
    """One term: coefficient times ``value`` (motion) is an effort that the drive must overcome.

    ``position``, ``seconds`` and ``effort`` are the powers of the joint's units that ``value``
    has. ``of_rate_only`` terms change with speed alone, so that a package's tables can carry them;
    ``rotary`` ones mean something for an angle only.
    """

    name: str
    meaning: str
    position: int
    seconds: int
    value: Callable[[Motion], Array]
    effort: int = 0
    of_rate_only: bool = False
    rotary: bool = False

    @property
    def adoptable(self) -> bool:
        """Whether a friction law can have it: what belongs to the acceleration is no friction."""
        return not self.name.startswith("acceleration")

    @property
    def needs_load(self) -> bool:
        return self.effort != 0

    def unit(self, position_unit: str, effort_unit: str) -> str:
        """Unit of the term's coefficient.

        >>> TERMS["rate^2"].unit("rad", "N m")
        'N m s^2/rad^2'
        """
        above = [] if self.effort else [effort_unit]
        if self.seconds:
            above.append(_power("s", -self.seconds))
        below = f"/{_power(position_unit, self.position)}" if self.position else ""
        return (" ".join(above) or "1") + below


def evaluate(names: tuple[str, ...], motion: Motion) -> Array:
    """Columns of the named terms over a motion, shape (n, len(names)).

    KeyError for a name that is not in :data:`TERMS`; ValueError for a term of the load where none
    was measured.

    >>> motion = Motion(np.array([0.3]), np.array([-2.0]), np.array([0.0]))
    >>> evaluate(("rate^2", "sign"), motion)
    array([[ 4., -1.]])
    """
    if not names:
        return np.zeros((len(motion.rate), 0))
    for name in names:
        if TERMS[name].needs_load and motion.load is None:
            raise ValueError(f'the term "{name}" needs a load, and none was measured')
    return np.stack([TERMS[name].value(motion) for name in names], axis=1)


def _power(unit: str, power: int) -> str:
    return unit if power == 1 else f"{unit}^{power}"


def _load(motion: Motion) -> Array:
    if motion.load is None:
        raise ValueError("no load was measured")
    return motion.load


_ALL = (
    Term("1", "constant", 0, 0, lambda m: np.ones_like(m.rate), of_rate_only=True),
    Term("sign", "Coulomb friction", 0, 0, lambda m: np.sign(m.rate), of_rate_only=True),
    Term("rate", "viscous friction", 1, -1, lambda m: m.rate, of_rate_only=True),
    Term("|rate|", "viscous, unequal", 1, -1, lambda m: np.abs(m.rate), of_rate_only=True),
    Term("rate^2", "quadratic, unequal", 2, -2, lambda m: m.rate**2, of_rate_only=True),
    Term("rate*|rate|", "drag", 2, -2, lambda m: m.rate * np.abs(m.rate), of_rate_only=True),
    Term("rate^3", "cubic in the rate", 3, -3, lambda m: m.rate**3, of_rate_only=True),
    Term("opening", "spring", 1, 0, lambda m: m.opening),
    Term("opening^2", "spring, quadratic", 2, 0, lambda m: m.opening**2),
    Term("sin(opening)", "weight", 0, 0, lambda m: np.sin(m.opening), rotary=True),
    Term("cos(opening)", "weight", 0, 0, lambda m: np.cos(m.opening), rotary=True),
    Term("sign*opening", "Coulomb by place", 1, 0, lambda m: np.sign(m.rate) * m.opening),
    Term(
        "sign*opening^2",
        "Coulomb by place, quadratic",
        2,
        0,
        lambda m: np.sign(m.rate) * m.opening**2,
    ),
    Term("rate*opening", "viscous by place", 2, -1, lambda m: m.rate * m.opening),
    Term("rate^2*opening", "quadratic by place", 3, -2, lambda m: m.rate**2 * m.opening),
    Term("acceleration", "inertia", 1, -2, lambda m: m.acceleration),
    Term("acceleration*opening", "inertia by place", 2, -2, lambda m: m.acceleration * m.opening),
    Term("load", "transmission", 0, 0, _load, effort=1),
    Term("load*sign", "friction by load", 0, 0, lambda m: _load(m) * np.sign(m.rate), effort=1),
    Term("load*rate", "viscous by load", 1, -1, lambda m: _load(m) * m.rate, effort=1),
)

TERMS = {term.name: term for term in _ALL}
"""Every term by its name, simple ones first."""
