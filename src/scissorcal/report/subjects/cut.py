"""The cut by itself: response of the material, fracture work by stroke, force along the edge."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from scissorcal.calibration.cut.curves import (
    FEWEST_STROKES,
    NOTICED,
    EdgePlace,
    ResponseCurve,
    StrokeWork,
    force_along_edge,
    fracture_work,
    response_curve,
)
from scissorcal.calibration.result import FitResult
from scissorcal.errors import ScissorcalError
from scissorcal.recording.recording import Recording
from scissorcal.report.numbers import percent, short, significant, with_decimals
from scissorcal.report.panel import (
    Axis,
    Chart,
    Look,
    Panel,
    Row,
    Series,
    Style,
    absent,
    band,
    count,
    curve,
    number,
    percent_of,
    points,
    words,
)
from scissorcal.report.strokes import FittedStroke, look_of, thinned

MOST_DOTS = 400
MOST_BARS = 24
OTHERS: tuple[tuple[Look, Style], ...] = (
    ("vermillion", "dashed"),
    ("green", "dotted"),
    ("purple", "dashed"),
    ("orange", "dotted"),
)


def response_panel(fit: FitResult, part: str) -> Panel:
    """Force at the edge against indentation, with the candidates that these data do not exclude."""
    title, id_ = "Response of the material", f"{part}-response"
    try:
        response = response_curve(fit)
    except ScissorcalError as error:
        return absent(id_, part, title, str(error))
    notes = [
        "Force at the edge against indentation at the crack tip. Measured torque becomes force by "
        "the lever of the model's crack tip."
    ]
    alike = [
        other.name for other in response.others if other.equivalent and other.force is not None
    ]
    if alike:
        notes.append(f"Equivalent in these data: {', '.join(alike)}.")
    undrawn = [other.name for other in response.others if other.equivalent and other.force is None]
    if undrawn:
        notes.append(
            f"Also equivalent, but not drawn, because this fit keeps no values of it: "
            f"{', '.join(undrawn)}."
        )
    low, high = (short(1e3 * v, 2) for v in (response.support_low, response.support_high))
    sentence = (
        f"Data press from {low} to {high} mm; there the response is known to "
        f"± {percent(response.half_width)} (median half of the 90 % band)."
    )
    chart = _response_chart(response, f"{id_}-f")
    return Panel(id_, part, title, sentence, charts=(chart,), notes=tuple(notes))


def _response_chart(response: ResponseCurve, id_: str) -> Chart:
    x = 1e3 * response.indentation
    at, force = response.data_indentation, response.data_force
    pressed = np.flatnonzero((at > 0) & (1e3 * at < x[-1]) & np.isfinite(force))
    some = thinned(pressed, MOST_DOTS)
    known = (response.indentation >= response.support_low) & (
        response.indentation <= response.support_high
    )
    series = [
        points("measured", 1e3 * at[some], force[some], "blue", toggle=True),
        band("90 % of the response", x, response.low, response.high),
        curve("beyond the data", x, response.force, style="dashed"),
        curve("used", x, np.where(known, response.force, np.nan)),
    ]
    drawn = sorted(
        (o for o in response.others if o.force is not None), key=lambda o: not o.equivalent
    )
    for other, (look, style) in zip(drawn, OTHERS, strict=False):
        assert other.force is not None
        name = other.name.partition(",")[0] + (" (equivalent)" if other.equivalent else "")
        series.append(curve(name, x, other.force, look, style=style, toggle=True))
    return Chart(
        id_,
        "Response and its candidates",
        Axis("indentation", "mm", low=0.0),
        Axis("force at the edge", "N"),
        tuple(series),
        "The line is full where data lie and dashed beyond; the shade holds it with 90 % "
        "probability.",
    )


def work_panel(
    fit: FitResult,
    friction: FitResult | None,
    recordings: Sequence[Recording],
    strokes: Sequence[FittedStroke],
    part: str,
) -> Panel:
    """Measured fracture work of each stroke against what the fit expects of it."""
    title, id_ = "Fracture work by stroke", f"{part}-work"
    names = {stroke.stroke: stroke for stroke in strokes if stroke.kind != "opening"}
    try:
        work = fracture_work(
            fit, friction, [r for r in recordings if len(r.samples)], sorted(names)
        )
    except ScissorcalError as error:
        return absent(id_, part, title, str(error))
    rows = tuple(
        Row(
            names[row.stroke].label + (" (pivot moved)" if row.pivot_moved else ""),
            (
                number("cut", 1e3 * row.length, "mm"),
                number("fracture work", 1e3 * row.fracture, "mJ", sd=1e3 * row.sd),
                number("expected", 1e3 * row.expected, "mJ",
                       low=1e3 * row.expected_low, high=1e3 * row.expected_high),
                percent_of("measured / expected", row.fracture / row.expected, 3),
                number("left in the material", 1e3 * row.stored, "mJ", digits=2),
            ),
            link=names[row.stroke].anchor,
            marked=row.differs,
        )
        for row in work
    )  # fmt: skip
    return Panel(
        id_,
        part,
        title,
        _work_sentence(work, [row.name for row in rows if row.marked]),
        rows,
        (_work_chart(work, names, f"{id_}-f"),),
        notes=(
            "Work of the torque over the whole stroke, less friction, inertia and what the pressed "
            "material still holds at its end. Expected is J_c h times the length of the cut by the "
            "model; where fracture ripples, its mean over a cycle.",
        ),
    )


def _work_sentence(strokes: Sequence[StrokeWork], odd: Sequence[str]) -> str:
    good = [row for row in strokes if not row.pivot_moved] or list(strokes)
    length, work, expected = (
        sum(getattr(row, key) for row in good) for key in ("length", "fracture", "expected")
    )
    sd = float(np.sqrt(sum(row.sd**2 for row in good)))
    sentence = (
        f"{significant(work / length)} ± {significant(sd / length, 2)} J/m: {len(good)} strokes "
        f"spent {significant(1e3 * work)} mJ on {significant(1e3 * length)} mm of cut; the fit "
        f"expects {significant(expected / length)} J/m."
    )
    return sentence + (f" Different from the fit: {'; '.join(odd[:3])}." if odd else "")


def _work_chart(strokes: Sequence[StrokeWork], names: dict, id_: str) -> Chart:  # type: ignore[type-arg]
    shown = strokes[:MOST_BARS]
    per = [(row.length or 1.0) for row in shown]
    work = [row.fracture / length for row, length in zip(shown, per, strict=True)]
    reach = [2 * row.sd / length for row, length in zip(shown, per, strict=True)]
    expected = Series(
        "expected, 90 %",
        "bars",
        tuple(row.expected_high / length for row, length in zip(shown, per, strict=True)),
        tuple(float(place) for place in range(len(shown))),
        low=tuple(row.expected_low / length for row, length in zip(shown, per, strict=True)),
        look="muted",
    )
    measured = points(
        "measured, ± 2 sd",
        work,
        range(len(shown)),
        look_of("closing"),
        low=[w - r for w, r in zip(work, reach, strict=True)],
        high=[w + r for w, r in zip(work, reach, strict=True)],
    )
    caption = "Marks are measured with two standard deviations, bars what the fit expects."
    if len(shown) < len(strokes):
        caption += f" The first {len(shown)} of {len(strokes)} strokes."
    low = min([w - r for w, r in zip(work, reach, strict=True)] + [v or 0.0 for v in expected.low])
    return Chart(
        id_,
        "Fracture work per metre of cut",
        Axis("fracture work", "J/m", low=0.97 * low if low > 0 else None),
        Axis(
            "",
            categories=tuple(names[row.stroke].label for row in shown),
            links=tuple(names[row.stroke].anchor for row in shown),
            reverse=True,
        ),
        (expected, measured),
        caption,
    )


def edge_panel(fit: FitResult, strokes: Sequence[FittedStroke], part: str) -> Panel:
    """Measured over modelled force by place along the edge."""
    title, id_ = "Force along the blade", f"{part}-edge"
    try:
        places = force_along_edge(fit, [stroke.places for stroke in strokes])
    except ScissorcalError as error:
        return absent(id_, part, title, str(error))
    rows = tuple(
        Row(
            " to ".join(with_decimals(1e3 * v, 1) for v in (p.station_low, p.station_high)) + " mm",
            (
                percent_of("measured / model", p.ratio, 3, low=p.low, high=p.high),
                count("strokes", p.strokes),
                words("reading", _reading(p)),
            ),
            marked=p.differs,
        )
        for p in places
    )
    return Panel(
        id_,
        part,
        title,
        edge_sentence(places),
        rows,
        (_edge_chart(places, f"{id_}-f"),),
        notes=(
            "Measured over modelled force by place along the edge, from the pivot. The model's "
            "material is the same everywhere, so a place that differs is blunt, nicked, loose or "
            "tight, or the model's response is wrong at the openings that reach it.",
        ),
        caption="Intervals hold for all places at once with 95 % probability.",
    )


def edge_sentence(places: Sequence[EdgePlace]) -> str:
    """What the places along the edge say, in words."""
    judged = [p for p in places if p.low is not None and p.high is not None]
    if not judged:
        return (
            f"Fewer than {FEWEST_STROKES} strokes touched each place, which is too few to judge "
            "the edge: record more strokes."
        )
    odd = [p for p in judged if p.differs]
    if not odd:
        width = max((p.high or 0.0) - (p.low or 0.0) for p in judged) / 2
        return (
            f"No place differs from the model between {short(1e3 * judged[0].station_low)} and "
            f"{short(1e3 * judged[-1].station_high)} mm from the pivot; a change of "
            f"{percent(width)} would show everywhere."
        )
    worst = max(odd, key=lambda p: abs(p.ratio - 1.0))
    more = "more" if worst.ratio > 1 else "less"
    sentence = (
        f"Between {short(1e3 * worst.station_low)} and {short(1e3 * worst.station_high)} mm from "
        f"the pivot the pair needs {percent(abs(worst.ratio - 1.0))} {more} force than the model "
        f"says (± {percent(0.5 * ((worst.high or 0.0) - (worst.low or 0.0)))})."
    )
    felt = [p for p in odd if abs(p.ratio - 1.0) >= NOTICED]
    if not felt:
        return f"{sentence} That is steady over strokes, but less than a hand notices."
    remedy = "a blunt spot or a nick" if worst.ratio > 1 else "play between the blades"
    others = f" {len(felt) - 1} more places differ." if len(felt) > 1 else ""
    return f"{sentence} A hand notices that: look there for {remedy}.{others}"


def _reading(place: EdgePlace) -> str:
    if not place.differs:
        return "as the model" if place.low is not None else "too few strokes"
    return "▲ harder" if place.ratio > 1 else "▼ lighter"


def _edge_chart(places: Sequence[EdgePlace], id_: str) -> Chart:
    series = []
    for name, look, kept in (
        ("as the model", "blue", [p for p in places if not p.differs]),
        ("different", "vermillion", [p for p in places if p.differs]),
    ):
        series.append(
            points(
                name,
                [500.0 * (p.station_low + p.station_high) for p in kept],
                [100 * p.ratio for p in kept],
                look,  # type: ignore[arg-type]
                low=[None if p.low is None else 100 * p.low for p in kept],
                high=[None if p.high is None else 100 * p.high for p in kept],
            )
        )
    ends = [1e3 * places[0].station_low, 1e3 * places[-1].station_high] if places else [0.0, 1.0]
    for share, style in ((1.0, "full"), (1 - NOTICED, "dashed"), (1 + NOTICED, "dashed")):
        name = "the model" if share == 1.0 else "what a hand notices"
        series.append(curve(name, ends, [100 * share] * 2, "muted", style=style))
    return Chart(
        id_,
        "Measured over modelled force along the edge",
        Axis("place along the edge, from the pivot", "mm"),
        Axis("measured / model", "%"),
        tuple(part for part in series if part.x),
        "Bars hold for all places at once with 95 % probability. Between the dashed lines a hand "
        "notices no difference.",
    )
