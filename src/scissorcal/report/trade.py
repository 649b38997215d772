"""The page of `bench trade`: what accuracy costs, one diagram and one table a knob."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from html import escape
from typing import TYPE_CHECKING

from scissorcal.report.html import made_line, panel_section, parts_nav, prose, whole_page
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
    panels = [trade_panel(one, trade) for one in trade.curves]
    if trade.together is not None:
        panels.insert(0, trade_panel(trade.together, trade))
    body = f'<main id="report">{_head(trade)}{parts_nav([(p.id, p.title) for p in panels])}'
    body += "".join(panel_section(panel, open_=True) for panel in panels)
    return whole_page(f"{trade.recipe_name}: what accuracy costs", body + "</main>")


def trade_panel(found: Curve, trade: Trade) -> Panel:
    """One knob: its sentence, its diagram and the table of its settings."""
    if found.missing:
        return Panel(found.knob, "trade", found.title, notes=(found.missing,))
    if not found.points:
        return Panel(found.knob, "trade", found.title, notes=found.sentences)
    sentence, *notes = found.sentences or ("",)
    chart = trade_chart(found, trade)
    return Panel(
        found.knob,
        "trade",
        found.title,
        sentence,
        rows=tuple(_row(point) for point in found.points),
        charts=(chart,) if chart else (),
        notes=(f"Errors are counted against {found.against}.", *notes, *_notes(found)),
        caption="Median of the repeats, and their lowest and highest where there are several. "
        "Errors in % are of the scene's largest torque; × is the time as a multiple of the "
        f"baseline step ({short(trade.baseline.median)} ms of processor time).",
    )


def trade_chart(found: Curve, trade: Trade) -> Chart | None:
    """The work-precision diagram of a knob; None where no point has both a cost and an error."""
    placed = [(p, *where) for p in found.points if (where := _place(found, p))]
    if not placed:
        return None
    in_percent = all(p.errors[found.error].share is not None for p, _, _ in placed)
    unit = "% of the scene's torque" if in_percent else placed[0][0].errors[found.error].unit
    known = [p.costs[found.cost].median for p in found.points if p.reference]
    costs = [x for _, x, _ in placed] + [x for x in known if x > 0.0]
    errors = [y for _, _, y in placed]
    levels = {"tolerance": 100.0 * trade.tolerance, "limit of one knob": 100.0 * trade.limit}
    if not in_percent:
        levels = {}
    elif found == trade.together:
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
    failed = [p.setting.label for p in found.points if p.failed]
    return Chart(
        id=f"{found.knob}-diagram",
        title=f"{found.title}: error over cost",
        x=Axis(found.cost, placed[0][0].costs[found.cost].unit, log=True, low=low, high=high),
        y=Axis(found.error, unit, log=True, low=least, high=most),
        series=tuple(series),
        caption=f"Failed: {', '.join(failed)}." if failed else "",
    )


def standalone_svg(chart: Chart) -> str:
    """A diagram as a separate file, with the page's light colours."""
    drawn = svg(chart).replace("<svg ", '<svg xmlns="http://www.w3.org/2000/svg" ', 1)
    head, end, rest = drawn.partition(">")
    return f"{head}{end}<style>{STANDALONE}</style>{rest}\n"


def _head(trade: Trade) -> str:
    origin = "simulated data of the virtual rig" if trade.simulated else "data of a real rig"
    made = made_line(trade.created.strftime("%Y-%m-%d %H:%M %Z"), trade.scissorcal_version)
    said = "".join(f"<li>{prose(sentence)}</li>" for sentence in trade.sentences)
    listed = f"<ul>{said}</ul>" if said else "<p>Nothing can be recommended yet.</p>"
    facts = {
        "Data": f"{trade.material}; {origin}",
        "Computer": trade.machine,
        "Measured": f"{trade.measured} samples, {trade.measured_now} of them by this run, in "
        f"{short(trade.seconds)} s"
        + (f" of {short(trade.budget_s)} s allowed" if trade.budget_s is not None else "")
        + f", {trade.workers} at a time",
        "Limit of one knob": f"{percent(trade.limit)} of the scene's largest torque: the "
        f"tolerance of {percent(trade.tolerance)} over the number of knobs whose main error is one "
        "of torque; a convention, no guarantee",
    }
    rows = "".join(f"<dt>{name}</dt><dd>{escape(text)}</dd>" for name, text in facts.items())
    notes = "".join(f'<p class="note">{prose(note)}</p>' for note in trade.notes)
    return (
        '<section id="decision" class="plain"><p class="kicker">What accuracy costs, measured</p>'
        f"<h1>{escape(trade.recipe_name)}</h1>{made}<dl>{rows}</dl><h2>Recommended</h2>{listed}"
        f"<p>{HOW_TO_READ}</p>{notes}</section>"
    )


def _row(point: Point) -> Row:
    marks = ", ".join(_words_of(point))
    name = f"{point.setting.label} ({marks})" if marks else point.setting.label
    if point.failed:
        return Row(name, (), f"Failed: {point.failed}")
    values = [value for key, spread in point.costs.items() for value in _cost(key, spread)]
    values += [_error(key, error) for key, error in point.errors.items()]
    notes = list(point.notes)
    if point.rejected:
        notes.append(f"Failed checks: {', '.join(point.rejected)}.")
    return Row(name, tuple(values), " ".join(notes), marked=point.recommended)


def _words_of(point: Point) -> list[str]:
    known = {
        "present": point.setting.present,
        "recommended": point.recommended,
        "Pareto front": point.front,
        "reference": point.reference,
    }
    return [word for word, is_so in known.items() if is_so]


def _cost(name: str, spread: Spread) -> list[Value]:
    several = spread.repeats > 1 and spread.low < spread.high
    ends = {"low": spread.low, "high": spread.high} if several else {}
    found = [number(name, spread.median, spread.unit, **ends)]
    if spread.ratio is not None:
        found.append(number(f"{name}, ×", spread.ratio))
    return found


def _error(name: str, error: Error) -> Value:
    if error.share is not None:
        return percent_of(name, error.share)
    return number(name, error.value, error.unit)


def _notes(found: Curve) -> tuple[str, ...]:
    rejected = [p.setting.label for p in found.points if p.rejected]
    if not rejected:
        return ()
    return (f"Settings that failed a check: {', '.join(rejected)}; the table names it.",)


def _place(found: Curve, point: Point) -> tuple[float, float] | None:
    """Cost and error of a point on the axes, errors of torque in percent; None without both."""
    if found.cost not in point.costs or found.error not in point.errors:
        return None
    error = point.errors[found.error]
    value = error.value if error.share is None else 100.0 * error.share
    cost = point.costs[found.cost].median
    return (cost, value) if cost > 0.0 and value > 0.0 else None


def _lines(placed: Sequence[tuple[Point, float, float]]) -> list[Series]:
    methods = dict.fromkeys(point.setting.method for point, _, _ in placed)
    found = []
    for method in methods:
        own = sorted((x, y) for point, x, y in placed if point.setting.method == method)
        if len(own) > 1:
            found.append(
                curve(method or "settings", [x for x, _ in own], [y for _, y in own], "muted")
            )
    return found


def _marks(placed: Sequence[tuple[Point, float, float]]) -> list[Series]:
    """Points by what they are: others, on the front, present, recommended."""
    kinds: tuple[tuple[str, str, str], ...] = (
        ("dominated", "muted", "full"),
        ("Pareto front", "blue", "full"),
        ("present", "vermillion", "open"),
        ("recommended", "green", "open"),
    )
    found = []
    for name, look, style in kinds:
        own = [
            (p, x, y)
            for p, x, y in placed
            if {
                "dominated": not p.front,
                "Pareto front": p.front,
                "present": p.setting.present,
                "recommended": p.recommended,
            }[name]
        ]
        if own:
            drawn = points(name, [x for _, x, _ in own], [y for _, _, y in own], look, style=style)  # type: ignore[arg-type]
            if name in ("dominated", "Pareto front"):
                drawn = replace(drawn, labels=tuple(p.setting.label for p, _, _ in own))
            found.append(drawn)
    return found
