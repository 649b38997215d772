"""The table of a fit: a row for each parameter, for people to read and to take numbers from."""

import html
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from scissorcal.aliases import Array
from scissorcal.errors import InputError, UnknownNameError, unknown_name
from scissorcal.inference import bulk_ess, rank_r_hat

if TYPE_CHECKING:
    from scissorcal.calibration import FitResult

HEAD = ("name", "unit", "mean", "sd", "median", "hdi low", "hdi high", "ess", "r-hat")


@dataclass(frozen=True)
class SummaryRow:
    """One parameter of a fit, in ``unit``.

    ``mean`` and ``sd`` are None where heavy tails make them say something else than the quantiles
    do (`FittedParameter.moments`). ``hdi`` is the narrowest interval of the table's probability.
    ``ess`` is how many independent draws the draws are worth: ArviZ' bulk value, and no more than
    the sampling itself counted. ``r_hat`` compares the two halves of the draws, whose order tells
    nothing at draft and standard effort. Both are NaN where no draws are kept.
    """

    name: str
    unit: str
    mean: float | None
    sd: float | None
    median: float
    hdi: tuple[float, float]
    ess: float
    r_hat: float
    meaning: str = ""

    @property
    def cells(self) -> tuple[str, ...]:
        """The row as the table shows it, in the order of ``HEAD``."""
        moments = (_number(self.mean), "-" if self.sd is None else f"{self.sd:.2g}")
        low, high = (_number(end) for end in self.hdi)
        ess = "-" if math.isnan(self.ess) else f"{self.ess:.0f}"
        r_hat = "-" if math.isnan(self.r_hat) else f"{self.r_hat:.2f}"
        return (self.name, self.unit, *moments, _number(self.median), low, high, ess, r_hat)


@dataclass(frozen=True)
class FitSummary:
    """The table of a fit: ``print`` it, iterate over its rows, or take one by name.

    ``title`` names quantity, law and effort, ``notes`` what is known to be poor: checks that
    failed, and parameters whose tails are heavy. ``probability`` is that of ``hdi``.
    """

    title: str
    rows: tuple[SummaryRow, ...]
    probability: float
    notes: tuple[str, ...] = ()

    def __iter__(self) -> Iterator[SummaryRow]:
        return iter(self.rows)

    def __len__(self) -> int:
        return len(self.rows)

    def __getitem__(self, name: str) -> SummaryRow:
        """Give the row of one parameter; UnknownNameError names the nearest."""
        for row in self.rows:
            if row.name == name:
                return row
        names = [row.name for row in self.rows]
        raise UnknownNameError(unknown_name("parameter of this table", name, names))

    def __str__(self) -> str:
        cells = [HEAD, *(row.cells for row in self.rows)]
        widths = [max(len(cell) for cell in column) for column in zip(*cells, strict=True)]
        lines = ["  ".join(_aligned(line, widths)).rstrip() for line in cells]
        return "\n".join([self.title, *lines, self._interval, *self.notes])

    __repr__ = __str__

    def _repr_html_(self) -> str:
        head = "".join(f"<th>{html.escape(cell)}</th>" for cell in HEAD)
        body = "".join(
            f'<tr title="{html.escape(row.meaning)}">'
            + "".join(f"<td>{html.escape(cell)}</td>" for cell in row.cells)
            + "</tr>"
            for row in self.rows
        )
        below = "".join(f"<p>{html.escape(note)}</p>" for note in (self._interval, *self.notes))
        caption = f"<caption>{html.escape(self.title)}</caption>"
        return f"<table>{caption}<thead><tr>{head}</tr></thead><tbody>{body}</tbody></table>{below}"

    @property
    def _interval(self) -> str:
        return f"hdi: the narrowest interval that holds {self.probability:.0%} of the draws."


def summary_of(fit: "FitResult", probability: float) -> FitSummary:
    """Sum up a fit's parameters and those derived from them; ``probability`` of the interval.

    Raises InputError for a probability outside 0 to 1.
    """
    if not 0.0 < probability < 1.0:
        raise InputError(f"A probability of {probability} is not possible: give one from 0 to 1.")
    counted = float(fit.diagnostics.get("effective_samples", math.inf))
    rows = []
    for parameter in (*fit.parameters, *fit.derived):
        draws = fit.sample(parameter.name)
        mean, sd = parameter.moments or (None, None)
        rows.append(
            SummaryRow(
                parameter.name,
                parameter.unit,
                mean,
                sd,
                parameter.q50,
                narrowest_interval(draws, probability),
                min(bulk_ess(draws[None, :]), counted),
                rank_r_hat(draws[None, :]),
                parameter.meaning,
            )
        )
    title = f"{fit.what}: {fit.candidate} ({fit.effort}), {len(fit.draws)} draws"
    return FitSummary(title, tuple(rows), probability, _notes(fit, rows))


def narrowest_interval(draws: Array, probability: float) -> tuple[float, float]:
    """The narrowest interval that holds ``probability`` of the draws (n,), as ArviZ' ``hdi``.

    NaN where a draw is not finite.

    >>> narrowest_interval(np.array([0.0, 1.0, 1.1, 1.2, 1.3, 9.0]), 0.5)
    (1.0, 1.3)
    """
    ordered = np.sort(draws)
    inside = int(np.floor(probability * len(ordered)))
    if not np.all(np.isfinite(ordered)) or not 0 < inside < len(ordered):
        return float("nan"), float("nan")
    first = int(np.argmin(ordered[inside:] - ordered[: len(ordered) - inside]))
    return float(ordered[first]), float(ordered[first + inside])


def _notes(fit: "FitResult", rows: Sequence[SummaryRow]) -> tuple[str, ...]:
    notes = []
    if fit.rejected:
        failed = ", ".join(verdict.check for verdict in fit.rejected)
        notes.append(f"Not a calibration, checks failed: {failed}.")
    heavy = [row.name for row in rows if row.mean is None]
    if heavy:
        notes.append(
            f"Mean and sd are left out where the quantiles say something else: {', '.join(heavy)}."
        )
    return tuple(notes)


def _number(value: float | None) -> str:
    return "-" if value is None else f"{value:.4g}"


def _aligned(cells: Sequence[str], widths: Sequence[int]) -> Iterator[str]:
    for place, (cell, width) in enumerate(zip(cells, widths, strict=True)):
        yield cell.ljust(width) if place < 2 else cell.rjust(width)
