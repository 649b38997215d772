"""Error on strokes that the fit had not seen, from the worst."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from scissorcal.calibration.result import FitResult, StrokeError
from scissorcal.recording.recording import Stroke
from scissorcal.report.numbers import Number, finite, percent, short
from scissorcal.report.reduce import median
from scissorcal.report.strokes import KINDS, StrokeName, stroke_label
from scissorcal.report.svg import PANEL, Svg, finish, look_of, new_axes


@dataclass(frozen=True)
class HeldOutRow:
    """One stroke's held-out error; ``anchor`` is empty where the page has no such stroke.

    ``speed`` is the planned one, or the median of the measured ones where nothing was planned.
    """

    anchor: str
    label: str
    recording: str
    stroke: int
    kind: str
    speed: Number
    rms: Number
    relative_rms: Number


@dataclass(frozen=True)
class HeldOutSection:
    """All held-out strokes from the worst, with the median and the worst relative error."""

    median_relative_rms: Number
    worst_relative_rms: Number
    rows: tuple[HeldOutRow, ...]


def gather_held_out(fit: FitResult, names: Sequence[StrokeName]) -> HeldOutSection:
    """Order held-out errors from the worst and tie them to the strokes on the page."""
    rows = [_row(error, fit.position_unit, names) for error in fit.held_out]
    rows.sort(key=lambda row: -1.0 if row.relative_rms is None else row.relative_rms, reverse=True)
    shares = np.array([row.relative_rms for row in rows], dtype=np.float64)
    worst = rows[0].relative_rms if rows else None
    return HeldOutSection(finite(median(shares)), worst, tuple(rows))


def draw_held_out(fit: FitResult, section: HeldOutSection, anchor: str) -> tuple[Svg, ...]:
    """Relative error against nominal speed; nothing where no stroke has both."""
    known = [row for row in section.rows if row.relative_rms is not None and row.speed]
    if not known:
        return ()
    figure, axes = new_axes(PANEL)
    for row in known:
        colour, marker = look_of(row.kind)
        error = 100.0 * (row.relative_rms or 0.0)
        axes.plot(row.speed or 0.0, error, marker, color=colour, ms=6, mew=0, alpha=0.75)
    axes.set_xscale("log")
    ticks = _apart(sorted({row.speed for row in known if row.speed}))
    axes.set_xticks(ticks, labels=[short(tick, 2) for tick in ticks])
    axes.minorticks_off()
    axes.margins(x=0.08)
    axes.set_ylim(bottom=0)
    axes.set_xlabel(f"speed [{fit.position_unit}/s]")
    axes.set_ylabel("held-out error [%]")
    caption = (
        "Each mark is a stroke, predicted by a fit that had not seen it: rms error over the rms of "
        f"what was measured. Median {percent(section.median_relative_rms)}, worst "
        f"{percent(section.worst_relative_rms)}."
    )
    return (finish(figure, f"{anchor}-heldout", "Held-out error over speed", caption),)


def _apart(speeds: Sequence[float]) -> list[float]:
    """Speeds that differ by enough for their labels to stand side by side."""
    kept: list[float] = []
    for speed in speeds:
        if not kept or speed > 1.4 * kept[-1]:
            kept.append(speed)
    return kept


def _row(error: StrokeError, position_unit: str, names: Sequence[StrokeName]) -> HeldOutRow:
    name = next(
        (n for n in names if n.stroke == error.stroke and n.recording == error.recording), None
    )
    kind = KINDS.get(error.kind, "excitation")
    return HeldOutRow(
        name.anchor if name else "",
        name.label if name else stroke_label(Stroke(0, kind), error.stroke, position_unit),
        error.recording,
        error.stroke,
        name.kind if name else error.kind,
        finite(error.speed) if name is None or name.speed is None else name.speed,
        finite(error.rms),
        finite(error.relative_rms),
    )
