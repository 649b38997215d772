"""A plate of pieces in plain Python and float64, written apart from the C core.

The core takes a step at the pose where it ends and finds what happened on the way from there. This
reference goes the way: between two samples opening and advance change in a straight line, and each
start of a crack, each end of a strip and each cut through is found on it by bisection and booked
where it happens.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from scissorcal.kernel import ModelTables
from scissorcal.kernel.plate import Piece
from tests.kernel.reference_model import Place, Reference

PIECES_COLUMNS = ("torque", "force", "stored_J", "fracture_J", "arrest_J")
HALVINGS = 48


class Pose(NamedTuple):
    opening: float
    advance: float


@dataclass
class Sheet:
    """One piece with its crack; energies are those of the model, not yet times the scale."""

    tables: ModelTables
    piece: Piece

    def __post_init__(self) -> None:
        face = float(np.float32(self.piece.upper_face_m))
        self.law = Reference(replace(self.tables, upper_face=face, render_friction=False))
        self.crack = float(np.float32(self.piece.begin_m))
        self.ends = [float(np.float32(strip.end_m)) for strip in self.piece.strips]
        self.energies = [s.fracture_energy_J_per_m / self.piece.scale for s in self.piece.strips]
        self.kappa = float(np.float32(self.tables.kappa))
        self.strip = 0
        self.detached = True
        self.before: Pose | None = None
        self.fracture_J = self.arrest_J = 0.0

    @property
    def cut_through(self) -> bool:
        return self.strip == len(self.ends)

    def turn(self, pose: Pose) -> tuple[float, float]:
        beta = pose.opening / self.law.m
        return float(np.sin(beta)), float(np.cos(beta))

    def place(self, crack: float, pose: Pose) -> Place:
        return self.law.over(crack - pose.advance, *self.turn(pose))

    def release(self, crack: float, pose: Pose) -> float:
        return self.law.release(self.place(crack, pose))

    def stored(self, crack: float, pose: Pose) -> float:
        return self.law.stored(self.law.tables.upper_face - self.place(crack, pose).y)

    def settles(self, level: float, pose: Pose) -> float:
        """Crack farther out at which the release has fallen to the level."""
        place = self.law.run_out(level, self.place(self.crack, pose), *self.turn(pose))
        assert place is not None, "the reference has no tip"
        return max(place.x + pose.advance, self.crack)

    def go(self, pose: Pose) -> None:
        """Go on to a pose, from the one before."""
        start = pose if self.before is None else self.before
        self.before = pose
        if self.cut_through:
            return
        if self.detached:
            self.detached = self.law.tables.upper_face - self.place(self.crack, pose).y > 0
            return
        share = 0.0
        while not self.cut_through:
            energy = self.energies[self.strip]
            if energy == 0.0 or self.release(self.crack, pose) <= energy:
                return
            share = self._when(self.crack, energy, start, pose, share)
            if self.kappa < 1.0:
                self._jump(_between(start, pose, share))
                continue
            to, end = self.settles(energy, pose), self.ends[self.strip]
            self.fracture_J += energy * (min(to, end) - self.crack)
            self.crack = min(to, end)
            if to <= end:
                return
            share = self._when(end, energy, start, pose, share)
            self.strip += 1
            self._jump(_between(start, pose, share))

    def _when(self, crack: float, level: float, start: Pose, pose: Pose, low: float) -> float:
        """Share of the way at which a crack there releases the level, which at its end it does."""
        high = 1.0
        if self.release(crack, _between(start, pose, low)) >= level:
            return low
        for _ in range(HALVINGS):
            half = 0.5 * (low + high)
            if self.release(crack, _between(start, pose, half)) > level:
                high = half
            else:
                low = half
        return high

    def _jump(self, pose: Pose) -> None:
        """Run at once to where kappa of the strip's energy is released; what is over is lost."""
        before, paid = self.stored(self.crack, pose), 0.0
        while not self.cut_through:
            level = self.kappa * self.energies[self.strip]
            if level == 0.0 or self.release(self.crack, pose) <= level:
                break
            to = min(self.settles(level, pose), self.ends[self.strip])
            paid += level * (to - self.crack)
            self.crack = to
            if to < self.ends[self.strip]:
                break
            self.strip += 1
        left = 0.0 if self.cut_through else self.stored(self.crack, pose)
        self.fracture_J += paid
        self.arrest_J += before - left - paid


@dataclass
class ReferencePieces:
    """All pieces; :meth:`step` gives sums, fracture and arrest since the start."""

    tables: ModelTables
    pieces: Sequence[Piece]

    def __post_init__(self) -> None:
        self.sheets = [Sheet(self.tables, piece) for piece in self.pieces]

    def step(self, opening: float, rate: float, advance: float) -> dict[str, float]:
        out = dict.fromkeys(PIECES_COLUMNS, 0.0)
        pose = Pose(opening, advance)
        for sheet in self.sheets:
            sheet.go(pose)
            scale = float(np.float32(sheet.piece.scale))
            out["fracture_J"] += scale * sheet.fracture_J
            out["arrest_J"] += scale * sheet.arrest_J
            if not sheet.cut_through and not sheet.detached:
                torque, force = sheet.law.torque(sheet.place(sheet.crack, pose), rate)
                out["torque"] += scale * torque
                out["force"] += scale * force
                out["stored_J"] += scale * sheet.stored(sheet.crack, pose)
        if self.tables.render_friction:
            out["torque"] -= self.sheets[0].law.friction(opening, rate)
        return out

    @property
    def cracks(self) -> list[float]:
        return [sheet.crack for sheet in self.sheets]


def _between(start: Pose, end: Pose, share: float) -> Pose:
    return Pose(
        start.opening + share * (end.opening - start.opening),
        start.advance + share * (end.advance - start.advance),
    )
