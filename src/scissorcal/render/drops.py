"""How far the torque of a drawn plate falls at once, as cracks run and pieces are cut through."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from scissorcal.aliases import Array
from scissorcal.kernel import (
    Kernel,
    ModelTables,
    Piece,
    StepFlag,
    StepOutput,
    Strip,
    largest_overlap,
)

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
    levels = _Levels(tables, piece, openings)
    found = np.zeros(len(openings))
    for k, strip in enumerate(piece.strips):
        if strip.fracture_energy_J_per_m > 0.0:
            before = levels.running(strip.fracture_energy_J_per_m)[0]
            runs = (before > 0.0) & (before <= torque_limit)
            left = _left(levels, tables.kappa, piece.strips[k:])
            if tables.kappa < 1.0:
                stopped = levels.running(tables.kappa * strip.fracture_energy_J_per_m)[0]
                left = np.minimum(left, stopped)
            found = np.where(runs, np.maximum(found, before - left), found)
    return found


def _left(levels: "_Levels", kappa: float, strips: Sequence[Strip]) -> Array:
    """The torque where a crack stops that leaves the first of these strips."""
    before, start = levels.running(strips[0].fracture_energy_J_per_m)
    left = np.zeros(len(start))  # of those that no strip stops
    runs = np.ones(len(start), dtype=np.bool_)
    border = 0.0
    for strip in strips[1:]:
        release = kappa * strip.fracture_energy_J_per_m
        stop = np.full(len(start), -np.inf)
        if 0.0 < release < strips[0].fracture_energy_J_per_m:
            torque, place = levels.running(release)
            stop = place - start
        rests = runs & ~(stop > border)
        if rests.any():
            held = levels.held(start + border) if border > 0.0 else before
            left[rests] = held[rests]
        length = strip.end_m - strips[0].end_m
        stops = runs & (stop > border) & (stop <= length)
        if stops.any():
            left[stops] = torque[stops]
        runs &= stop > length
        border = length
    return left


class _Levels:
    """Torque of a piece at each opening (openings,): where its crack runs, and where it is held."""

    def __init__(self, tables: ModelTables, piece: Piece, openings: Array) -> None:
        quiet = replace(tables, render_friction=False, kappa=1.0, upper_face=piece.upper_face_m)
        self.tables, self.scale, self.openings = quiet, piece.scale, openings
        self._known: dict[float, tuple[Array, Array]] = {}

    def running(self, release: float) -> tuple[Array, Array]:
        """Torque and contact where a crack runs at a release (J/m of the whole piece).

        From the scene's nearest contact on; torque 0 where it does not run from there, and at a
        contact of infinity where it runs past the blade's tip.
        """
        if release not in self._known:
            kernel = self._kernel(release / self.scale)
            near = self.tables.contact_min
            steps = [_step(kernel, float(opening), near) for opening in self.openings]
            beyond = np.array([bool(step.flags & StepFlag.BEYOND_TIP) for step in steps])
            runs = np.array([step.fracture_J > 0.0 for step in steps])
            torque = np.array([step.torque for step in steps])
            contact = np.array([step.contact for step in steps])
            felt = np.where(runs & ~beyond, self.scale * torque, 0.0)
            self._known[release] = felt, np.where(beyond, np.inf, contact)
        return self._known[release]

    def held(self, contacts: Array) -> Array:
        """Torque where the crack stands at contacts (openings,)."""
        kernel = self._kernel(0.0)
        steps = [
            _step(kernel, float(opening), float(contact))
            for opening, contact in zip(self.openings, contacts, strict=True)
        ]
        return self.scale * np.array([step.torque for step in steps])

    def _kernel(self, energy: float) -> Kernel:
        return Kernel(replace(self.tables, fracture_energy=energy))


def _step(kernel: Kernel, opening: float, contact: float) -> StepOutput:
    kernel.reset(contact)
    return kernel.step(opening, 0.0, 0.0)


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
