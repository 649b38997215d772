"""Run the second rig over a timeline: inputs at each tick in, books of the truth out."""

import ctypes
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from scissorcal.aliases import Array

from .library import JUMP, PARAMETERS, ROW, Inputs, library
from .parameters import Material, Rig

Integers = NDArray[np.int32]

OFF, SERVO, BRAKE, HAND = range(4)
"""Who moves the blades at a tick."""

LAWS = {"power": 0.0, "exponential": 1.0, "two_slopes": 2.0}
GRID_M = 20e-6
JUMP_ROOM = 400_000
FAILURES = {
    1: "A sheet was put in while the blades stood in its way: start with the blades open.",
    2: "The crack or the rate's sign changed without end within one tick.",
    3: "The motion is not finite: the servo's gains do not suit the rig.",
}


@dataclass(frozen=True)
class Timeline:
    """What is asked of the rig at each tick, arrays (n,): references or the hand's paths.

    ``mode`` is who moves it, ``stroke`` the label (-1: none), ``sheet`` what lies in it (-1:
    nothing), ``tremor`` the hand's force in N. ``gap_s`` is the time that passes unrecorded
    before a tick.
    """

    opening: Array
    rate: Array
    advance: Array
    advance_rate: Array
    tremor: Array
    mode: Integers
    stroke: Integers
    sheet: Integers
    gap_s: Array

    def __len__(self) -> int:
        return len(self.opening)


@dataclass(frozen=True)
class Books:
    """The truth at every tick of a capture.

    ``rows`` (n,) has the fields of library.ROW: motion, crack, forces, and cumulative works and
    energies in joules. ``cut_work`` is what the sheet's elastic force does on the blades' opening,
    so a cut makes it negative; ``cut_torque`` holds the rate damping too, whose work is booked in
    ``damping_work``. Friction, damping, ``fracture`` (kappa J per metre) and ``arrest`` are losses.
    ``jumps`` has each run of a rippled crack: time (s), opening, advance, start and end (m, plate
    frame), toughness there (N), the drive after it, and the sheet. ``toughness`` (sheets, grid) is
    J(X) on a grid of ``grid_m``; ``time_s``, ``stroke`` and ``sheet`` (n,) are the rows' labels.
    """

    rows: NDArray[np.void]
    jumps: NDArray[np.void]
    toughness: Array
    grid_m: float
    time_s: Array
    stroke: Integers
    sheet: Integers

    @property
    def sheet_fracture_energy(self) -> Array:
        """Mean toughness J_c h of each sheet over its length, in N, (sheets,)."""
        cells = 0.5 * (self.toughness[:, 1:] + self.toughness[:, :-1])
        return np.asarray(cells.mean(axis=1))

    @property
    def imbalance(self) -> Array:
        """Energy that came from nowhere, in J, (n,): zero but for the integrator's error."""
        r = self.rows
        given = (
            r["motor_work"] + r["sledge_motor_work"] + r["hand_work"] + r["sledge_hand_work"]
        ) + (r["cogging_work"] + r["offset_work"])
        lost = (
            r["friction_work"] + r["sledge_friction_work"] + r["damping_work"] + r["fracture"]
        ) + r["arrest"]
        return np.asarray(r["kinetic"] + r["stored"] + lost - given)


def run(rig: Rig, timeline: Timeline, rng: np.random.Generator) -> Books:
    """Simulate a timeline from rest at its first pose. RuntimeError where it cannot go on.

    Randomness is used for the sheets' toughness alone; noise belongs to the sensors.
    """
    sheets = int(timeline.sheet.max()) + 1
    toughness = toughness_of(rig.material, max(sheets, 1), rng)
    integral = np.zeros_like(toughness)
    integral[:, 1:] = np.cumsum(0.5 * GRID_M * (toughness[:, 1:] + toughness[:, :-1]), axis=1)
    rows = np.zeros(len(timeline), ROW)
    jumps = np.zeros(JUMP_ROOM, JUMP)
    count = ctypes.c_int64()
    kept = [
        np.ascontiguousarray(values, np.float64)
        for values in (
            timeline.opening,
            timeline.rate,
            timeline.advance,
            timeline.advance_rate,
            timeline.tremor,
            toughness,
            integral,
        )
    ]
    whole = [np.ascontiguousarray(v, np.int32) for v in (timeline.mode, timeline.sheet)]
    doubles = [values.ctypes.data_as(ctypes.POINTER(ctypes.c_double)) for values in kept]
    ints = [values.ctypes.data_as(ctypes.POINTER(ctypes.c_int32)) for values in whole]
    inputs = Inputs(
        *doubles[:5],
        *ints,
        *doubles[5:],
        len(timeline),
        toughness.shape[1],
        float(timeline.opening[0]),
        float(timeline.advance[0]),
    )
    numbers = (ctypes.c_double * len(PARAMETERS))(*core_parameters(rig))
    failure = library().rig_run(
        ctypes.byref(numbers),
        ctypes.byref(inputs),
        ctypes.c_void_p(rows.ctypes.data),
        ctypes.c_void_p(jumps.ctypes.data),
        ctypes.c_int64(JUMP_ROOM),
        ctypes.byref(count),
    )
    if failure:
        raise RuntimeError(FAILURES[failure])
    time = np.asarray(np.arange(len(timeline)) * rig.tick_s + np.cumsum(timeline.gap_s))
    jumps = jumps[: count.value].copy()
    jumps["time"] += np.cumsum(timeline.gap_s)[(jumps["time"] / rig.tick_s).astype(int)]
    return Books(
        rows,
        jumps,
        toughness,
        GRID_M,
        time,
        timeline.stroke,
        timeline.sheet,
    )


def toughness_of(material: Material, sheets: int, rng: np.random.Generator) -> Array:
    """Draw J(X) of some sheets on a grid of GRID_M, (sheets, grid), in N."""
    size = int(np.ceil(material.sheet_length_m / GRID_M)) + 2
    mean = material.fracture_energy_N or 0.0
    own = mean * (1.0 + material.sheet_sd * rng.standard_normal(sheets))
    field = np.zeros((sheets, size))
    if material.variation > 0.0:
        field = _unit_field(material, sheets, size, rng)
    drawn = own[:, None] * (1.0 + material.variation * field)
    return np.maximum(drawn, 0.05 * mean)


def _unit_field(material: Material, sheets: int, size: int, rng: np.random.Generator) -> Array:
    """Random fields of unit variance: Ornstein-Uhlenbeck, or with a Gaussian correlation."""
    cells = material.correlation_m / GRID_M
    if material.correlation == "ou":
        from scipy.signal import lfilter

        keep = float(np.exp(-1.0 / cells))
        drawn = rng.standard_normal((sheets, size))
        drawn[:, 1:] *= np.sqrt(1.0 - keep * keep)
        return np.asarray(lfilter([1.0], [1.0, -keep], drawn, axis=1))
    from scipy.signal import fftconvolve

    reach = int(np.ceil(4.0 * cells))
    at = np.arange(-reach, reach + 1) / cells
    weights = np.exp(-(at**2))  # so that the correlation is exp(-(distance / length)^2 / 2)
    weights /= np.sqrt(np.sum(weights**2))
    drawn = rng.standard_normal((sheets, size + 2 * reach))
    return np.asarray(fftconvolve(drawn, weights[None, :], mode="valid", axes=1))


def core_parameters(rig: Rig) -> list[float]:
    """List the rig's numbers in the order of library.PARAMETERS."""
    mechanism, motor, sensors, servo = rig.mechanism, rig.motor, rig.sensors, rig.servo
    friction, blades, sheet, hand = mechanism.friction, rig.blades, rig.material, rig.hand
    cuts = sheet.fracture_energy_N is not None
    tick = rig.tick_s
    numbers: dict[str, float] = {
        "tick_s": tick,
        "step_s": rig.step_s,
        "inertia": mechanism.inertia_kg_m2,
        "coulomb_pos": friction.coulomb_opening_Nm,
        "coulomb_neg": friction.coulomb_closing_Nm,
        "viscous_pos": friction.viscous_opening_Nm_s_per_rad,
        "viscous_neg": friction.viscous_closing_Nm_s_per_rad,
        "stribeck": friction.stribeck_Nm,
        "stribeck_rate": friction.stribeck_rate_rad_per_s,
        "angle_slope": friction.angle_slope_per_rad,
        "angle_curvature": friction.angle_curvature_per_rad2,
        "angle_center": friction.angle_center_rad,
        "presliding": friction.presliding_rad,
        "presliding_shape": friction.presliding_shape,
        "load_share": friction.load_share,
        "offset": mechanism.torque_offset_Nm,
        "cogging": motor.cogging_Nm,
        "cogging_periods": motor.cogging_periods_per_turn,
        "cogging_phase": motor.cogging_phase_rad,
        "mass": mechanism.sledge_mass_kg,
        "sledge_coulomb": mechanism.sledge_coulomb_N,
        "sledge_viscous": mechanism.sledge_viscous_N_s_per_m,
        "sledge_presliding": mechanism.sledge_presliding_m,
        "delay_ticks": motor.delay_ticks,
        "lag_s": motor.lag_ticks * tick,
        "torque_limit": motor.torque_limit_Nm,
        "force_limit": motor.force_limit_N,
        "brake": motor.brake_Nm_s_per_rad,
        "opening_step": 2.0 * np.pi / sensors.counts_per_turn,
        "advance_step": sensors.sledge_step_m,
        "rate_gain": servo.rate_gain,
        "position_gain": servo.position_gain,
        "integral_gain": servo.integral_gain,
        "observer_hz": servo.observer_hz,
        "feed_inertia": servo.feed_inertia_kg_m2,
        "feed_coulomb": servo.feed_coulomb_Nm,
        "feed_viscous": servo.feed_viscous_Nm_s_per_rad,
        "sledge_kp": servo.sledge_kp,
        "sledge_kd": servo.sledge_kd,
        "sledge_ki": servo.sledge_ki,
        "sledge_observer_hz": servo.sledge_observer_hz,
        "moving": rig.moving_blades,
        "edge_offset": blades.offset_m,
        "edge_slope": float(np.tan(blades.taper_rad)),
        "edge_curvature": blades.curvature_per_m,
        "edge_cubic": blades.cubic_per_m2,
        "edge_length": blades.length_m,
        "tip_radius": blades.tip_radius_m,
        "upper_face": rig.upper_face_m,
        "law": LAWS[sheet.law],
        "force": sheet.force_N,
        "reference": sheet.reference_m,
        "exponent": sheet.exponent,
        "knee": sheet.knee_m,
        "knee_ratio": sheet.knee_ratio,
        "damping": sheet.damping_s_per_m,
        "fracture": float(cuts),
        "kappa": sheet.kappa,
        "sheet_length": sheet.sheet_length_m,
        "grid_step": GRID_M,
        "radius": mechanism.handle_radius_m,
        "hand_stiffness": hand.stiffness_Nm_per_rad,
        "hand_damping": hand.damping_Nm_s_per_rad,
        "hand_strength": hand.strength_N,
        "hand_push": hand.push_N_per_m,
        "hand_drag": hand.push_N_s_per_m,
        "hand_reach": hand.push_limit_N,
    }
    if tuple(numbers) != PARAMETERS:
        raise RuntimeError("simulate.py and library.py list the core's parameters differently.")
    return list(numbers.values())
