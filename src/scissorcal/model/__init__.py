"""The physics: edge, response, fracture, torque and friction, as pure functions of arrays.

Names are imported when they are first used: the table of friction terms, which the recipe reads,
needs no numpy.
"""

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from scissorcal.model.cutting import (
        Cutting,
        cut_torque_along,
        damped,
        mean_share,
        settled_contact,
    )
    from scissorcal.model.edge import Edge, EdgeDistribution, EdgeView, draw_edges, edge_height
    from scissorcal.model.friction import FrictionLaw, friction_torque, presliding_state
    from scissorcal.model.response import Response

__all__ = [
    "Cutting",
    "Edge",
    "EdgeDistribution",
    "EdgeView",
    "FrictionLaw",
    "Response",
    "cut_torque_along",
    "damped",
    "draw_edges",
    "edge_height",
    "friction_torque",
    "mean_share",
    "presliding_state",
    "settled_contact",
]


def __getattr__(name: str) -> Any:
    for home in ("cutting", "edge", "friction", "response"):
        module = importlib.import_module(f"scissorcal.model.{home}")
        if name in __all__ and hasattr(module, name):
            return getattr(module, name)
    raise AttributeError(f"module 'scissorcal.model' has no attribute {name!r}")
