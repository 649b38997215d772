"""Energy between hand and package: the servo's books, and the settings of its controller."""

import math
from dataclasses import dataclass, fields


@dataclass(frozen=True, kw_only=True)
class PassivityConfig:
    """How rendered energy is watched, in SI units and radians.

    ``is_measured``: states hold the torque that the motor exerts, and work is booked with it.
    ``rig_damping`` and ``rig_coulomb`` are the rig's own friction, which takes what the loop
    creates. ``handle_radius`` (m) turns the force that a sensor of the hand measures into torque; 0
    without a sensor. Beyond ``margin_J`` the controller adds at most ``most_damping`` (0 for none).
    Rendered friction builds up over ``friction_width`` (rad) after a reversal; 0 lets it grow with
    the rate.
    Raises ValueError for a number that is not finite or below 0.
    """

    is_measured: bool = False
    rig_damping: float = 0.0
    rig_coulomb: float = 0.0
    margin_J: float = 0.0
    most_damping: float = 0.0
    handle_radius: float = 0.0
    friction_width: float = 0.0

    def __post_init__(self) -> None:
        for field in fields(self):
            value = getattr(self, field.name)
            if not 0.0 <= value < math.inf:
                raise ValueError(f"{field.name} = {value} is not usable: give a number from 0 on.")


UNWATCHED_ENERGY = PassivityConfig()
"""Books alone, with the commanded torque."""


@dataclass(frozen=True)
class EnergyLedger:
    """Joules since the start; all but ``delivered_J`` while rendering.

    ``delivered_J``: work of the motors on the mechanism, by measured torque where the device
    measures it. The model's energies, as far as the ramp has engaged it: stored in the material
    now, taken by the cut (kappa J_c h dX), lost by arresting cracks, taken by rendered friction.
    ``engaged_J`` is what the ramp put into pressed material, ``limited_J`` the work that limits
    kept back, ``injected_J`` (negative) what the passivity controller took, ``late_J`` the rest:
    work beyond the commands, by holding, delay and lag. ``hand_J``: work of the hand while the
    motors are on, 0 without a sensor of its force. ``plate_J``: what who moves a plate of estimated
    pose put into its material.
    """

    delivered_J: float
    stored_J: float
    fracture_J: float
    arrest_J: float
    friction_J: float
    engaged_J: float = 0.0
    limited_J: float = 0.0
    late_J: float = 0.0
    injected_J: float = 0.0
    hand_J: float = 0.0
    plate_J: float = 0.0

    @property
    def absorbed_J(self) -> float:  # noqa: N802  (J is the unit)
        """What the model took for good."""
        return self.fracture_J + self.arrest_J + self.friction_J

    @property
    def created_J(self) -> float:  # noqa: N802
        """Energy delivered beyond what the model accounts for; above 0: not passive.

        For runs that only rendered: tracking a reference delivers work as well.
        """
        came = self.engaged_J + self.limited_J + self.plate_J
        return self.delivered_J + self.stored_J + self.absorbed_J - came

    @property
    def rig_J(self) -> float:  # noqa: N802
        """What hand and motors gave to the rig, whose friction takes it: below 0 is impossible."""
        return self.hand_J + self.delivered_J

    @property
    def unbooked_J(self) -> float:  # noqa: N802
        """What the books leave unexplained: the sampling of the model's torque between frames."""
        return self.created_J - self.late_J - self.injected_J
