"""Fracture work by stroke: what the blades spent on the cut, against J_c h times its length."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from scissorcal.calibration.cut.known import KnownFriction
from scissorcal.calibration.cut.path import path_motion
from scissorcal.calibration.result import FitResult
from scissorcal.errors import InputError
from scissorcal.model import (
    Cutting,
    cut_torque_along,
    edge_height,
    ripple_moments,
)
from scissorcal.recording.recording import Recording
from scissorcal.report.numbers import Number, finite, percent, significant
from scissorcal.report.panel import Panel, Row, Table, absent, columns
from scissorcal.report.reduce import Array
from scissorcal.report.sections.law import cutting_of, some_draws
from scissorcal.report.strokes import StrokeName, StrokeSamples, split_source
from scissorcal.report.svg import INK, MUTED, PANEL, Svg, finish, look_of, new_axes

Places = NDArray[np.int64]

SHORTEST_CUT_M = 2e-3
"""Strokes that cut less than this have no work to speak of."""
ADVANCED_SHARE = 0.05
DRAWS = 100
FELT = 0.07
SURE = 3.0
MOST_BARS = 24


@dataclass(frozen=True)
class StrokeWork:
    """One stroke's balance, in J and m.

    ``total`` is the work of the torque less friction and inertia, ``stored`` what of it the
    material still held at the end more than at the beginning, ``fracture`` the rest with its
    standard deviation ``sd`` (friction's level and the drive's noise). ``expected`` is J_c h times
    ``length``, less what a ripple does not take, with 5 and 95 %. ``advanced`` says that the pivot
    moved along the cut meanwhile, whose work nobody measured.
    """

    name: StrokeName
    length: Number
    total: Number
    stored: Number
    fracture: Number
    sd: Number
    expected: Number
    expected_low: Number
    expected_high: Number
    advanced: bool


@dataclass(frozen=True)
class FractureWork:
    """All strokes that cut, in order; ``missing`` says why there is none."""

    missing: str
    rows: tuple[StrokeWork, ...]


def fracture_work(
    fit: FitResult,
    friction: FitResult | None,
    recordings: Sequence[Recording],
    strokes: Sequence[StrokeSamples],
) -> FractureWork:
    """Balance every stroke through material over all of its samples, those at rest included."""
    cutting = cutting_of(fit)
    if friction is None or cutting is None:
        return FractureWork("The work needs fits of friction and of the cut: `scissorcal fit`.", ())
    if cutting.fracture_energy is None:
        return FractureWork("Nothing is cut in this scene, so there is no fracture to pay for.", ())
    wanted = [split_source(source) for source in fit.sources]
    chosen = [
        next((r for r in recordings if r.content_hash == digest and digest), None)
        for _, digest in wanted
    ]
    if not chosen or any(recording is None for recording in chosen):
        return FractureWork(
            "The work is taken from the recordings themselves, and they were not handed to this "
            "report: run `scissorcal report` in their workspace.",
            (),
        )
    try:
        path = _path_of(tuple(r for r in chosen if r is not None), friction, cutting)
    except InputError as error:
        return FractureWork(str(error), ())
    balance = _Balance(fit, friction, cutting, path)
    names = {stroke.name.stroke: stroke.name for stroke in strokes}
    rows = [balance.of(label, name) for label, name in sorted(names.items()) if label >= 0]
    kept = tuple(row for row in rows if row is not None)
    return FractureWork("" if kept else "No stroke cut the material.", kept)


def show_work(section: FractureWork, anchor: str) -> Panel:
    """The panel: all strokes together in words, work over length, the table."""
    title, where = "Fracture work by stroke", f"{anchor}-work"
    if section.missing:
        return absent(where, title, section.missing)
    found = tuple(
        Row(
            (
                row.name.label + (" (pivot moved)" if row.advanced else ""),
                significant(_milli(row.length)),
                f"{significant(_milli(row.fracture))} ± {significant(_milli(row.sd), 2)}",
                _expected_words(row),
                percent(_share(row)),
                significant(_milli(row.stored)),
            ),
            anchor=row.name.anchor,
            marked=_odd(row),
        )
        for row in section.rows
    )
    heads = columns(
        "Stroke",
        "Cut [mm]",
        "Fracture work [mJ]",
        "Expected [mJ]",
        "Measured / expected",
        "Left in the material [mJ]",
    )
    lead = (
        "Work of the torque over the whole stroke, less friction, inertia and what the pressed "
        "material still holds at its end. Expected is J_c h times the length of the cut, which is "
        "the model's; where fracture ripples, its mean over a cycle.",
    )
    return Panel(
        where,
        title,
        lead,
        _finding(section),
        (_draw(section, where),),
        Table("One row for each stroke that cut.", heads, found),
    )


def _expected_words(row: StrokeWork) -> str:
    low, high = (significant(_milli(v)) for v in (row.expected_low, row.expected_high))
    return f"{significant(_milli(row.expected))} ({low} to {high})"


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
        self.drawn = cutting_of(fit, some_draws(fit, DRAWS)[:, None, :])
        contact = path.tip - path.advance
        view = edge_height(cutting.edge, contact, path.opening / cutting.moving_blades)
        self.slope = view.slope
        self.stored = cutting.moving_blades * cutting.response.energy_at(
            cutting.upper_face_m - view.height
        )

    def of(self, label: int, name: StrokeName) -> StrokeWork | None:
        """The balance of one stroke; None where it did not cut."""
        path = self.path
        at = np.flatnonzero(path.stroke == label)
        if len(at) < 2 or name.kind == "opening":
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
            name,
            finite(length),
            finite(work),
            finite(stored),
            finite(work - stored),
            finite(self._sd(at)),
            finite(expected.mean()),
            finite(low),
            finite(high),
            span > ADVANCED_SHARE * length,
        )

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
        return np.ravel(energy * ripple_moments(self.drawn, peak).mean_share)


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
    columns_of = (np.concatenate(column) for column in zip(*rows, strict=True))
    opening, advance, stroke, tip, spent, cut = columns_of
    return _Path(opening, advance, stroke, tip, spent, cut, motions[0].tick_s)


def _runs(sheet: Places) -> list[slice]:
    ends = [0, *(np.flatnonzero(np.diff(sheet)) + 1).tolist(), len(sheet)]
    return [slice(a, b) for a, b in pairwise(ends) if b > a]


def _finding(section: FractureWork) -> str:
    good = [row for row in section.rows if not row.advanced] or list(section.rows)
    length, work, expected = (
        sum(getattr(row, key) or 0.0 for row in good) for key in ("length", "fracture", "expected")
    )
    sd = float(np.sqrt(sum((row.sd or 0.0) ** 2 for row in good)))
    words = (
        f"Together {len(good)} strokes spent {significant(1e3 * work)} mJ on "
        f"{significant(1e3 * length)} mm of cut, {significant(work / length)} J/m "
        f"(± {significant(sd / length, 2)}); the fit says {significant(expected / length)} J/m."
    )
    odd = [row.name.label for row in section.rows if _odd(row)]
    return words + (f" Unlike the fit: {'; '.join(odd[:3])}." if odd else "")


def _draw(section: FractureWork, anchor: str) -> Svg:
    """Work per metre of cut by stroke, against what the fit expects of it."""
    shown = section.rows[:MOST_BARS]
    figure, axes = new_axes((PANEL[0], max(1.6, 0.9 + 0.19 * len(shown))))
    for place, row in enumerate(shown):
        length = row.length or 1.0
        low, high = ((v or 0.0) / length for v in (row.expected_low, row.expected_high))
        axes.barh(place, high - low, left=low, height=0.8, color=INK, alpha=0.2)
        colour, marker = look_of(row.name.kind)
        work, sd = (row.fracture or 0.0) / length, (row.sd or 0.0) / length
        axes.plot([work - 2 * sd, work + 2 * sd], [place, place], color=MUTED, lw=1.6)
        face = "none" if row.advanced else colour
        address = f"#{row.name.anchor}"
        axes.plot(work, place, marker, color=colour, mfc=face, ms=5, mew=1.1, url=address)
    labels = axes.set_yticks(range(len(shown)), labels=[row.name.label for row in shown])
    for tick, row in zip(labels, shown, strict=True):
        tick.label1.set_url(f"#{row.name.anchor}")
    axes.tick_params(axis="y", length=0)
    axes.grid(axis="y", visible=False)
    axes.set_ylim(len(shown) - 0.4, -0.6)
    axes.locator_params(axis="x", nbins=4)
    axes.set_xlabel("fracture work per metre of cut [J/m]")
    caption = (
        "Marks are measured, with two standard deviations; the grey holds what the fit expects "
        "with 90 %. Open marks: the pivot moved meanwhile."
    )
    if len(shown) < len(section.rows):
        caption += f" The first {len(shown)} of {len(section.rows)} strokes."
    title = "Fracture work per metre of cut"
    return finish(figure, f"{anchor}-f", title, caption, f"{_finding(section)} {caption}")


def _odd(row: StrokeWork) -> bool:
    if row.fracture is None or not row.expected or not row.sd:
        return False
    away = row.fracture - row.expected
    return abs(away) > SURE * row.sd and abs(away) > FELT * row.expected


def _share(row: StrokeWork) -> Number:
    return row.fracture / row.expected if row.fracture is not None and row.expected else None


def _milli(value: Number) -> Number:
    return None if value is None else 1e3 * value
