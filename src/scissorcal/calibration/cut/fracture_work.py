"""Fracture work by stroke: what the blades spent on the cut, against J_c h times its length."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from scissorcal.aliases import Array
from scissorcal.calibration.cut.known import KnownFriction
from scissorcal.calibration.cut.path import path_motion
from scissorcal.calibration.cut.structure import fitted_cutting, some_draws
from scissorcal.calibration.result import FitResult
from scissorcal.errors import InputError, MissingError
from scissorcal.model import Cutting, cut_torque_along, edge_height, mean_share
from scissorcal.recording.recording import Recording

Places = NDArray[np.int64]

SHORTEST_CUT_M = 2e-3
"""Strokes that cut less than this have no work that can be measured."""
MOVED_SHARE = 0.05
DRAWS = 100
NOTICED = 0.07
SURE_SD = 3.0


@dataclass(frozen=True)
class StrokeWork:
    """One stroke's balance, in J and m.

    ``total`` is the work of the torque less friction and inertia, ``stored`` what of it the
    material still holds at the end more than at the beginning, ``fracture`` the rest with its
    standard deviation ``sd`` (level of friction, noise of the drive). ``expected`` is J_c h times
    ``length``, less what a ripple does not take, with 5 and 95 %. ``pivot_moved`` says that the
    pivot moved along the cut meanwhile, whose work was not measured.
    """

    stroke: int
    length: float
    total: float
    stored: float
    fracture: float
    sd: float
    expected: float
    expected_low: float
    expected_high: float
    pivot_moved: bool

    @property
    def differs(self) -> bool:
        """Whether measured and expected work differ surely and by more than a hand notices."""
        away = abs(self.fracture - self.expected)
        return away > SURE_SD * self.sd and away > NOTICED * self.expected


def fracture_work(
    fit: FitResult,
    friction: FitResult | None,
    recordings: Sequence[Recording],
    strokes: Sequence[int],
) -> tuple[StrokeWork, ...]:
    """Balance each of ``strokes`` (labels of the fit) over all of its samples, those at rest too.

    Recordings are matched to the fit by content hash. Raises MissingError with the reason where
    there is no balance, InputError where no motion has material in place.
    """
    cutting = fitted_cutting(fit)
    if friction is None or cutting is None:
        raise MissingError("The work needs fits of friction and of the cut: `scissorcal fit`.")
    if cutting.fracture_energy is None:
        raise MissingError("Nothing is cut in this scene, so there is no fracture work.")
    hashes = [source.rpartition(" sha256:")[2] for source in fit.sources]
    known = {one.content_hash: one for one in recordings if one.content_hash}
    chosen = tuple(known[digest] for digest in hashes if digest in known)
    if not chosen or len(chosen) < len(hashes):
        raise MissingError(
            "The work is computed from the recordings, which this report was made without: run "
            "`scissorcal report` in their workspace."
        )
    balance = _Balance(fit, friction, cutting, _path_of(chosen, friction, cutting))
    kept = [balance.of(label) for label in strokes if label >= 0]
    found = tuple(row for row in kept if row is not None)
    if not found:
        raise MissingError("No stroke cut the material.")
    return found


@dataclass(frozen=True)
class _Path:
    """Samples of all motions with material in place, (n,) each, in order of time.

    ``spent`` (J) is what the blades put into the material from the sample before to this one,
    ``cut`` (m) by how much the crack grew meanwhile; both are 0 at the first sample of a motion.
    """

    opening: Array
    advance: Array
    stroke: Places
    tip: Array
    spent: Array
    cut: Array
    tick_s: float


class _Balance:
    """Energies of a cut's strokes, from the work between openings."""

    def __init__(self, fit: FitResult, friction: FitResult, cutting: Cutting, path: _Path) -> None:
        self.path, self.cutting = path, cutting
        self.known = KnownFriction.of(friction)
        self.drawn = fitted_cutting(fit, some_draws(fit, DRAWS)[:, None, :])
        contact = path.tip - path.advance
        view = edge_height(cutting.edge, contact, path.opening / cutting.moving_blades)
        self.slope = view.slope
        self.stored = cutting.moving_blades * cutting.response.energy_at(
            cutting.upper_face_m - view.height
        )

    def of(self, label: int) -> StrokeWork | None:
        """The balance of one stroke; None where it did not cut."""
        path = self.path
        at = np.flatnonzero(path.stroke == label)
        if len(at) < 2:
            return None
        moved = path.cut[at[1:]]
        length = float(moved.sum())
        if length < SHORTEST_CUT_M:
            return None
        work = float(path.spent[at[1:]].sum())
        stored = float(self.stored[at[-1]] - self.stored[at[0]])
        expected = self._expected(at, moved) * length
        low, high = np.quantile(expected, [0.05, 0.95])
        span = float(path.advance[at].max() - path.advance[at].min())
        return StrokeWork(
            label, length, work, stored, work - stored, self._sd(at), float(expected.mean()),
            float(low), float(high), span > MOVED_SHARE * length,
        )  # fmt: skip

    def _sd(self, at: Places) -> float:
        """Standard deviation (J): friction's level, what strokes differ by, the drive's noise."""
        gone = float(np.abs(np.diff(self.path.opening[at])).sum())
        noise = self.known.noise.variance_of_mean(len(at), self.path.tick_s)
        return gone * float(np.sqrt(self.known.closing_sd**2 + self.known.stroke_sd**2 + noise))

    def _expected(self, at: Places, moved: Array) -> Array:
        """Energy that a metre of cut takes on average, by draws (k,), in J/m."""
        assert self.drawn is not None
        energy = np.asarray(self.drawn.fracture_energy)
        weight = moved / moved.sum()
        slope = float(np.sum(weight * self.slope[at[1:]]))
        peak = energy / (self.drawn.moving_blades * max(slope, 1e-9))
        return np.ravel(energy * mean_share(self.drawn, peak))


def _path_of(recordings: tuple[Recording, ...], friction: FitResult, cutting: Cutting) -> _Path:
    """Follow the crack and the material's work through all motions, sheet by sheet."""
    known = KnownFriction.of(friction)
    cracks: dict[tuple[int, int], float] = {}
    rows = []
    motions = path_motion(recordings, known.inertia)
    for motion in motions:
        work = known.material(motion).work
        for run in _runs(motion.sheet):
            sheet = (motion.recording, int(motion.sheet[run.start]))
            if sheet[1] < 0:
                continue
            opening, advance = motion.opening[run], motion.advance[run]
            _, tip = cut_torque_along(cutting, opening, advance, cracks.get(sheet, 0.0))
            cracks[sheet] = float(tip[-1])
            spent, cut = np.diff(work[run], prepend=work[run][:1]), np.diff(tip, prepend=tip[:1])
            rows.append((opening, advance, motion.stroke[run], tip, -spent, cut))
    if not rows:
        raise InputError("No stroke of these recordings has material in place.")
    columns = (np.concatenate(column) for column in zip(*rows, strict=True))
    opening, advance, stroke, tip, spent, cut = columns
    return _Path(opening, advance, stroke, tip, spent, cut, motions[0].tick_s)


def _runs(sheet: Places) -> list[slice]:
    ends = [0, *(np.flatnonzero(np.diff(sheet)) + 1).tolist(), len(sheet)]
    return [slice(a, b) for a, b in pairwise(ends) if b > a]
