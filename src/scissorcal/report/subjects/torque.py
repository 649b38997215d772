"""Measured torque against the model: by group of strokes, by stroke, and what the model misses."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal

import numpy as np

from scissorcal.aliases import Array
from scissorcal.calibration.result import FitResult, rms_interval, worst_stroke
from scissorcal.recording.recording import Stroke
from scissorcal.report.numbers import Number, finite, percent, unit_text, with_unit
from scissorcal.report.panel import (
    Axis,
    Chart,
    Panel,
    Row,
    Series,
    absent,
    band,
    count,
    curve,
    number,
    percent_of,
    points,
)
from scissorcal.report.strokes import (
    KINDS,
    Against,
    FittedStroke,
    TorqueGroup,
    block_means,
    channels_of,
    group_strokes,
    kind_word,
    limits_of,
    look_of,
    mean,
    median,
    rms,
    stroke_label,
    thinned,
)

MOST_DOTS = 600
MOST_STROKES = 12
MOST_CHARTS = 12
MOST_CARDS = 12
MOST_BARS = 20
PROPOSED_BLOCKS = 40
SPREAD_DOTS = 900
OPENING_BLOCKS, TIME_BLOCKS = 60, 300

Over = Literal["opening", "rate", "time"]


def torque_panel(fit: FitResult, strokes: Sequence[FittedStroke], part: str) -> Panel:
    """Data against the model, a chart and a row for each group of strokes."""
    words = channels_of(fit)
    title = f"{words.effort.capitalize()}: data against the model"
    if not strokes:
        return absent(f"{part}-torque", part, title, "The fit holds no samples to show.")
    groups = group_strokes(fit, strokes)
    series = fit.series
    directed = [one.places for g in groups if g.against == "opening" for one in g.strokes]
    shared = np.concatenate(directed) if directed else np.zeros(0, np.int64)
    limits = limits_of(series.measured[shared], series.predicted[shared])
    charts = tuple(
        _group_chart(fit, group, f"{part}-torque{place}", limits)
        for place, group in enumerate(groups[:MOST_CHARTS])
    )
    residual = finite(rms(series.measured - series.predicted))
    size = rms(series.measured)
    share = percent(residual / size) if residual is not None and size > 0 else "not available"
    return Panel(
        f"{part}-torque",
        part,
        title,
        f"Measured minus model is {with_unit(residual, fit.effort_unit, 2)} rms, {share} of what "
        "was measured.",
        tuple(_group_row(fit, group) for group in groups),
        charts,
        notes=(
            "Marks are measured and thinned evenly, lines are the model, the shade holds its mean "
            "with 90 % probability; where none is seen, it is narrower than the line.",
        ),
    )


def strokes_panel(fit: FitResult, strokes: Sequence[FittedStroke], part: str) -> Panel:
    """Residuals by stroke from the worst: bars, spread, a chart for each of the worst strokes.

    The rank is by the error that a stroke is shown to have, the lower end of its interval: a stroke
    of few independent samples has a wide one, and does not lead by chance.
    """
    title, id_ = "Residuals by stroke, the worst first", f"{part}-residuals"
    ranked = sorted(strokes, key=lambda one: -_shown(fit, one, len(strokes)))
    if not ranked:
        return absent(id_, part, title, "The fit holds no strokes.")
    carded = {stroke.anchor for stroke in ranked[:MOST_CARDS]}
    rows = tuple(_residual_row(fit, stroke, carded) for stroke in ranked)
    charts: list[Chart] = []
    if finite(_rms(fit, ranked[0])) is not None:
        charts.append(_bars(fit, ranked[:MOST_BARS], rows, f"{part}-worst"))
        charts.append(_spread(fit, strokes, "opening", f"{part}-spread"))
        if fit.what != "cut":
            charts.append(_spread(fit, strokes, "rate", f"{part}-spread-rate"))
            charts.append(_spread(fit, strokes, "time", f"{part}-spread-time"))
    charts += [_card(fit, stroke) for stroke in ranked[:MOST_CARDS]]
    worst = ranked[0]
    sentence = (
        f"The model misses most on {worst.label}: "
        f"{with_unit(finite(_rms(fit, worst)), fit.effort_unit, 2)} rms."
    )
    caption = f"Measured minus model by stroke, in {unit_text(fit.effort_unit)}."
    return Panel(id_, part, title, sentence, rows, tuple(charts), caption=caption)


def _shown(fit: FitResult, stroke: FittedStroke, of: int) -> float:
    """The error that a stroke is shown to have, one ``of`` so many; -1 where there is none."""
    rms = finite(_rms(fit, stroke))
    if rms is None:
        return -1.0
    share = finite(fit.diagnostics.get("independent_share")) or 1.0
    return rms_interval(rms, share * len(stroke.places), 0.05 / of)[0]


def held_out_panel(fit: FitResult, strokes: Sequence[FittedStroke], part: str) -> Panel:
    """Error on strokes that the fit had not seen, from the worst."""
    title, id_ = "Hold-out error by stroke", f"{part}-heldout"
    if not fit.held_out:
        return absent(id_, part, title, "No stroke was held out.")
    names = {(stroke.stroke, stroke.recording): stroke for stroke in strokes}
    tail = 0.05 / len(fit.held_out)  # as in `worst_stroke`
    errors = sorted(
        fit.held_out,
        key=lambda e: (finite(e.interval(tail)[0]) or 0.0, finite(e.relative_rms) or -1.0),
        reverse=True,
    )
    rows, marks = [], []
    for error in errors:
        name = names.get((error.stroke, error.recording))
        kind = KINDS.get(error.kind, "excitation")
        label = (
            name.label if name else stroke_label(Stroke(0, kind), error.stroke, fit.position_unit)
        )
        speed = name.speed if name and name.speed is not None else finite(error.speed)
        low, high = error.interval()
        values = (
            percent_of("relative", error.relative_rms, low=low, high=high),
            number("rms", error.rms, fit.effort_unit),
        )
        rows.append(Row(label, values, link=name.anchor if name else ""))
        if speed and finite(error.relative_rms) is not None:
            marks.append((speed, 100 * error.relative_rms, kind))
    middle, worst = held_out_summary(fit)
    charts = (_held_out_chart(fit, marks, f"{part}-heldout-speed"),) if marks else ()
    sentence = (
        f"On strokes that it had not seen the model errs by {percent(middle)} (median rms, share "
        f"of the rms of all strokes); worst {percent(worst)}."
    )
    caption = (
        "With 90 % intervals by the independent samples of a stroke, ranked by their lower ends: "
        "a few samples may err by more by chance."
    )
    return Panel(id_, part, title, sentence, tuple(rows), charts, caption=caption)


def held_out_summary(fit: FitResult) -> tuple[Number, Number]:
    """Median relative error on unseen strokes, and that of the worst of them."""
    shares = np.array([e.relative_rms for e in fit.held_out], dtype=np.float64)
    worst = worst_stroke(fit.held_out)
    middle = finite(median(shares[np.isfinite(shares)]))
    return middle, None if worst is None else finite(worst.relative_rms)


def _held_out_chart(fit: FitResult, marks: Sequence[tuple[float, float, str]], id_: str) -> Chart:
    kinds = dict.fromkeys(kind for *_, kind in marks)
    series = tuple(
        points(
            kind_word(kind, fit.position_unit),
            [speed for speed, _, own in marks if own == kind],
            [error for _, error, own in marks if own == kind],
            look_of(kind),
        )
        for kind in kinds
    )
    return Chart(
        id_,
        "Hold-out error over speed",
        Axis("speed", channels_of(fit).rate_unit, log=True),
        Axis("hold-out error", "%", low=0.0),
        series,
        "Each mark is a stroke, predicted by a fit that had not seen it.",
    )


def _group_row(fit: FitResult, group: TorqueGroup) -> Row:
    series, at, unit = fit.series, group.places, fit.effort_unit
    residual = series.measured[at] - series.predicted[at]
    width = median(series.band_high[at] - series.band_low[at])
    return Row(
        group.title,
        (
            count("strokes", len(group.strokes)),
            count("samples", len(at)),
            number("rms residual", rms(residual), unit),
            number("width of the band", width, unit, digits=2),
        ),
    )


def _group_chart(
    fit: FitResult, group: TorqueGroup, id_: str, limits: tuple[float, float] | None
) -> Chart:
    shown = [group.strokes[i] for i in thinned(np.arange(len(group.strokes)), MOST_STROKES)]
    dots = MOST_DOTS // max(len(shown), 1)
    series: list[Series] = []
    for stroke in shown:
        series += _drawn(fit, stroke, group.against, dots)
    residual = fit.series.measured[group.places] - fit.series.predicted[group.places]
    caption = (
        f"{len(group.strokes)} stroke{'s' if len(group.strokes) != 1 else ''}, "
        f"{len(residual)} samples; rms of measured minus model "
        f"{with_unit(finite(rms(residual)), fit.effort_unit, 2)}."
    )
    if len(shown) < len(group.strokes):
        caption += f" {len(shown)} of the strokes are drawn."
    x, y = _axes(fit, group.against)
    if limits and group.against == "opening":
        y = Axis(y.label, y.unit, low=limits[0], high=limits[1])
    return Chart(id_, group.title, x, y, tuple(series), caption)


def _axes(fit: FitResult, against: Against) -> tuple[Axis, Axis]:
    words = channels_of(fit)
    x = Axis("time", "s") if against == "time" else Axis(words.position, words.unit)
    return x, Axis(words.effort, words.effort_unit)


def _drawn(fit: FitResult, stroke: FittedStroke, against: Against, dots: int) -> list[Series]:
    """A stroke's marks, and its model with the band, that are switched together."""
    series = fit.series
    start = series.time_s[stroke.places[0]]
    scale = channels_of(fit).scale
    where = scale * series.opening if against == "opening" else series.time_s - start
    some = thinned(stroke.places, dots)
    blocks = OPENING_BLOCKS if against == "opening" else TIME_BLOCKS
    x, y, low, high = (
        block_means(values[stroke.places], blocks)
        for values in (where, series.predicted, series.band_low, series.band_high)
    )
    key, label = stroke.anchor, stroke.label
    return [
        points(
            label, where[some], series.measured[some], look_of(stroke.kind), group=key, toggle=True
        ),
        band("band of the model", x, low, high, group=key),
        curve(f"model, {label}", x, y, group=key),
    ]


def _card(fit: FitResult, stroke: FittedStroke) -> Chart:
    against = stroke.against
    x, y = _axes(fit, against)
    residual = with_unit(finite(_rms(fit, stroke)), fit.effort_unit, 2)
    series = tuple(
        Series(**{**vars(one), "toggle": False})
        for one in _drawn(fit, stroke, against, MOST_DOTS // 3)
    )
    caption = f"Rms residual {residual}."
    return Chart(stroke.anchor, stroke.label, x, y, series, caption, small=True)


def _rms(fit: FitResult, stroke: FittedStroke) -> float:
    at = stroke.places
    return rms(fit.series.measured[at] - fit.series.predicted[at])


def _residual_row(fit: FitResult, stroke: FittedStroke, carded: set[str]) -> Row:
    series, at, words = fit.series, stroke.places, channels_of(fit)
    residual = series.measured[at] - series.predicted[at]
    scale, error = rms(series.measured[at]), rms(residual)
    known = np.flatnonzero(np.isfinite(residual))
    worst = known[np.argmax(np.abs(residual[known]))] if len(known) else None
    anchor = stroke.anchor

    def at_worst(values: Array) -> float | None:
        return None if worst is None else values[worst]

    return Row(
        stroke.label,
        (
            number("rms", error, fit.effort_unit),
            percent_of("relative", error / scale if scale > 0 else None),
            number("mean", mean(residual), fit.effort_unit, digits=2),
            number("largest", at_worst(residual), fit.effort_unit, digits=2),
            number(f"at {words.position}", at_worst(words.scale * series.opening[at]), words.unit),
            number("at time", at_worst(series.time_s[at]), "s", digits=4),
            count("samples", len(at)),
        ),
        link=anchor if anchor in carded else "",
        anchor="" if anchor in carded else anchor,
    )


def _bars(fit: FitResult, ranked: Sequence[FittedStroke], rows: Sequence[Row], id_: str) -> Chart:
    size = [_rms(fit, stroke) for stroke in ranked]
    at = fit.series.measured - fit.series.predicted
    bias = [abs(mean(at[stroke.places])) for stroke in ranked]
    series = [
        Series(
            kind_word(kind, fit.position_unit),
            "bars",
            tuple(finite(v) for v, s in zip(size, ranked, strict=True) if s.kind == kind),
            tuple(float(i) for i, s in enumerate(ranked) if s.kind == kind),
            look=look_of(kind),
        )
        for kind in dict.fromkeys(stroke.kind for stroke in ranked)
    ]
    series.append(points("size of the mean", bias, range(len(ranked)), "ink"))
    caption = (
        "Bars are the rms of measured minus model, dots the size of its mean: a dot at the end of "
        "its bar shows an offset, one near zero scatter or ripple."
    )
    if len(ranked) < len(rows):
        caption += f" The {len(ranked)} worst of {len(rows)} strokes; the table has all."
    return Chart(
        id_,
        "Strokes from the worst",
        Axis("rms residual", fit.effort_unit, low=0.0),
        Axis(
            "",
            categories=tuple(stroke.label for stroke in ranked),
            links=tuple(stroke.anchor for stroke in ranked),
            reverse=True,
        ),
        tuple(series),
        caption,
    )


def _spread(fit: FitResult, strokes: Sequence[FittedStroke], against: Over, id_: str) -> Chart:
    """Residuals over a quantity, and what the critic's proposals add to the law there."""
    series, words = fit.series, channels_of(fit)
    residual = series.measured - series.predicted
    where, x = {
        "opening": (words.scale * series.opening, Axis(words.position, words.unit)),
        "rate": (series.opening_rate, Axis(f"{words.position} rate", words.rate_unit)),
        "time": (_elapsed(fit), Axis("time", "s")),
    }[against]
    kinds = list(dict.fromkeys(stroke.kind for stroke in strokes))
    marks = []
    for kind in kinds:
        places = np.concatenate([s.places for s in strokes if s.kind == kind])
        some = thinned(places, SPREAD_DOTS // len(kinds))
        name = kind_word(kind, fit.position_unit)
        marks.append(points(name, where[some], residual[some], look_of(kind), toggle=True))
    caption = "All strokes. A bend or a step that recurs is structure that the model lacks."
    if fit.proposed is not None:
        names = ", ".join(proposal.name for proposal in fit.critic)
        for way, opens in (("closing", False), ("opening", True)):
            here = np.flatnonzero((series.opening_rate > 0.0) == opens)
            line = _means(where[here], fit.proposed[here])
            marks.append(curve(f"{names}, {way}", *line, look_of(way), toggle=True))
        caption += f" Lines: what the critic's {names} would add, the mean over each direction."
    title = f"Residuals over the {x.label}"
    return Chart(id_, title, x, Axis("measured − model", fit.effort_unit), tuple(marks), caption)


def _means(where: Array, torque: Array) -> tuple[Array, Array]:
    """Means of a quantity and a torque (n,) over stretches of the former with as many points."""
    order = np.argsort(where, kind="stable")
    x, y = (block_means(values[order], PROPOSED_BLOCKS) for values in (where, torque))
    return x, y


def _elapsed(fit: FitResult) -> Array:
    """Time (n,) with the recordings one after the other."""
    series = fit.series
    ends = np.zeros(int(series.recording.max(initial=0)) + 1)
    np.maximum.at(ends, series.recording, series.time_s)
    return np.asarray(series.time_s + (np.cumsum(ends) - ends)[series.recording])
