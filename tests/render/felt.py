"""What a softer response alone costs, at rest and without friction."""

from collections.abc import Sequence
from dataclasses import replace

from scissorcal.kernel import ModelTables, Piece
from scissorcal.render.felt_cost import FeltTorque


def felt_change(
    tables: ModelTables, other: ModelTables, torque_limit: float, pieces: Sequence[Piece] = ()
) -> float:
    """`FeltTorque.change` at rest and without friction."""
    quiet, soft = (replace(each, render_friction=False) for each in (tables, other))
    return FeltTorque(quiet, torque_limit, pieces=pieces).change(soft)
