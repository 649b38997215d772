"""The rig's parameters under the names of the fits, and laws in closed form. For judging only."""

import numpy as np
from numpy.typing import ArrayLike

from scissorcal.aliases import Array

from .parameters import Rig


def true_parameters(
    rig: Rig,
    *,
    reference_indentation_m: float | None = None,
    angle_center: float | None = None,
    symmetric: bool = False,
) -> dict[str, float]:
    """Give the truth under the names that fits use, expanded where they expand it, in SI.

    Friction's levels hold at ``angle_center`` (rad); ``response_force`` is the force at the
    reference indentation, and for two slopes ``response_exponent`` is d ln g / d ln delta there.
    ``fracture_energy`` is the J_c h of the material that starts the crack; each sheet's own mean
    is in the books. ``symmetric`` gives means of both directions. A law without an offset of its
    own has coulomb_pos + offset and coulomb_neg - offset for its levels.
    """
    friction, mechanism, sheet = rig.mechanism.friction, rig.mechanism, rig.material
    center = friction.angle_center_rad if angle_center is None else angle_center
    away = center - friction.angle_center_rad
    slope, bend = friction.angle_slope_per_rad, friction.angle_curvature_per_rad2
    factor = 1.0 + slope * away + bend * away**2
    levels = {
        "coulomb_pos": friction.coulomb_opening_Nm * factor,
        "coulomb_neg": friction.coulomb_closing_Nm * factor,
        "viscous_pos": friction.viscous_opening_Nm_s_per_rad * factor,
        "viscous_neg": friction.viscous_closing_Nm_s_per_rad * factor,
    }
    if symmetric:
        levels = {
            name: 0.5 * (levels[f"{name}_pos"] + levels[f"{name}_neg"])
            for name in ("coulomb", "viscous")
        }
    reference = reference_indentation_m or sheet.reference_m
    force, stiffness = (float(value) for value in response(rig, reference))
    exponent = {
        "power": sheet.exponent,
        "exponential": sheet.exponent * reference / sheet.reference_m,
        "two_slopes": stiffness * reference / force,
    }[sheet.law]
    truth = {
        "inertia": mechanism.inertia_kg_m2,
        "delay": held_torque_delay_s(rig),
        "offset": mechanism.torque_offset_Nm,
        **levels,
        "stribeck": friction.stribeck_Nm * factor,
        "stribeck_rate": friction.stribeck_rate_rad_per_s,
        "angle_slope": (slope + 2.0 * bend * away) / factor,
        "angle_curvature": bend / factor,
        "load_share": friction.load_share,
        "presliding_length": friction.presliding_rad,
        "presliding_share": 1.0,
        "response_force": force,
        "response_exponent": exponent,
    }
    if sheet.fracture_energy_N is not None:
        truth["fracture_energy"] = sheet.fracture_energy_N
        truth["kappa"] = sheet.kappa
    return truth


def held_torque_delay_s(rig: Rig) -> float:
    """How late the measured torque is against a straight line from sample to sample, in s.

    The mean torque between samples i and i + 1 is tau_i + (1/2 + delay / tick) (tau_{i+1} - tau_i):
    torque is held from tick to tick, and read just before the next command arrives. With part of a
    tick's delay and a lag it is the regression over commands that wander.
    """
    share, lag = rig.motor.delay_ticks % 1.0, rig.motor.lag_ticks
    commands = np.cumsum(np.random.default_rng(1).standard_normal(20_000))
    ends, means = np.zeros(len(commands)), np.zeros(len(commands))
    now = before = 0.0
    for tick, command in enumerate(commands):
        total = 0.0
        for target, span in ((before, share), (command, 1.0 - share)):
            keep = np.exp(-span / lag) if lag else 0.0
            total += target * span + (now - target) * lag * (1.0 - keep)
            now = target + (now - target) * (keep if span else 1.0)
        before = command
        ends[tick], means[tick] = now, total
    change, more = np.diff(ends), means[1:] - ends[:-1]
    return float((change @ more / (change @ change) - 0.5) * rig.tick_s)


def response(rig: Rig, indentation: ArrayLike) -> tuple[Array, Array]:
    """Force of one edge (N) and its slope (N/m) at indentations above zero."""
    sheet = rig.material
    delta = np.asarray(indentation, dtype=np.float64)
    ratio, n = delta / sheet.reference_m, sheet.exponent
    if sheet.law == "power":
        force = np.asarray(sheet.force_N * ratio**n)
        return force, np.asarray(n * force / delta)
    if sheet.law == "exponential":
        scale = sheet.force_N / np.expm1(n)
        grown = np.asarray(scale * np.expm1(n * ratio))
        return grown, np.asarray(n / sheet.reference_m * (grown + scale))
    more = sheet.knee_ratio - 1.0
    stiffness = sheet.force_N / (
        sheet.reference_m + more * max(sheet.reference_m - sheet.knee_m, 0.0)
    )
    beyond = np.maximum(delta - sheet.knee_m, 0.0)
    force = np.asarray(stiffness * (delta + more * beyond))
    return force, np.asarray(stiffness * (1.0 + more * (beyond > 0.0)))
