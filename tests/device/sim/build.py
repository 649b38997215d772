"""Specimens for tests: one plain base, and the changes that a test is about."""

import math
from typing import Any

from scissorcal.device.sim.specimen import Specimen

BASE: dict[str, Any] = {
    "format": "scissorcal-specimen/1",
    "name": "test",
    "blade": {"offset_mm": -8.0, "taper_deg": 2.0, "length_mm": 75.0},
    "mechanism": {
        "inertia_kg_m2": 2e-4,
        "friction": {
            "coulomb_opening_Nm": 0.013,
            "coulomb_closing_Nm": 0.015,
            "viscous_opening_Nm_s_per_rad": 0.002,
            "viscous_closing_Nm_s_per_rad": 0.0022,
            "stribeck_Nm": 0.004,
            "stribeck_rate_rad_per_s": 0.07,
            "angle_slope_per_rad": 0.2,
            "angle_curvature_per_rad2": 0.1,
        },
        "advance": {},
    },
    "motor": {},
    "sensors": {},
    "material": {
        "name": "test sheet",
        "thickness_mm": 0.1,
        "sheet_length_mm": 180.0,
        "response": "power",
        "response_force_N": 2.0,
        "response_exponent": 1.6,
        "toughness_J_per_m2": 5000.0,
        "kappa": 0.75,
    },
    "hand": {},
}

NO_FRICTION = {
    "coulomb_opening_Nm": 0.0,
    "coulomb_closing_Nm": 0.0,
    "viscous_opening_Nm_s_per_rad": 0.0,
    "viscous_closing_Nm_s_per_rad": 0.0,
    "stribeck_Nm": 0.0,
}

QUIET = {
    "torque_white_Nm": 0.0,
    "torque_slow_Nm": 0.0,
    "force_white_N": 0.0,
    "force_slow_N": 0.0,
}


WAVY: dict[str, Any] = {
    "wave_mm": [(5.0 * k, 0.4 * math.sin(2 * math.pi * 5.0 * k / 40.0)) for k in range(16)]
}
"""A blade of a line with a wave of 0.4 mm, 40 mm long."""


def specimen(**changes: Any) -> Specimen:
    """The base specimen with tables updated: ``specimen(material={"kappa": 1.0})``."""
    return Specimen.model_validate(_merged(BASE, changes))


def _merged(base: dict[str, Any], changes: dict[str, Any]) -> dict[str, Any]:
    merged = dict(base)
    for key, value in changes.items():
        nested = isinstance(value, dict) and isinstance(base.get(key), dict)
        merged[key] = _merged(base[key], value) if nested else value
    return merged
