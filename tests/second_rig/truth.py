"""The rig's parameters under the names of the fits, and laws in closed form. For judging only."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .parameters import Rig

Array = NDArray[np.float64]


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
    is in the books. ``symmetric`` gives means of both directions.
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
        "offset": mechanism.torque_offset_Nm,
        **levels,
        "stribeck": friction.stribeck_Nm * factor,
        "stribeck_rate": friction.stribeck_rate_rad_per_s,
        "angle_slope": (slope + 2.0 * bend * away) / factor,
        "angle_curvature": bend / factor,
        "load_share": friction.load_share,
        "presliding_length": friction.presliding_rad,
        "response_force": force,
        "response_exponent": exponent,
    }
    if sheet.fracture_energy_N is not None:
        truth["fracture_energy"] = sheet.fracture_energy_N
        truth["kappa"] = sheet.kappa
    return truth


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
