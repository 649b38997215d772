"""The truth of a specimen, for judging fits and renders: never for making them.

Parameters under the names that fits use, and the average torque in closed form up to a quadrature.
"""

import math

import numpy as np
from numpy.typing import ArrayLike

from scissorcal.aliases import Array
from scissorcal.device.sim.blade import BladeOnSheet, blade_on
from scissorcal.device.sim.friction import DryFriction
from scissorcal.device.sim.specimen import Specimen

GAUSS = tuple(zip(*(column.tolist() for column in np.polynomial.legendre.leggauss(5)), strict=True))


def true_parameters(
    specimen: Specimen,
    *,
    angle_center: float | None = None,
    reference_indentation_m: float | None = None,
    symmetric: bool = False,
) -> dict[str, float]:
    """The specimen's parameters under the names of the fits, in SI.

    ``angle_center`` (rad) and ``reference_indentation_m`` are where the fit expands its laws; the
    truth is re-expanded there exactly. ``symmetric`` gives ``coulomb`` and ``viscous`` (the means
    of both directions) instead of the four of the asymmetric law. ``fracture_energy`` is what
    starts the crack, J_c h; it and ``kappa`` are left out where nothing is cut.

    >>> from scissorcal.device.sim.specimen import load_specimen
    >>> round(true_parameters(load_specimen("office-paper"))["fracture_energy"], 6)
    0.52
    """
    mechanism = specimen.mechanism
    friction = DryFriction.of_joint(mechanism.friction)
    center = friction.center if angle_center is None else angle_center
    away = center - friction.center
    factor = friction.factor(center)
    levels = {
        "coulomb_pos": friction.coulomb_pos * factor,
        "coulomb_neg": friction.coulomb_neg * factor,
        "viscous_pos": friction.viscous_pos * factor,
        "viscous_neg": friction.viscous_neg * factor,
    }
    if symmetric:
        levels = {
            name: 0.5 * (levels[f"{name}_pos"] + levels[f"{name}_neg"])
            for name in ("coulomb", "viscous")
        }
    truth = {
        "inertia": mechanism.inertia_kg_m2,
        "offset": mechanism.torque_offset_Nm,
        **levels,
        "stribeck": friction.stribeck * factor,
        "stribeck_rate": 1.0 / friction.inverse_rate,
        "angle_slope": (friction.slope + 2.0 * friction.curvature * away) / factor,
        "angle_curvature": friction.curvature / factor,
    }
    material = specimen.material
    reference = reference_indentation_m or material.reference_m
    truth["response_force"] = blade_on(specimen).response.force(reference)
    truth["response_exponent"] = material.response_exponent
    if material.response == "exponential":
        truth["response_exponent"] *= reference / material.reference_m
    if material.fracture_energy is not None:
        truth["fracture_energy"] = material.fracture_energy
        truth["kappa"] = material.kappa
    return truth


def average_torque(
    specimen: Specimen,
    opening: ArrayLike,
    rate: ArrayLike,
    contact: ArrayLike,
    friction: bool = True,
) -> Array:
    """Average torque that a hand feels, in N m; positive opens the blades. Inputs broadcast.

    The cut's part is that of a slow closing stroke on mean toughness with the crack tip at
    ``contact`` (m); where the blades press harder than the sheet sustains, the tip settles further
    out first. With a ripple it is the mean over all places that the tip takes between a start
    and a stop of the crack. With ``friction`` the friction at ``opening`` (rad) and ``rate``
    (rad/s) is added, which resists the motion.
    """
    blade = blade_on(specimen)
    joint = DryFriction.of_joint(specimen.mechanism.friction)
    energy, kappa = specimen.material.fracture_energy, specimen.material.kappa

    def one(theta: float, omega: float, x: float) -> float:
        torque = blade.touch(theta, x).torque
        if energy is not None:
            starts, settled = settled_torque(blade, theta, energy, kappa)
            torque = settled if x < starts else min(torque, settled)
        return torque - joint.sliding(theta, omega) if friction else torque

    return np.asarray(np.vectorize(one, otypes=[np.float64])(opening, rate, contact))


def settled_torque(
    blade: BladeOnSheet, opening: float, energy: float, kappa: float
) -> tuple[float, float]:
    """Innermost contact that the crack tip takes in a slow cut at ``opening``, and the mean torque.

    A tip that starts at ``energy`` and stops at ``kappa * energy`` (N) takes all places between
    equally often; the mean over them is a five-point Gauss-Legendre quadrature. Where no crack
    can advance (the edges do not close on it) the tip may be anywhere: (-inf, inf).
    """
    starts = tip_at_drive(blade, opening, energy)
    stops = starts if kappa == 1.0 else tip_at_drive(blade, opening, kappa * energy)
    if not (math.isfinite(starts) and math.isfinite(stops)):
        return -math.inf, math.inf
    middle, half = 0.5 * (starts + stops), 0.5 * (stops - starts)
    total = 0.0
    for node, weight in GAUSS:
        total += 0.5 * weight * blade.touch(opening, middle + half * node).torque
    return starts, total


def tip_at_drive(blade: BladeOnSheet, opening: float, drive: float) -> float:
    """Contact at which the crack is driven by ``drive`` (N); -inf where it never is.

    Bisection between where the edge just touches and further in, to the last bit.
    """
    outer = blade.crossing(opening)
    if not math.isfinite(outer):
        return -math.inf
    outer = min(outer, blade.length + blade.fade)
    inner, width = outer, 1e-5
    while blade.touch(opening, inner).drive < drive:
        outer, inner = inner, inner - width
        width *= 2.0
        if width > 10.0:
            return -math.inf
    for _ in range(100):
        middle = 0.5 * (inner + outer)
        if not inner < middle < outer:
            break
        if blade.touch(opening, middle).drive >= drive:
            inner = middle
        else:
            outer = middle
    return 0.5 * (inner + outer)


def varied(specimen: Specimen, rng: np.random.Generator, spread: float = 0.15) -> Specimen:
    """A specimen of the same kind whose parameters differ by about ``spread`` (log-normal).

    For statements over many truths: mechanism, friction and material change, the blade and the
    ranges stay. ``kappa`` stays below 1, a smooth specimen stays smooth.
    """

    def scaled(value: float) -> float:
        return value * math.exp(spread * float(rng.standard_normal()))

    law = specimen.mechanism.friction
    friction = law.model_copy(
        update={
            name: scaled(getattr(law, name))
            for name in (
                "coulomb_opening_Nm",
                "coulomb_closing_Nm",
                "viscous_opening_Nm_s_per_rad",
                "viscous_closing_Nm_s_per_rad",
                "stribeck_Nm",
                "stribeck_rate_rad_per_s",
                "angle_slope_per_rad",
                "angle_curvature_per_rad2",
            )
        }
    )
    mechanism = specimen.mechanism.model_copy(
        update={
            "inertia_kg_m2": scaled(specimen.mechanism.inertia_kg_m2),
            "torque_offset_Nm": scaled(specimen.mechanism.torque_offset_Nm),
            "friction": friction,
        }
    )
    material = specimen.material
    changes: dict[str, float] = {
        "response_force_N": scaled(material.response_force_N),
        "response_exponent": scaled(material.response_exponent),
    }
    if material.toughness_J_per_m2 is not None:
        changes["toughness_J_per_m2"] = scaled(material.toughness_J_per_m2)
    if material.kappa < 1.0:
        changes["kappa"] = min(0.95, max(0.4, scaled(material.kappa)))
    update = {"mechanism": mechanism, "material": material.model_copy(update=changes)}
    return Specimen.model_validate(specimen.model_copy(update=update).model_dump())
