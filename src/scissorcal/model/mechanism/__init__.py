"""Dynamics of the rig's two axes, or of any chain: free, constrained and in compliant contact.

    D(q) qdd + n(q, qd) = tau + J^T lambda

q are the axes, tau what drives them, J the gradient of a gap that is positive outside the material,
and lambda >= 0 the force with which the material presses. (With a gap that is positive inside, J
has the opposite sign, and the last term is written - J^T lambda.)
"""

from scissorcal.model.blade_point import BladePoint
from scissorcal.model.mechanism.dynamics import (
    AxisLaw,
    ConstrainedMotion,
    Constraint,
    ContactLaw,
    Level,
    Mechanism,
    compliant_motion,
    constrained_motion,
    free_acceleration,
    rig_mechanism,
    surface_constraint,
)

__all__ = [
    "AxisLaw",
    "BladePoint",
    "ConstrainedMotion",
    "Constraint",
    "ContactLaw",
    "Level",
    "Mechanism",
    "compliant_motion",
    "constrained_motion",
    "free_acceleration",
    "rig_mechanism",
    "surface_constraint",
]
