"""Models that the kernel's tests share, made straight from formulas and not from a package."""

import math
from typing import Any

import numpy as np

from scissorcal.kernel import (
    AxisFriction,
    Contour,
    ControlConfig,
    HybridConfig,
    ModelTables,
    Table,
)
from scissorcal.kernel.control import FRICTION_POINTS

EDGE_OFFSET = -0.008
EDGE_TAPER = math.tan(math.radians(2.0))
BLADE_LENGTH = 0.075
REFERENCE = 3e-4
LAW = HybridConfig(
    axes=2, contact_kd=60.0, force_ki=12.0, normal_kp=2500.0, normal_kd=100.0, path_kp=2500.0,
    path_kd=100.0, force_most=5.0, approach_force=1.5, touch_force=0.3, leave_force=0.15,
    friction_rate=(1.0, 0.02), effort_limit=(0.5, 20.0),
)  # fmt: skip
FLAT = AxisFriction(
    fastest=2.0, positive=(0.015,) * FRICTION_POINTS, negative=(0.015,) * FRICTION_POINTS
)
CONTROL = ControlConfig(
    law=LAW, station=0.075, edge_offset=-0.0054, moving_blades=2, inertia=2e-4, mass=0.8,
    offset=0.0, opening=FLAT, advance=FLAT, tick_s=1e-3, presliding=2e-4, stiffness=1e4,
)  # fmt: skip
CONTOUR = Contour(point=(0.07, 0.008), normal=(0.0, 1.0), curvature=0.0, place=0.0)


def straight(y0: float, y1: float, x0: float = 0.0, x1: float = 1.0) -> Table:
    """A straight line as a table of two knots."""
    slope = (y1 - y0) / (x1 - x0)
    return Table([x0, x1], [y0, y1], [slope, slope])


def line_edge(offset: float = EDGE_OFFSET, slope: float = EDGE_TAPER) -> Table:
    return straight(offset, offset + BLADE_LENGTH * slope, 0.0, BLADE_LENGTH)


def arc_edge(curvature: float, offset: float = EDGE_OFFSET, slope: float = EDGE_TAPER) -> Table:
    """A parabola: exact in a cubic table."""
    s = np.linspace(0.0, BLADE_LENGTH, 9)
    return Table(s, offset + slope * s + 0.5 * curvature * s**2, slope + curvature * s)


def power_response(
    force: float = 2.0, exponent: float = 1.5, last: float = 2e-3, knots: int = 200
) -> Table:
    """g = force (delta / 0.3 mm)^exponent up to ``last``, knots denser towards 0."""
    x = np.linspace(0.0, 1.0, knots) ** 2 * last
    y = force * (x / REFERENCE) ** exponent
    with np.errstate(divide="ignore"):
        slope = force * exponent / REFERENCE * (x / REFERENCE) ** (exponent - 1.0)
    chord = np.diff(y) / np.diff(x)
    steepest = 3.0 * np.minimum(np.append(chord[0], chord), np.append(chord, chord[-1]))
    return Table(x, y, np.minimum(slope, steepest))


def make_tables(**changes: Any) -> ModelTables:
    """Paper between scissors of which both blades move; ``changes`` replace single fields."""
    fields: dict[str, Any] = {
        "edge": line_edge(),
        "response": power_response(),
        "friction_opening": straight(0.010, 0.014),
        "friction_closing": straight(0.012, 0.018),
        "friction_angle": straight(0.9, 1.1),
        "moving_blades": 2,
        "upper_face": 5e-5,
        "fracture_energy": 0.6,
        "kappa": 1.0,
        "closure": "work",
        "rate_damping": 0.0,
        "render_friction": False,
        "friction_rate_eps": 0.01,
        "handle_radius": 0.06,
        "opening_min": 0.2,
        "opening_max": 0.9,
        "contact_min": 0.015,
        "contact_max": 0.06,
    }
    return ModelTables(**(fields | changes))
