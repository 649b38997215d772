"""The physics: edge, response, fracture, torque and friction, as pure functions of arrays."""

from scissorcal.model.cutting import (
    Cutting,
    cut_torque,
    cut_torque_along,
    ripple_moments,
    ripple_spread,
    settled_contact,
)
from scissorcal.model.edge import Edge, EdgeView, edge_height
from scissorcal.model.friction import FrictionLaw, friction_torque
from scissorcal.model.response import Response

__all__ = [
    "Cutting",
    "Edge",
    "EdgeView",
    "FrictionLaw",
    "Response",
    "cut_torque",
    "cut_torque_along",
    "edge_height",
    "friction_torque",
    "ripple_moments",
    "ripple_spread",
    "settled_contact",
]
