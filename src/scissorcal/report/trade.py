"""The page of `bench trade`: what accuracy costs, one diagram and one table a knob."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING

from scissorcal.report.html import panels_page
from scissorcal.report.numbers import percent, short
from scissorcal.report.panel import (
    Axis,
    Chart,
    Look,
    Panel,
    Row,
    Series,
    Style,
    Value,
    curve,
    number,
    percent_of,
    points,
    words,
)
from scissorcal.report.svg import svg

if TYPE_CHECKING:
    from scissorcal.bench.trade.point import Curve, Error, Point, Spread
    from scissorcal.bench.trade.result import Trade

HOW_TO_READ = (
    "Each diagram shows the error that a setting leaves over what it costs: both axes are "
    "logarithmic, lower left is better. Lines join settings of one method. The dashed line is the "
    "scene's tolerance, the dotted one the part of it that one knob may use."
)

LEVELS: Mapping[str, tuple[Look, Style]] = {
    "tolerance": ("vermillion", "dashed"),
    "limit of one knob": ("muted", "dotted"),
}
"""How the lines are drawn below which errors should stay."""

MARKS: Mapping[str, Callable[[Point], bool]] = {
    "present": lambda point: point.setting.present,
    "recommended": lambda point: point.recommended,
    "Pareto front": lambda point: point.front,
    "reference": lambda point: point.reference,
}
"""What a setting is marked as."""

LOOKS: Mapping[str, tuple[Look, Style]] = {
    "dominated": ("muted", "full"),
    "Pareto front": ("blue", "full"),
    "present": ("vermillion", "open"),
    "recommended": ("green", "open"),
}
"""How points are drawn, in this order; full ones carry their label."""

ROOM = 1.6
"""Free room about the points of a diagram, as a factor on its logarithmic axes."""

STANDALONE = """
svg { font: 11px system-ui, "Segoe UI", Roboto, "Noto Sans", sans-serif; background: #fff; }
text { fill: #1b1f24; } .mid { text-anchor: middle; } .end { text-anchor: end; }
.cell { font-size: 9px; } .grid path { stroke: #dde1e5; stroke-width: .8; }
.s { color: #1b1f24; } .muted { color: #5b6570; } .blue { color: #0072b2; }
.green { color: #009e73; } .vermillion { color: #d55e00; } .orange { color: #b87700; }
.purple { color: #b8568f; }
.s path { fill: currentColor; } .s.line path { fill: none; stroke: currentColor;
stroke-width: 1.5; } .s.dashed path { stroke-dasharray: 5 3; }
.s.dotted path { stroke-dasharray: 1.5 2.5; }
.s.points path.large { stroke: currentColor; stroke-width: 1.5; }
.s.points.open path { fill-opacity: 0; } .s.points path.error { stroke-width: 1.4;
stroke: currentColor; }
"""
"""Styles of a diagram in a separate file: the page's, in its light colours."""


def trade_page(trade: Trade) -> str:
    """The offline page: recommendations, all settings at once, then knob by knob."""
    return panels_page(
        "What accuracy costs, measured",
        trade.recipe_name,
        trade_panels(trade),
        made=(trade.created, trade.scissorcal_version),
        findings=trade.sentences or ("Nothing can be recommended yet.",),
    )


def trade_panels(trade: Trade) -> list[Panel]:
    """How it was measured, all recommended settings at once, then knob by knob."""
    curves = [*([trade.together] if trade.together else []), *trade.curves]
    return [_measured(trade), *(_knob(curve, trade) for curve in curves)]


def _measured(trade: Trade) -> Panel:
    origin = "simulated data of the virtual rig" if trade.simulated else "data of a real rig"
    allowed = f" of {short(trade.budget_s)} s allowed" if trade.budget_s is not None else ""
    facts = {
        "data": f"{trade.material}; {origin}",
        "computer": trade.machine,
        "measured": f"{trade.measured} samples, {trade.measured_now} of them by this run, in "
        f"{short(trade.seconds)} s{allowed}, {trade.workers} at a time",
        "limit of one knob": f"{percent(trade.limit)} of the scene's largest torque: the "
        f"tolerance of {percent(trade.tolerance)} over the number of knobs whose main error is one "
        "of torque; a convention, no guarantee",
    }
    rows = tuple(Row(name, (words("this run", text),)) for name, text in facts.items())
    return Panel(
        "run", "trade", "How it was measured", rows=rows, notes=trade.notes, caption=HOW_TO_READ
    )


def _knob(knob: Curve, trade: Trade) -> Panel:
    """One knob: its sentence, its diagram and the table of its settings, main figures first."""
    if knob.missing or not knob.points:
        why = (knob.missing,) if knob.missing else knob.sentences
        return Panel(knob.knob, "trade", knob.title, notes=why)
    sentence, *notes = knob.sentences or ("",)
    chart = trade_chart(knob, trade)
    return Panel(
        knob.knob,
        "trade",
        knob.title,
        sentence,
        rows=tuple(_row(point, knob) for point in knob.points),
        charts=(chart,) if chart else (),
        notes=(f"Errors are counted against {knob.against}.", *notes),
        caption="Median of the repeats, and their lowest and highest where there are several. "
        "Errors in % are of the scene's largest torque; × is the time as a multiple of the "
        f"baseline step ({short(trade.baseline.median)} ms of processor time).",
    )


def trade_chart(knob: Curve, trade: Trade) -> Chart | None:
    """The work-precision diagram of a knob; None where no point has both a cost and an error."""
    placed = [(p, *where) for p in knob.points if (where := _place(knob, p))]
    if not placed:
        return None
    in_percent = all(p.errors[knob.error].share is not None for p, _, _ in placed)
    unit = "% of the scene's torque" if in_percent else placed[0][0].errors[knob.error].unit
    known = [p.costs[knob.cost].median for p in knob.points if p.reference]
    costs = [x for _, x, _ in placed] + [x for x in known if x > 0.0]
    errors = [y for _, _, y in placed]
    levels = {"tolerance": 100.0 * trade.tolerance, "limit of one knob": 100.0 * trade.limit}
    if not in_percent:
        levels = {}
    elif knob == trade.together:
        del levels["limit of one knob"]
    low, high = min(costs) / ROOM, max(costs) * ROOM
    least, most = min([*errors, *levels.values()]) / ROOM, max([*errors, *levels.values()]) * ROOM
    series = [*_lines(placed), *_marks(placed)]
    series += [
        curve("cost of the reference", (x, x), (least, most), "ink", style="dotted") for x in known
    ]
    for name, level in levels.items():
        look, style = LEVELS[name]
        series.append(curve(name, (low, high), (level, level), look, style=style))
    failed = [p.setting.label for p in knob.points if p.failed]
    return Chart(
        id=f"{knob.knob}-diagram",
        title=f"{knob.title}: error over cost",
        x=Axis(knob.cost, placed[0][0].costs[knob.cost].unit, log=True, low=low, high=high),
        y=Axis(knob.error, unit, log=True, low=least, high=most),
        series=tuple(series),
        caption=f"Failed: {', '.join(failed)}." if failed else "",
    )


def standalone_svg(chart: Chart) -> str:
    """A diagram as a separate file, with the page's light colours."""
    drawn = svg(chart).replace("<svg ", '<svg xmlns="http://www.w3.org/2000/svg" ', 1)
    head, end, rest = drawn.partition(">")
    return f"{head}{end}<style>{STANDALONE}</style>{rest}\n"


def _row(point: Point, knob: Curve) -> Row:
    marks = ", ".join(mark for mark, is_so in MARKS.items() if is_so(point))
    name = f"{point.setting.label} ({marks})" if marks else point.setting.label
    if point.failed:
        return Row(name, (), f"Failed: {point.failed}")
    values = [value for key, spread in point.costs.items() for value in _cost(key, spread)]
    values += [_error(key, error) for key, error in point.errors.items()]
    values.sort(key=lambda value: value.name not in (knob.cost, knob.error))
    notes = list(point.notes)
    if point.rejected:
        notes.append(f"Failed checks: {', '.join(point.rejected)}.")
    return Row(name, tuple(values), " ".join(notes), marked=point.recommended)


def _cost(name: str, spread: Spread) -> list[Value]:
    several = spread.repeats > 1 and spread.low < spread.high
    ends = {"low": spread.low, "high": spread.high} if several else {}
    values = [number(name, spread.median, spread.unit, **ends)]
    if spread.ratio is not None:
        values.append(number(f"{name}, ×", spread.ratio))
    return values


def _error(name: str, error: Error) -> Value:
    if error.share is not None:
        return percent_of(name, error.share)
    return number(name, error.value, error.unit)


def _place(knob: Curve, point: Point) -> tuple[float, float] | None:
    """Cost and error of a point on the axes, errors of torque in percent; None without both."""
    if knob.cost not in point.costs or knob.error not in point.errors:
        return None
    error = point.errors[knob.error]
    value = error.value if error.share is None else 100.0 * error.share
    cost = point.costs[knob.cost].median
    return (cost, value) if cost > 0.0 and value > 0.0 else None


def _lines(placed: Sequence[tuple[Point, float, float]]) -> list[Series]:
    lines = []
    for method in dict.fromkeys(point.setting.method for point, _, _ in placed):
        line = sorted((x, y) for point, x, y in placed if point.setting.method == method)
        if len(line) > 1:
            x, y = zip(*line, strict=True)
            lines.append(curve(method or "settings", x, y, "muted"))
    return lines


def _marks(placed: Sequence[tuple[Point, float, float]]) -> list[Series]:
    """Points by what they are: others, on the front, present, recommended."""
    series = []
    for name, (look, style) in LOOKS.items():
        marked = [place for place in placed if MARKS.get(name, _dominated)(place[0])]
        if marked:
            settings, x, y = zip(*marked, strict=True)
            labels = tuple(point.setting.label for point in settings) if style == "full" else ()
            series.append(points(name, x, y, look, style=style, labels=labels))
    return series


def _dominated(point: Point) -> bool:
    return not point.front
