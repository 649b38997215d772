"""The physics: edge, response, fracture, torque and friction, as pure functions of arrays."""

from scissorcal.model.cutting import (
    Cutting,
    cut_torque,
    cut_torque_along,
    damped,
    mean_share,
    ripple_moments,
    settled_contact,
)
from scissorcal.model.edge import Edge, EdgeBelief, EdgeView, draw_edges, edge_height
from scissorcal.model.friction import FrictionLaw, friction_torque, presliding_state
from scissorcal.model.response import Response
from scissorcal.model.stance import (
    Settled,
    Stance,
    Turned,
    held_torque,
    settle,
    take_stance,
    torque_of,
)

__all__ = [
    "Cutting",
    "Edge",
    "EdgeBelief",
    "EdgeView",
    "FrictionLaw",
    "Response",
    "Settled",
    "Stance",
    "Turned",
    "cut_torque",
    "cut_torque_along",
    "damped",
    "draw_edges",
    "edge_height",
    "friction_torque",
    "held_torque",
    "mean_share",
    "presliding_state",
    "ripple_moments",
    "settle",
    "settled_contact",
    "take_stance",
    "torque_of",
]
