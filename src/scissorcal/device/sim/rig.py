"""The virtual rig: mechanism, motors, sensors, sheet or plate, and hand, simulated tick by tick.

The opening axis obeys

    I acc = motor_torque - R handle_force - friction(theta, rate) + tau_cut - offset

and the advance axis the same with its mass and the cut's force. Each tick takes SUBSTEPS steps
(see :mod:`scissorcal.device.sim.friction`), with friction as an impulse
(:mod:`scissorcal.device.sim.friction`). Everything is plain Python on floats: for scalars that is
faster than NumPy, and the laws share nothing with the model that is fitted or the kernel.
"""

import math
from dataclasses import dataclass

import numpy as np

from scissorcal.device.sim.blade import Sheet, blade_on
from scissorcal.device.sim.cutting import Cut
from scissorcal.device.sim.friction import Axis, DryFriction
from scissorcal.device.sim.hand import VirtualHand
from scissorcal.device.sim.plate_contact import PlateContact
from scissorcal.device.sim.sensors import Measured, SensorSet
from scissorcal.device.sim.specimen import Specimen

TICK_S = 1e-3
SUBSTEPS = 4
START_OPENING_RAD = math.radians(30.0)
START_ADVANCE_M = -0.06
STOP_MARGIN_RAD = 2e-4


@dataclass
class EnergyBook:
    """Work done since the start, in joules, on opening and advance axis together.

    What goes in: ``motor`` and ``hand``, and ``offset`` (the constant torque). What goes out:
    ``friction``, ``stops``, ``damping`` (of the sheet), ``fracture`` (new surface) and ``arrest``
    (lost when the crack stops). ``blades`` is
    the work of the sheet's elastic force on the blades. ``touch`` is the work of a touched plate on
    the blades; of that, ``touch_damping`` and ``touch_friction`` are lost, and ``carried`` is what
    the plate's own motion put in.
    """

    motor: float = 0.0
    hand: float = 0.0
    offset: float = 0.0
    blades: float = 0.0
    friction: float = 0.0
    stops: float = 0.0
    damping: float = 0.0
    fracture: float = 0.0
    arrest: float = 0.0
    touch: float = 0.0
    touch_damping: float = 0.0
    touch_friction: float = 0.0
    carried: float = 0.0


class VirtualRig:
    """A rig made of a specimen and a seeded generator; the same calls give the same numbers.

    ``joint`` and ``carriage`` are its two axes; they, ``opening``, ``rate``, ``advance``,
    ``advance_rate``, ``crack`` and ``time_s`` are the truth, for tests. What a device
    reports is what :meth:`tick` returns.
    """

    def __init__(self, specimen: Specimen, rng: np.random.Generator) -> None:
        self.specimen = specimen
        sensor_rng, hand_rng, self._sheet_rng = rng.spawn(3)
        mechanism = specimen.mechanism
        self.blade = blade_on(specimen)
        self.hand = VirtualHand(specimen, self.blade, TICK_S, hand_rng)
        self.sensors = SensorSet(specimen.sensors, TICK_S, sensor_rng)
        step = TICK_S / SUBSTEPS
        low, high = mechanism.opening_range_deg
        self.joint = Axis(
            mechanism.inertia_kg_m2,
            DryFriction.of_joint(mechanism.friction),
            (math.radians(low), math.radians(high)),
            START_OPENING_RAD,
            step,
        )
        low, high = mechanism.advance.range_mm
        self.carriage = Axis(
            mechanism.advance.mass_kg,
            DryFriction.of_advance(mechanism.advance),
            (low * 1e-3, high * 1e-3),
            START_ADVANCE_M,
            step,
        )
        self._radius = mechanism.handle_radius_mm * 1e-3
        self._keep = math.exp(-step / (specimen.motor.lag_ms * 1e-3))
        self.time_s = 0.0
        self.cut: Cut | None = None
        self.plate: PlateContact | None = None
        self._torque = 0.0
        self._force = 0.0
        self._book = EnergyBook()

    def tick(
        self,
        torque_command: float,
        force_command: float,
        enabled: bool = True,
        braking: bool = False,
    ) -> Measured:
        """Advance one millisecond under a motor torque (N m) and carriage force (N); measure.

        Commands beyond the motors' limits are clipped and flagged, non-finite ones count as 0.
        Disabled motors give no torque; ``braking`` shorts their windings, which damps.
        """
        motor = self.specimen.motor
        torque = _finite(torque_command) if enabled and not braking else 0.0
        force = _finite(force_command) if enabled and not braking else 0.0
        limit = motor.torque_limit_Nm
        saturated = not -limit <= torque <= limit
        torque = _clip(torque, -limit, limit)
        force = _clip(force, -motor.force_limit_N, motor.force_limit_N)
        crack = None if self.cut is None else self.cut.sheet.crack
        joint, carriage = self.joint, self.carriage
        push, shove = self.hand.forces(
            joint.place, joint.rate, carriage.place, carriage.rate, crack
        )
        cogging = motor.cogging_Nm * math.sin(motor.cogging_periods_per_turn * joint.place)
        brakes = (motor.brake_Nm_s_per_rad, motor.brake_N_s_per_m) if braking else (0.0, 0.0)
        self._move(torque, force, self._radius * push, shove, cogging, brakes)
        self.time_s += TICK_S
        at_stop = not joint.low + STOP_MARGIN_RAD < joint.place < joint.high - STOP_MARGIN_RAD
        return self.sensors.read(
            joint.place,
            carriage.place,
            self._torque - brakes[0] * joint.rate,
            push,
            at_stop,
            saturated,
        )

    def load_sheet(self) -> bool:
        """Put in a fresh sheet, near edge at 0; False (and no change) if the blades block it."""
        if self.blade.indentation(self.opening, -self.advance) > 0.0:
            return False
        self.remove_material()
        self.cut = Cut(self.blade, Sheet(self.specimen.material, self._sheet_rng))
        return True

    def load_plate(self) -> bool:
        """Put in the plate to touch; False (and no change) without one, or if the tip blocks it."""
        if self.specimen.plate is None:
            return False
        plate = PlateContact(self.specimen.blade, self.specimen.plate, TICK_S / SUBSTEPS)
        if plate.blocked(self.opening, self.advance):
            return False
        self.remove_material()
        self.plate = plate
        return True

    def remove_material(self) -> None:
        """Take out the sheet or the plate; its stored energy is lost."""
        if self.cut is not None:
            stored = self.cut.stored_energy(self.opening, self.advance)
            self._book.fracture += self.cut.fracture_J
            self._book.arrest += self.cut.arrest_J + stored
        if self.plate is not None:
            stored = self.plate.stored_energy(self.opening, self.advance)
            self._book.touch_damping += self.plate.damping_J + stored
            self._book.touch_friction += self.plate.friction_J
            self._book.carried += self.plate.carried_J
        self.cut = self.plate = None

    @property
    def opening(self) -> float:
        """Opening angle in rad."""
        return self.joint.place

    @property
    def rate(self) -> float:
        """Rate of the opening angle in rad/s."""
        return self.joint.rate

    @property
    def advance(self) -> float:
        """Place of the pivot in the plate frame, in m."""
        return self.carriage.place

    @property
    def advance_rate(self) -> float:
        """Rate of the advance in m/s."""
        return self.carriage.rate

    @property
    def crack(self) -> float:
        """Where the cut ends, in metres from the sheet's near edge; NaN without a sheet."""
        return math.nan if self.cut is None else self.cut.sheet.crack

    @property
    def kinetic_energy(self) -> float:
        """Kinetic energy of both axes in joules."""
        return self.joint.kinetic_energy + self.carriage.kinetic_energy

    @property
    def stored_energy(self) -> float:
        """Elastic energy in the sheet or the plate, in joules."""
        plate, cut = self.plate, self.cut
        in_plate = 0.0 if plate is None else plate.stored_energy(self.opening, self.advance)
        in_sheet = 0.0 if cut is None else cut.stored_energy(self.opening, self.advance)
        return in_plate + in_sheet

    @property
    def energy(self) -> EnergyBook:
        """The works so far, a copy."""
        book = EnergyBook(**vars(self._book))
        book.friction = self.joint.friction_J + self.carriage.friction_J
        book.stops = self.joint.stops_J + self.carriage.stops_J
        if self.cut is not None:
            book.fracture += self.cut.fracture_J
            book.arrest += self.cut.arrest_J
        if self.plate is not None:
            book.touch_damping += self.plate.damping_J
            book.touch_friction += self.plate.friction_J
            book.carried += self.plate.carried_J
        return book

    def _move(
        self,
        torque: float,
        force: float,
        grip: float,
        shove: float,
        cogging: float,
        brakes: tuple[float, float],
    ) -> None:
        joint, carriage, cut, book = self.joint, self.carriage, self.cut, self._book
        plate = self.plate
        damping, moving = self.specimen.material.rate_damping_N_s_per_m, self.blade.moving
        keep, offset = self._keep, self.specimen.mechanism.torque_offset_Nm
        actual, actual_force = self._torque, self._force
        for _ in range(SUBSTEPS):
            motor, thrust = actual, actual_force
            actual = torque + keep * (actual - torque)
            actual_force = force + keep * (actual_force - force)
            motor = 0.5 * (motor + actual) + cogging
            thrust = 0.5 * (thrust + actual_force)
            joint.coast()
            carriage.coast()
            on_joint = on_carriage = drag_torque = drag_force = 0.0
            if cut is not None:
                on_joint, drive, lever, slope, share = cut.move_to(joint.place, carriage.place)
                on_carriage = -drive
                if damping and share and lever > 0.0:
                    drag = damping * share * (slope * carriage.rate - lever * joint.rate / moving)
                    drag = max(drag, -on_joint / lever)
                    drag_torque, drag_force = drag * lever, -moving * drag * slope
            tip_torque = tip_force = 0.0
            if plate is not None:
                tip_torque, tip_force = plate.push(
                    joint.place, carriage.place, joint.rate, carriage.rate
                )
            turned = joint.push(
                motor - grip - offset + on_joint + drag_torque + tip_torque, brakes[0]
            )
            slid = carriage.push(thrust + shove + on_carriage + drag_force + tip_force, brakes[1])
            if plate is not None:
                plate.settle(turned, slid)
            book.motor += motor * turned + thrust * slid
            book.hand += shove * slid - grip * turned
            book.offset -= offset * turned
            book.blades += on_joint * turned + on_carriage * slid
            book.touch += tip_torque * turned + tip_force * slid
            book.damping -= drag_torque * turned + drag_force * slid
        self._torque, self._force = actual, actual_force


def _finite(value: float) -> float:
    return value if math.isfinite(value) else 0.0


def _clip(value: float, low: float, high: float) -> float:
    return low if value < low else min(value, high)
