"""The servo's configuration of CONTROL: gains at every place of the path, limits, refusals."""

import math
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from scissorcal.control.contact_loop import ContactGains, ContactLoop, contact_decays
from scissorcal.control.gains import HybridGains, choose_gains, friction_rates
from scissorcal.control.mechanics import (
    FASTEST_m_per_s,
    FASTEST_rad_per_s,
    RigMechanics,
    axis_friction,
    contact_loop,
)
from scissorcal.control.surface_path import Foot, TimedPath
from scissorcal.device.motion import Motion
from scissorcal.device.session import Confirm, RigSession, is_simulator, refuse_nobody
from scissorcal.errors import InputError
from scissorcal.kernel import ConfigKey, ControlConfig, HybridConfig, Identity
from scissorcal.recipe.schema import Limits

FORCE_CUTOFF_HZ = 30.0
MOST_KI_PER_S = 40.0
"""Blades with dry friction stick and slide to and fro under a faster integral: on the virtual rig
the rms error of the force doubles from 50/s to 120/s, and is flat between 12 and 50."""
FASTEST_APPROACH_M_PER_S = 0.01
FORCE_SLEW_N_PER_S = 10.0
TOUCH_N, LEAVE_N = 0.3, 0.15
"""Chosen: three and one and a half times by how much a force at rest may be wrong."""
APPROACH_MARGIN_N = 0.3
LEAST_LEVER_M = 0.01
"""Below, a milli-newton metre of friction that is not known is a tenth of a newton."""
SHARE_OF_LIMIT = 0.8
"""Of the motors' limits that force and friction may need; the rest is for motion."""
LIFT_M = 3e-3
AWAY_M = 2e-3
OPENING_MARGIN_RAD = math.radians(1.0)
ADVANCE_MARGIN_M = 2e-3
COUNTS = 4
"""Encoder steps over which friction turns round after a reversal, at least."""
FORCE_STOP_FACTOR, FORCE_STOP_N = 2.0, 2.0


class Material(NamedTuple):
    """What the tip presses on: its stiffness (N/m), its friction against the tip, and the most that
    a touch may peak at (N)."""

    stiffness_N_per_m: float
    friction: float
    peak_N: float


class Settings(NamedTuple):
    """What a run of CONTROL is configured with, and the least and largest mass (kg) on its path."""

    config: ControlConfig
    gains: HybridGains
    masses_kg: tuple[float, float]


def control_settings(
    rig: RigMechanics,
    identity: Identity,
    limits: Limits,
    material: Material,
    path: TimedPath,
    rate_cutoff_Hz: float,
) -> Settings:
    """Configure CONTROL for a path; InputError, before anything moves, where it cannot be done.

    Refused are places that the blades or the carriage do not reach, where a force has no lever on
    the opening, forces beyond what the motors may give, and stiffness at which no gain is stable.
    """
    contour = path.contour
    torque_limit = min(limits.torque_Nm, identity.torque_limit)
    force_limit = min(limits.force_N, identity.force_limit)
    largest = float(path.force.max())
    low, high = float(path.place.min()), float(path.place.max())
    on_path = [
        (foot, x)
        for foot, place, x in zip(contour.feet, contour.place, contour.x, strict=True)
        if low - 1e-9 <= place <= high + 1e-9
    ]
    openings = [_reached(rig, identity, foot, x) for foot, x in on_path]
    for (foot, x), opening in zip(on_path, openings, strict=True):
        _refuse_lever(rig, foot, x, opening)
        most = _largest_force(rig, foot, opening, (torque_limit, force_limit), material.friction)
        if largest > most:
            raise InputError(
                f"{largest:.3g} N is more than the motors may press with at x = {1e3 * x:.1f} mm: "
                f"{max(most, 0.0):.2g} N is the most there, at {100 * SHARE_OF_LIMIT:.0f} % of "
                f"{torque_limit:g} N m and {force_limit:g} N (recipe's limits and device's). Ask "
                "for less force."
            )
    least = float(path.force.min())
    if least < TOUCH_N:
        raise InputError(
            f"{least:.3g} N is less than {TOUCH_N:g} N, at which a touch is told from the friction "
            "of the blades. Ask for more force throughout the path."
        )
    feet = [foot for foot, _ in on_path]
    masses = [rig.mass_at(*at) for at in zip(feet, openings, strict=True)]
    levers = [float(rig.press_at(*at)[0]) for at in zip(feet, openings, strict=True)]
    ends = sorted({int(np.argmin(masses)), int(np.argmax(masses))})
    loops = [
        contact_loop(
            rig,
            identity,
            material.stiffness_N_per_m,
            masses[i],
            levers[i],
            (rate_cutoff_Hz, FORCE_CUTOFF_HZ),
        )
        for i in ends
    ]
    gains = _slower_integral(choose_gains(loops, material.peak_N), loops)
    config = _config(rig, identity, material, gains, largest, (torque_limit, force_limit))
    return Settings(config, gains, (min(masses), max(masses)))


def _slower_integral(gains: HybridGains, loops: list[ContactLoop]) -> HybridGains:
    """The same gains with an integral that does not drive blades to and fro through friction."""
    slower = replace(gains, force_ki=min(gains.force_ki, MOST_KI_PER_S))
    contact = [ContactGains(slower.contact_kd, slower.force_ki, slower.force_kp)]
    decay = min(float(contact_decays(loop, contact)[0]) for loop in loops)
    return replace(slower, decay_per_s=decay)


def _config(
    rig: RigMechanics,
    identity: Identity,
    material: Material,
    gains: HybridGains,
    largest: float,
    efforts: tuple[float, float],
) -> ControlConfig:
    opening = axis_friction(rig.opening.friction, FASTEST_rad_per_s)
    advance = axis_friction(rig.advance.friction, FASTEST_m_per_s)
    lever = rig.tip.station_m / rig.tip.moving_blades
    held = opening.largest / lever
    noise = math.hypot(rig.friction_sd, 0.3 * rig.torque_sd)
    approach_speed = min(gains.approach_speed, FASTEST_APPROACH_M_PER_S)
    law = HybridConfig(
        axes=2,
        **replace(gains, approach_speed=approach_speed).settings(),
        force_most=1.05 * largest,
        force_slew=FORCE_SLEW_N_PER_S,
        integral_most=2.0 * held + 1.0,
        touch_force=TOUCH_N,
        leave_force=LEAVE_N,
        approach_force=TOUCH_N + APPROACH_MARGIN_N + 0.5 * held,
        friction_rate=friction_rates(
            gains,
            (rig.opening.inertia, rig.advance.inertia),
            (opening.largest, advance.largest),
        ),
        effort_limit=efforts,
    )
    return ControlConfig(
        law=law,
        station=rig.tip.station_m,
        edge_offset=rig.tip.offset_m,
        moving_blades=rig.tip.moving_blades,
        inertia=rig.opening.inertia,
        mass=rig.advance.inertia,
        offset=rig.opening.offset,
        torque_zero=rig.torque_zero_Nm,
        opening=opening,
        advance=advance,
        tick_s=identity.tick_us * 1e-6,
        presliding=_presliding(rig, identity),
        surface_friction=material.friction,
        stiffness=material.stiffness_N_per_m,
        force_cutoff_Hz=FORCE_CUTOFF_HZ,
        force_band=max(0.02, 2.0 * noise / lever),
        torque_sd=noise,
        least_lever=0.5 * LEAST_LEVER_M,
        lift_gap=LIFT_M,
        away=AWAY_M,
        force_stop=FORCE_STOP_FACTOR * largest + FORCE_STOP_N,
        handle_zero=rig.handle_zero_N,
    )


def _presliding(rig: RigMechanics, identity: Identity) -> float:
    length = float(np.asarray(rig.opening.friction["presliding_length"]))
    return max(COUNTS * identity.opening_resolution, length)


def _reached(rig: RigMechanics, identity: Identity, foot: Foot, x: float) -> float:
    """Opening at a foot; InputError where tip or carriage do not come there, above it and below."""
    openings = []
    lifted, lower = LIFT_M + AWAY_M, -AWAY_M
    for doing, beyond in (
        ("touching it", 0.0),
        (f"lifting the tip by {1e3 * lifted:.0f} mm", lifted),
        (f"finding it {-1e3 * lower:.0f} mm lower", lower),
    ):
        opening = rig.opening_at(foot.point[1] + beyond)
        low = identity.opening_min + OPENING_MARGIN_RAD
        high = identity.opening_max - OPENING_MARGIN_RAD
        if opening is None or not low <= opening <= high:
            takes = "longer blades"
            if opening is not None:
                takes = (
                    f"{math.degrees(opening):.1f} degrees of the blades, which turn from "
                    f"{math.degrees(low):.1f} to {math.degrees(high):.1f}"
                )
            raise InputError(
                f"At x = {1e3 * x:.1f} mm the surface is {1e3 * foot.point[1]:.1f} mm above the "
                f"pivot, and {doing} takes {takes}. Move the plate, or shorten the path."
            )
        openings.append(opening)
    advance = rig.advance_at(foot.point[0], openings[0])
    low, high = identity.advance_min + ADVANCE_MARGIN_M, identity.advance_max - ADVANCE_MARGIN_M
    if not low <= advance <= high:
        raise InputError(
            f"At x = {1e3 * x:.1f} mm the carriage would stand at {1e3 * advance:.1f} mm: it moves "
            f"from {1e3 * low:.1f} to {1e3 * high:.1f} mm. Move the plate, or shorten the path."
        )
    return openings[0]


def _refuse_lever(rig: RigMechanics, foot: Foot, x: float, opening: float) -> None:
    lever = rig.press_at(foot, opening)[0]
    if not lever >= LEAST_LEVER_M:
        raise InputError(
            f"At x = {1e3 * x:.1f} mm the surface is so steep that a force on it turns the blades "
            f"by a lever of {1e3 * lever:.1f} mm only ({1e3 * LEAST_LEVER_M:g} mm are needed): its "
            "size could not be known. Choose a flatter part."
        )


def _largest_force(
    rig: RigMechanics, foot: Foot, opening: float, efforts: tuple[float, float], friction: float
) -> float:
    """Force (N) that the motors may hold at a foot while the tip slides."""
    slides = np.abs(rig.slide_at(foot, opening))
    press = np.abs(rig.press_at(foot, opening)) + friction * slides
    found = []
    for axis, by, limit, fastest in zip(
        (rig.opening, rig.advance),
        press,
        efforts,
        (FASTEST_rad_per_s, FASTEST_m_per_s),
        strict=True,
    ):
        dry = axis_friction(axis.friction, fastest).largest + abs(axis.offset)
        found.append((SHARE_OF_LIMIT * limit - dry) / by if by > 0.0 else math.inf)
    return min(found)


PLATE = 2.0
"""MATERIAL that puts a virtual rig's plate in."""
MUST_ASK = "A person must be asked to put the plate in its place"
REQUEST_FIRST = (
    "Put the plate in its place, below the blades, and keep hands off the handles and away from "
    "the blades: once the plate's pose is known, they open, move over the plate and press on it."
)
REQUEST = (
    "Put the plate in its place, and keep hands off the handles and away from the blades: they "
    "open, move over the plate and press on it."
)


def ask_for_plate(session: RigSession) -> None:
    """Have a person put the plate in before a camera looks for it; a simulator does so by itself.

    Nothing moves meanwhile. InputError where nobody can be asked.
    """
    refuse_nobody(session.identity, session.operator.confirm, MUST_ASK)
    if not session.simulated:
        assert session.operator.confirm is not None
        session.operator.confirm(REQUEST_FIRST)


def put_plate(motion: Motion, confirm: Confirm | None) -> None:
    """Have the plate put in while a motion waits with its motors off."""
    if is_simulator(motion.identity):
        motion.configure(ConfigKey.MATERIAL, PLATE)
        return
    assert confirm is not None
    with motion.paused():
        confirm(REQUEST)
