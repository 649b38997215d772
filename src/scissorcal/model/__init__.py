"""The physics: edge, response, fracture, torque and friction, as pure functions of arrays.

Names are imported when they are first used: the table of friction terms, which the recipe reads,
needs no numpy.
"""

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
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


def __getattr__(name: str) -> Any:
    for home in ("cutting", "edge", "friction", "response", "stance"):
        module = importlib.import_module(f"scissorcal.model.{home}")
        if name in __all__ and hasattr(module, name):
            return getattr(module, name)
    raise AttributeError(f"module 'scissorcal.model' has no attribute {name!r}")
