"""The virtual rig: mechanism, motors, sensors, sheet and hand, one device tick at a time.

The opening axis obeys

    I acc = motor_torque - R handle_force - friction(theta, rate) + tau_cut - offset

and the advance axis the same with its mass and the cut's force. Each tick takes SUBSTEPS steps of
the leapfrog scheme (half a step of position, one of velocity, half a step of position), which
keeps the energy of elastic contact, with friction as an impulse (see
:mod:`scissorcal.device.sim.friction`). Everything is plain Python on floats: for scalars that is
faster than NumPy, and the laws share nothing with the model that is fitted or the kernel.
"""

import math
from dataclasses import dataclass

import numpy as np

from scissorcal.device.sim.blade import BladeOnSheet
from scissorcal.device.sim.cutting import Cut
from scissorcal.device.sim.friction import DryFriction
from scissorcal.device.sim.hand import VirtualHand
from scissorcal.device.sim.material import Sheet
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
    the work of the sheet's elastic force on the blades.
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


class VirtualRig:
    """A rig made of a specimen and a seeded generator; the same calls give the same numbers.

    The public attributes ``opening``, ``rate``, ``advance``, ``advance_rate`` and ``time_s`` are
    the truth, for tests and judges; what a device reports is what :meth:`tick` returns.
    """

    def __init__(self, specimen: Specimen, rng: np.random.Generator) -> None:
        self.specimen = specimen
        sensor_rng, hand_rng, self._sheet_rng = rng.spawn(3)
        mechanism = specimen.mechanism
        self.blade = BladeOnSheet(specimen)
        self.hand = VirtualHand(specimen, self.blade, TICK_S, hand_rng)
        self.sensors = SensorSet(specimen.sensors, TICK_S, sensor_rng)
        self.friction = DryFriction.of_joint(mechanism.friction)
        self.advance_friction = DryFriction.of_advance(mechanism.advance)
        low, high = mechanism.opening_range_deg
        self._opening_range = (math.radians(low), math.radians(high))
        low, high = mechanism.advance.range_mm
        self._advance_range = (low * 1e-3, high * 1e-3)
        self._radius = mechanism.handle_radius_mm * 1e-3
        step = TICK_S / SUBSTEPS
        self._keep = math.exp(-step / (specimen.motor.lag_ms * 1e-3))
        self.opening = _clip(START_OPENING_RAD, *self._opening_range)
        self.advance = _clip(START_ADVANCE_M, *self._advance_range)
        self.rate = 0.0
        self.advance_rate = 0.0
        self.time_s = 0.0
        self.cut: Cut | None = None
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
        """Let one millisecond pass under a motor torque (N m) and sledge force (N); measure.

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
        push, shove = self.hand.forces(
            self.opening, self.rate, self.advance, self.advance_rate, crack
        )
        cogging = motor.cogging_Nm * math.sin(motor.cogging_periods_per_turn * self.opening)
        brakes = (motor.brake_Nm_s_per_rad, motor.brake_N_s_per_m) if braking else (0.0, 0.0)
        self._move(torque, force, push, shove, cogging, brakes)
        self.time_s += TICK_S
        low, high = self._opening_range
        at_stop = not low + STOP_MARGIN_RAD < self.opening < high - STOP_MARGIN_RAD
        return self.sensors.read(
            self.opening,
            self.advance,
            self._torque - brakes[0] * self.rate,
            push,
            at_stop,
            saturated,
        )

    def load_sheet(self) -> bool:
        """Put in a fresh sheet, near edge at 0; False (and no change) if the blades block it."""
        if self.blade.indentation(self.opening, -self.advance) > 0.0:
            return False
        self.remove_sheet()
        self.cut = Cut(self.blade, Sheet(self.specimen.material, self._sheet_rng))
        return True

    def remove_sheet(self) -> None:
        """Take the sheet out; what it stored is gone with it."""
        if self.cut is not None:
            stored = self.cut.stored_energy(self.opening, self.advance)
            self._book.fracture += self.cut.fracture_J
            self._book.arrest += self.cut.arrest_J + stored
        self.cut = None

    @property
    def crack(self) -> float:
        """Where the cut ends, in metres from the sheet's near edge; NaN without a sheet."""
        return math.nan if self.cut is None else self.cut.sheet.crack

    @property
    def kinetic_energy(self) -> float:
        """Kinetic energy of both axes in joules."""
        mechanism = self.specimen.mechanism
        return 0.5 * (
            mechanism.inertia_kg_m2 * self.rate**2
            + mechanism.advance.mass_kg * self.advance_rate**2
        )

    @property
    def stored_energy(self) -> float:
        """Elastic energy in the sheet, in joules."""
        return 0.0 if self.cut is None else self.cut.stored_energy(self.opening, self.advance)

    @property
    def energy(self) -> EnergyBook:
        """The books so far, a copy."""
        book = EnergyBook(**vars(self._book))
        if self.cut is not None:
            book.fracture += self.cut.fracture_J
            book.arrest += self.cut.arrest_J
        return book

    def _move(
        self,
        torque: float,
        force: float,
        push: float,
        shove: float,
        cogging: float,
        brakes: tuple[float, float],
    ) -> None:
        mechanism = self.specimen.mechanism
        inertia, mass = mechanism.inertia_kg_m2, mechanism.advance.mass_kg
        step = TICK_S / SUBSTEPS
        half, mobility, sledge = 0.5 * step, step / inertia, step / mass
        damping = self.specimen.material.rate_damping_N_s_per_m
        moving, cut, book, keep = self.blade.moving, self.cut, self._book, self._keep
        offset = mechanism.torque_offset_Nm
        opening, rate = self.opening, self.rate
        advance, speed = self.advance, self.advance_rate
        actual, actual_force = self._torque, self._force
        for _ in range(SUBSTEPS):
            actual = torque + keep * (actual - torque)
            actual_force = force + keep * (actual_force - force)
            opening += half * rate
            advance += half * speed
            on_opening = on_advance = drag_torque = drag_force = 0.0
            if cut is not None:
                on_opening, drive, lever, slope, share = cut.move_to(opening, advance)
                on_advance = -drive
                if damping and share and lever > 0.0:
                    drag = damping * share * (slope * speed - lever * rate / moving)
                    drag = max(drag, -on_opening / lever)
                    drag_torque, drag_force = drag * lever, -moving * drag * slope
            outer = actual + cogging - self._radius * push - offset
            free = rate + mobility * (outer + on_opening + drag_torque)
            after = self.friction.next_rate(opening, rate, free, mobility, brakes[0])
            free_speed = speed + sledge * (actual_force + shove + on_advance + drag_force)
            after_speed = self.advance_friction.next_rate(
                advance, speed, free_speed, sledge, brakes[1]
            )
            turned, slid = half * (rate + after), half * (speed + after_speed)
            book.motor += (actual + cogging) * turned + actual_force * slid
            book.hand += shove * slid - self._radius * push * turned
            book.offset -= offset * turned
            book.blades += on_opening * turned + on_advance * slid
            book.damping -= drag_torque * turned + drag_force * slid
            book.friction += ((free - after) * turned / mobility) + (
                (free_speed - after_speed) * slid / sledge
            )
            rate, speed = after, after_speed
            opening += half * rate
            advance += half * speed
            if not self._opening_range[0] < opening < self._opening_range[1]:
                opening, rate = self._stop(opening, rate, self._opening_range, inertia)
            if not self._advance_range[0] < advance < self._advance_range[1]:
                advance, speed = self._stop(advance, speed, self._advance_range, mass)
        self.opening, self.rate = opening, rate
        self.advance, self.advance_rate = advance, speed
        self._torque, self._force = actual, actual_force

    def _stop(
        self, place: float, rate: float, bounds: tuple[float, float], inertia: float
    ) -> tuple[float, float]:
        """Throw an axis back from its stop, with the energy that the stop swallows booked."""
        bound = bounds[0] if place <= bounds[0] else bounds[1]
        inwards = rate > 0.0 if bound == bounds[0] else rate < 0.0
        after = rate if inwards else -self.specimen.mechanism.stop_restitution * rate
        self._book.stops += 0.5 * inertia * (rate * rate - after * after)
        return bound, after


def _finite(value: float) -> float:
    return value if math.isfinite(value) else 0.0


def _clip(value: float, low: float, high: float) -> float:
    return low if value < low else min(value, high)
