"""The physics: edge, response, fracture, torque and friction, as pure functions of arrays."""

from scissorcal.model.cutting import (
    Cutting,
    cut_torque,
    cut_torque_along,
    ripple_moments,
    ripple_spread,
    settled_contact,
)
from scissorcal.model.edge import Edge, EdgeBelief, EdgeView, draw_edges, edge_height
from scissorcal.model.friction import FrictionLaw, friction_torque
from scissorcal.model.response import Response

__all__ = [
    "Cutting",
    "Edge",
    "EdgeBelief",
    "EdgeView",
    "FrictionLaw",
    "Response",
    "cut_torque",
    "cut_torque_along",
    "draw_edges",
    "edge_height",
    "friction_torque",
    "ripple_moments",
    "ripple_spread",
    "settled_contact",
]
