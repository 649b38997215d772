"""The posterior two by two, and what it adds to the prior."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from scissorcal.calibration.checks import PRIOR_ONLY
from scissorcal.calibration.result import FitResult
from scissorcal.report.numbers import Number, finite, finite_each, short, significant, unit_text
from scissorcal.report.panel import Panel, Row, Table, absent, columns
from scissorcal.report.reduce import Array, thinned
from scissorcal.report.svg import BLUE, INK, MUTED, VERMILLION, Svg, finish, new_grid

MOST_PAIRED = 8
MOST_DOTS = 70
STRONG = 0.8
"""Correlation from which two parameters are said to trade against each other."""
BINS = 24
WIDE = 20.0
"""A range whose ends differ by this factor is drawn over a logarithmic axis."""
QUANTILES = (0.05, 0.25, 0.5, 0.75, 0.95)


@dataclass(frozen=True)
class Correlation:
    """Correlation of two parameters' posterior."""

    first: str
    second: str
    correlation: Number


@dataclass(frozen=True)
class PriorRow:
    """One parameter's prior and posterior: quantiles at 5, 25, 50, 75 and 95 %, in ``unit``.

    ``narrowed`` is the posterior's standard deviation over the prior's, where the parameter has no
    bounds (its logarithm, for positive ones).
    """

    name: str
    unit: str
    prior: tuple[Number, ...]
    posterior: tuple[Number, ...]
    narrowed: Number


def correlate(fit: FitResult) -> tuple[Correlation, ...]:
    """Every pair of parameters, the most strongly correlated first; empty without numbers."""
    if len(fit.draws) < 3 or len(fit.parameters) < 2 or not np.all(np.isfinite(fit.draws)):
        return ()
    names = [parameter.name for parameter in fit.parameters]
    moving = fit.draws.std(axis=0) > 0
    with np.errstate(invalid="ignore", divide="ignore"):
        matrix = np.corrcoef(fit.draws, rowvar=False).reshape(len(names), len(names))
    found = [
        Correlation(names[i], names[j], finite(matrix[i, j]))
        for i in range(len(names))
        for j in range(i)
        if moving[i] and moving[j]
    ]
    return tuple(sorted(found, key=lambda row: -abs(row.correlation or 0.0)))


def show_pairs(fit: FitResult, section: tuple[Correlation, ...], anchor: str) -> Panel:
    """The panel: strong correlations in words, the pair plot."""
    title, where = "Parameters two by two", f"{anchor}-pairs"
    if not section:
        return absent(where, title, "There are no two parameters with numbers to compare.")
    strong = [row for row in section if abs(row.correlation or 0.0) >= STRONG]
    if strong:
        words = ", ".join(
            f"{row.first} with {row.second} ({significant(row.correlation, 2)})"
            for row in strong[:6]
        )
        finding = (
            f"These trade against each other, so their sum or ratio is known better than either: "
            f"{words}."
        )
    else:
        top = section[0]
        finding = (
            f"No two parameters are correlated by {STRONG} or more; the most are {top.first} and "
            f"{top.second} with {significant(top.correlation, 2)}."
        )
    return Panel(where, title, (), finding, (_draw_pairs(fit, where),), wide=True)


def compare_prior(fit: FitResult) -> tuple[PriorRow, ...]:
    """Prior against posterior by parameter; empty where the fit keeps no draws of its prior."""
    prior = fit.prior_draws
    if prior is None or len(prior) < 3 or not np.all(np.isfinite(fit.draws)):
        return ()
    return tuple(
        PriorRow(
            parameter.name,
            parameter.unit,
            finite_each(np.quantile(prior[:, i], QUANTILES)),
            finite_each(np.quantile(fit.draws[:, i], QUANTILES)),
            None if parameter.believed else finite(parameter.identifiability),
        )
        for i, parameter in enumerate(fit.parameters)
    )


def show_prior(fit: FitResult, section: tuple[PriorRow, ...], anchor: str) -> Panel:
    """The panel: both densities by parameter, and the quantiles as a table."""
    title, where = "Prior against posterior", f"{anchor}-prior"
    if not section:
        why = f"This fit keeps no draws of its prior: run `scissorcal fit {fit.what} --force`."
        return absent(where, title, why)
    silent = [row.name for row in section if (row.narrowed or 0.0) > PRIOR_ONLY]
    said = ", ".join(silent)
    finding = (
        f"The data add nothing to the prior of {said}."
        if silent
        else "The data narrow every parameter well beyond its prior."
    )
    found = tuple(
        Row(
            (
                row.name,
                unit_text(row.unit),
                f"{short(row.prior[0])} to {short(row.prior[-1])}",
                f"{short(row.posterior[0])} to {short(row.posterior[-1])}",
                significant(row.narrowed, 2),
            ),
            marked=(row.narrowed or 0.0) > PRIOR_ONLY,
        )
        for row in section
    )
    heads = columns("Parameter", "=Unit", "Prior, 90 %", "Posterior, 90 %", "Posterior / prior sd")
    table = Table("What was believed before, and after.", heads, found)
    return Panel(where, title, (), finding, (_draw_prior(fit, where),), table, wide=True)


def _draw_pairs(fit: FitResult, anchor: str) -> Svg:
    shown = _paired(fit)
    count = len(shown)
    figure, axes = new_grid((0.9 + 1.05 * count, 0.8 + 1.05 * count), count, count)
    some = thinned(np.arange(len(fit.draws)), MOST_DOTS)
    for row in range(count):
        for column in range(count):
            one = axes[row, column]
            if column > row:
                one.axis("off")
                continue
            x, y = fit.draws[:, shown[column]], fit.draws[:, shown[row]]
            one.locator_params(nbins=2)
            if row == column:
                heights, ends = np.histogram(x, BINS)
                one.stairs(heights, ends, color=BLUE, lw=1.2)
                one.set_yticks([])
            else:
                one.plot(x[some], y[some], "o", color=BLUE, ms=2.0, mew=0, alpha=0.7)
                _put_ellipse(one, x, y)
            _label(
                fit, one, shown[column], shown[row], row == count - 1, column == 0, row == column
            )
    caption = (
        "Dots are draws, the ellipse holds 90 % where the posterior is normal; on the diagonal "
        "each alone."
    )
    if count < len(fit.parameters):
        caption += f" The {count} that are most correlated of {len(fit.parameters)} parameters."
    top = correlate(fit)[0]
    reading = (
        f"{caption} Strongest: {top.first} with {top.second}, {significant(top.correlation, 2)}."
    )
    return finish(figure, f"{anchor}-f", "Pairs of the posterior", caption, reading)


def _paired(fit: FitResult) -> list[int]:
    names = [parameter.name for parameter in fit.parameters]
    order: list[str] = []
    for row in correlate(fit):
        order += [name for name in (row.first, row.second) if name not in order]
    return sorted(names.index(name) for name in order[:MOST_PAIRED])


def _label(
    fit: FitResult,
    axes: object,
    column: int,
    row: int,
    bottom: bool,
    left: bool,
    diagonal: bool,
) -> None:
    from matplotlib.axes import Axes

    assert isinstance(axes, Axes)
    axes.tick_params(labelsize=6.5, length=2)
    if bottom:
        axes.set_xlabel(fit.parameters[column].name.replace("_", " "), fontsize=7.5)
    else:
        axes.set_xticklabels([])
    if left and not diagonal:
        axes.set_ylabel(fit.parameters[row].name.replace("_", " "), fontsize=7.5)
    elif not left:
        axes.set_yticklabels([])


def _put_ellipse(axes: object, x: Array, y: Array) -> None:
    from matplotlib.axes import Axes

    assert isinstance(axes, Axes)
    values, vectors = np.linalg.eigh(np.cov(x / x.std(), y / y.std()))
    angle = np.linspace(0, 2 * np.pi, 60)
    circle = np.stack([np.cos(angle), np.sin(angle)])
    ring = vectors @ (np.sqrt(4.605 * np.maximum(values, 0))[:, None] * circle)
    axes.plot(x.mean() + x.std() * ring[0], y.mean() + y.std() * ring[1], color=INK, lw=0.9)


def _draw_prior(fit: FitResult, anchor: str) -> Svg:
    assert fit.prior_draws is not None
    count = len(fit.parameters)
    wide = min(count, 4)
    tall = -(-count // wide)
    figure, axes = new_grid((0.4 + 1.75 * wide, 0.5 + 1.35 * tall), tall, wide)
    figure.subplots_adjust(hspace=0.75, wspace=0.15, left=0.03)
    for one in axes.ravel()[count:]:
        one.axis("off")
    for i, (parameter, one) in enumerate(zip(fit.parameters, axes.ravel(), strict=False)):
        prior, after = fit.prior_draws[:, i], fit.draws[:, i]
        low, high = np.quantile(np.concatenate([prior, after]), [0.02, 0.98])
        low, high = min(low, after.min()), max(high, after.max())
        wide = low > 0 and high > WIDE * low
        edges = np.linspace(low, high if high > low else low + 1.0, 2 * BINS)
        if wide:
            edges = np.geomspace(low, high, 2 * BINS)
            one.set_xscale("log")
        for values, colour, dashes in ((prior, VERMILLION, "--"), (after, BLUE, "-")):
            heights = np.histogram(values, edges)[0].astype(np.float64)
            top = max(float(heights.max()), 1.0)
            x = np.repeat(edges, 2)[1:-1]
            one.plot(x, np.repeat(heights / top, 2), color=colour, lw=1.3, ls=dashes)
        one.set_yticks([])
        if wide:
            one.minorticks_off()
            one.set_xticks(
                ticks := [float(low * (high / low) ** share) for share in (0.1, 0.5, 0.9)],
                labels=[short(tick, 1) for tick in ticks],
            )
        else:
            one.locator_params(axis="x", nbins=3)
        one.tick_params(labelsize=6.5, length=2)
        one.set_title(parameter.name.replace("_", " "), fontsize=7.5, color=INK, pad=2)
        one.set_xlabel(unit_text(parameter.unit), fontsize=6.5, color=MUTED, labelpad=1)
    caption = (
        "Dashed is the prior, full the posterior, each scaled to its own height; axes with a wide "
        "range are logarithmic."
    )
    return finish(figure, f"{anchor}-f", "Prior and posterior of each parameter", caption)
