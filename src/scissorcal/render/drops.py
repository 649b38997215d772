"""How far the torque of a drawn plate falls at once, as cracks run and pieces are cut through."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from scissorcal.kernel import Kernel, ModelTables, Piece, StepFlag, largest_overlap

Array = NDArray[np.float64]

OPENINGS = 48


def largest_drop(tables: ModelTables, torque_limit: float, pieces: Sequence[Piece]) -> float:
    """Largest fall of torque (N m) as cracks run at one opening, found at 48 openings.

    A crack falls from the release at which it leaves its place to that at which it stops: in its
    own strip (ripples), in a later one that it runs on into, or behind the piece's far edge, where
    nothing is left. Those of pieces that a blade can press at once are added up, as all may run at
    once. Only what is felt before within the torque limit counts.
    """
    openings = np.linspace(tables.opening_min, tables.opening_max, OPENINGS)
    reach = _pressed_m(tables, pieces)
    falls = np.stack([_falls(tables, torque_limit, piece, openings) for piece in pieces])
    return max(largest_overlap(pieces, reach, each.tolist()) for each in falls.T)


def _falls(tables: ModelTables, torque_limit: float, piece: Piece, openings: Array) -> Array:
    """The largest fall (openings,) of one piece."""
    found = np.zeros(len(openings))
    levels = _Levels(tables, piece, openings)
    for k, strip in enumerate(piece.strips):
        energy = strip.fracture_energy_J_per_m
        if not energy > 0.0:
            continue
        before, start = levels.at(energy)
        runs = (before > 0.0) & (before <= torque_limit)
        if tables.kappa < 1.0:
            found = np.where(
                runs, np.maximum(found, before - levels.at(tables.kappa * energy)[0]), found
            )
        for later in piece.strips[k + 1 :]:
            release = tables.kappa * later.fracture_energy_J_per_m
            if not 0.0 < release < energy:
                break  # it rests at this strip's border
            left, stop = levels.at(release)
            found = np.where(runs, np.maximum(found, before - left), found)
            runs &= stop - start > later.end_m - strip.end_m
        else:
            found = np.where(runs, np.maximum(found, before), found)
    return found


class _Levels:
    """Torque of a piece and contact (openings,), while its crack runs at a release.

    Torque 0 at a contact of infinity where it runs past the blade's tip, and torque 0 where it does
    not run from the scene's nearest contact on.
    """

    def __init__(self, tables: ModelTables, piece: Piece, openings: Array) -> None:
        quiet = replace(tables, render_friction=False, kappa=1.0, upper_face=piece.upper_face_m)
        self.tables, self.scale, self.openings = quiet, piece.scale, openings
        self._known: dict[float, tuple[Array, Array]] = {}

    def at(self, release: float) -> tuple[Array, Array]:
        """At a release in J/m of the whole piece."""
        if release not in self._known:
            kernel = Kernel(replace(self.tables, fracture_energy=release / self.scale))
            rows = np.array([self._step(kernel, float(opening)) for opening in self.openings])
            self._known[release] = rows[:, 0], rows[:, 1]
        return self._known[release]

    def _step(self, kernel: Kernel, opening: float) -> tuple[float, float]:
        kernel.reset(self.tables.contact_min)
        step = kernel.step(opening, 0.0, 0.0)
        if step.flags & StepFlag.BEYOND_TIP:
            return 0.0, np.inf
        return (self.scale * step.torque if step.fracture_J > 0.0 else 0.0), step.contact


def _pressed_m(tables: ModelTables, pieces: Sequence[Piece]) -> float:
    """Most length (m) of material along the cut that lies below a blade's edge at once.

    Between the place where it stands deepest and the one where it leaves the highest face: the
    depth of the response's table, and what faces differ in height, over the least slope.
    """
    beta = tables.opening_min / tables.moving_blades
    slope = np.tan(beta + np.arctan(float(tables.edge.slope.min())))
    faces = [piece.upper_face_m for piece in pieces]
    depth = float(tables.response.x[-1]) + max(faces) - min(faces)
    return float(min(depth / max(slope, 1e-6), tables.tip_station))
