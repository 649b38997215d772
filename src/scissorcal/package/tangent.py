"""How steeply the rendered torque falls as the blades open, at single places: its tangent.

With g' = dg/d(delta) from the table's own cubic, lever L, t = tan(psi), t' = dt/dx at a fixed angle
and m moving blades, a sheet whose crack stands has (closure ``work``)

    K = - d(tau)/d(theta) = (g' L^2 - g (L t + phi (1 + t^2 + phi t'))) / m

A difference of torques over a fixed step is no such slope: the blades leave the material within
torque / K, and beyond it the difference is torque / step, however stiff the material is.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from scissorcal.aliases import Array
from scissorcal.kernel import ModelTables, StepFlag
from scissorcal.model.curvature import Span
from scissorcal.package.law_boxes import Boxes, EdgeOver, ResponseOver, slope_of_opening


class Tangent:
    """The elastic slope of torque over the opening, where steps of a model have come to."""

    def __init__(self, tables: ModelTables) -> None:
        self.tables = tables
        self._edge, self._response = EdgeOver(tables.edge), ResponseOver(tables.response)

    def at(self, opening: Array, steps: NDArray[np.void]) -> Array:
        """By how much torque falls per opening (n,), N m/rad, with the crack held.

        ``opening`` (n,) in rad, ``steps`` (n,) what `Kernel.step_many` gave there; of a response of
        scale 1, without friction and at rest. 0 where the blades do not touch.
        """
        touching = (steps["flags"] & int(StepFlag.TOUCHING)) != 0
        slope = np.zeros(len(opening))
        if touching.any():
            slope[touching] = self._touching(opening[touching], steps[touching])
        return slope

    def _touching(self, opening: Array, steps: Any) -> Array:
        beta = np.asarray(opening, dtype=np.float64) / self.tables.moving_blades
        x, y, depth = (
            steps[name].astype(np.float64) for name in ("contact", "height", "indentation")
        )
        station = x * np.cos(beta) + y * np.sin(beta)  # the rotation by beta, turned back
        places = Boxes(
            np.zeros(len(beta), dtype=np.int64),
            self._edge.stretches(station),
            Span(beta, beta),
            Span(station, station),
        )
        stiff, force = self._response.steepness(depth), self._response.at(depth)
        stand = self._edge.stand(places)
        slope = slope_of_opening(self.tables, stand, Span(stiff, stiff), Span(force, force))
        return np.asarray(slope.low)
