"""The rig's two axes as identified: inertia, friction and offset of opening and advance."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from scissorcal.aliases import Array
from scissorcal.model.checks import SMALLEST, check_numbers
from scissorcal.model.friction import FrictionLaw, friction_torque
from scissorcal.model.mechanism.dynamics import Mechanism


@dataclass(frozen=True)
class AxisLaw:
    """One axis: inertia * acceleration + F(place, rate) + offset = drive.

    ``inertia`` in kg m^2 (kg for a sliding axis), ``offset`` in N m (N). Dry friction jumps at
    rest; below ``rest_rate`` (rad/s or m/s) friction is the damper F(rest_rate) / rest_rate, as a
    package's tables have it (0: it jumps, and no integrator of fixed steps stands still).
    ModelError for an inertia that is not positive.
    """

    inertia: float
    friction: FrictionLaw
    offset: float = 0.0
    rest_rate: float = 0.0

    def __post_init__(self) -> None:
        check_numbers("the inertia of an axis (kg m^2 or kg)", self.inertia, SMALLEST)
        check_numbers("the offset of an axis (N m or N)", self.offset)
        check_numbers("the rest rate of an axis (rad/s or m/s)", self.rest_rate, 0.0)

    @classmethod
    def of_fit(
        cls, values: Mapping[str, float], angle_center: float, rest_rate: float
    ) -> "AxisLaw":
        """The axis from a friction fit's parameters by name, at its MAP point or mean."""
        law = FrictionLaw.of_fit(values, angle_center)
        return cls(float(values["inertia"]), law, float(values.get("offset", 0.0)), rest_rate)

    def effort(self, place: ArrayLike, rate: ArrayLike) -> Array:
        """F + offset, what the drive must give at an even rate; places and rates broadcast.

        >>> sledge = AxisLaw(0.8, FrictionLaw({"coulomb": 0.8, "viscous": 4.0}), rest_rate=1e-3)
        >>> sledge.effort(0.0, [-0.1, 0.0, 5e-4, 0.1])
        array([-1.2  ,  0.   ,  0.402,  1.2  ])
        """
        speed = np.asarray(rate, dtype=np.float64)
        if self.rest_rate == 0.0:
            return friction_torque(self.friction, place, speed) + self.offset
        least = np.copysign(np.maximum(np.abs(speed), self.rest_rate), speed)
        share = np.abs(speed) / np.abs(least)
        return share * friction_torque(self.friction, place, least) + self.offset


def rig_mechanism(opening: AxisLaw, advance: AxisLaw) -> Mechanism:
    """The rig's mechanism over q = (opening, advance), from what was identified of each axis.

    D is diagonal: the blades' centre of mass, which would couple the axes by its distance from the
    pivot, is not identified (docs/model.md).
    """
    axes = (opening, advance)
    return Mechanism(
        np.diag([axis.inertia for axis in axes]),
        lambda q, rates: np.array([float(a.effort(q[i], rates[i])) for i, a in enumerate(axes)]),
    )
