"""Force along the blade: where along the edge the pair cuts harder or lighter than the model."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from scissorcal.calibration.result import FitResult
from scissorcal.model import edge_height
from scissorcal.report.numbers import Number, finite, percent, short, with_decimals
from scissorcal.report.panel import Panel, Row, Table, absent, columns
from scissorcal.report.reduce import Array
from scissorcal.report.sections.law import cutting_of
from scissorcal.report.strokes import StrokeSamples
from scissorcal.report.svg import BLUE, INK, MUTED, PANEL, VERMILLION, Svg, finish, new_axes

PLACES = 12
"""At most so many places along the edge, each some millimetres long."""
SHORTEST_M = 2e-3
FELT_SHARE = 0.1
"""Samples whose torque is below this share of the largest say little about the edge."""
FEWEST_SAMPLES = 5
FEWEST_STROKES = 3
FALSE_ALARM = 0.05
FELT = 0.07
"""A change of force that people just notice (Jones 2000, Kinesthetic sensing)."""


@dataclass(frozen=True)
class EdgePlace:
    """Measured over modelled force on one stretch of the edge, stations from the pivot in m.

    ``ratio`` is the mean over strokes and ``low``, ``high`` its interval, which holds for all
    places at once with 95 % probability; None with fewer than three strokes there.
    ``conspicuous`` says that the interval leaves out 1.
    """

    station_low: float
    station_high: float
    ratio: Number
    low: Number
    high: Number
    strokes: int
    samples: int
    conspicuous: bool


@dataclass(frozen=True)
class EdgeForce:
    """All places that strokes have touched, from the pivot outwards, and what they say."""

    missing: str
    finding: str
    places: tuple[EdgePlace, ...]


def force_along_edge(fit: FitResult, strokes: Sequence[StrokeSamples]) -> EdgeForce:
    """Ratio of measured to modelled torque by place along the edge.

    At one place torque and force at the edge differ by the same lever on both sides, so that the
    ratio is one of forces. Strokes are what is independent: the interval comes from their spread
    (Student's t, Bonferroni over the places), so that correlated residuals do not narrow it.
    """
    cutting = cutting_of(fit)
    if cutting is None or not strokes:
        return EdgeForce("Only a fit of the cut, with its strokes, tells about the edge.", "", ())
    series = fit.series
    largest = float(np.nanmax(np.abs(series.predicted), initial=0.0))
    view = edge_height(cutting.edge, series.contact, series.opening / cutting.moving_blades)
    told = np.isfinite(series.measured) & (series.predicted >= FELT_SHARE * largest) & (largest > 0)
    told &= (view.station > 0) & (view.station < cutting.edge.length_m)
    if int(np.sum(told)) < FEWEST_SAMPLES:
        why = "No stroke pressed hard enough on the material to tell about the edge."
        return EdgeForce(why, "", ())
    low, high = float(view.station[told].min()), float(view.station[told].max())
    count = max(1, min(PLACES, int((high - low) / SHORTEST_M)))
    bounds = np.linspace(low, high, count + 1)
    by_place = []
    for first, last in pairwise(bounds):
        here = told & (view.station >= first) & (view.station <= last)
        by_place.append((first, last, *_ratios(fit, strokes, here)))
    tests = max(1, sum(len(ratios) >= FEWEST_STROKES for _, _, ratios, _ in by_place))
    places = tuple(_place(*found, tests) for found in by_place if len(found[2]))
    return EdgeForce("", _finding(places), places)


def show_edge_force(section: EdgeForce, anchor: str) -> Panel:
    """The panel: the sentence, the ratio along the edge, the table."""
    title = "Force along the blade"
    where = f"{anchor}-edge"
    if section.missing:
        return absent(where, title, section.missing)
    found = tuple(
        Row(
            (
                _span(p),
                percent(p.ratio, 3),
                f"{percent(p.low, 3)} to {percent(p.high, 3)}" if p.low is not None else "unknown",
                str(p.strokes),
                _reading(p),
            ),
            marked=p.conspicuous,
        )
        for p in section.places
    )
    heads = columns("Place from the pivot", "Measured / model", "Interval", "Strokes", "=Reading")
    lead = (
        "Measured over modelled force by place along the edge. The model's material is the same "
        "everywhere, so a place that stands out is one where the pair is blunt, nicked, loose or "
        "tight, or where the model's response is wrong at the openings that reach it.",
    )
    caption = "Intervals hold for all places at once with 95 % probability."
    table = Table(caption, heads, found)
    return Panel(where, title, lead, section.finding, (_draw(section, where),), table)


def _span(place: EdgePlace) -> str:
    low, high = (with_decimals(1e3 * v, 1) for v in (place.station_low, place.station_high))
    return f"{low} to {high} mm"


def _reading(place: EdgePlace) -> str:
    if not place.conspicuous:
        return "as the rest"
    return "▲ harder" if (place.ratio or 1.0) > 1 else "▼ lighter"


def _ratios(fit: FitResult, strokes: Sequence[StrokeSamples], here: Array) -> tuple[Array, int]:
    """The ratio of each stroke that has enough samples in a place, and how many those are."""
    ratios, samples = [], 0
    for stroke in strokes:
        at = stroke.places[here[stroke.places]]
        if len(at) >= FEWEST_SAMPLES:
            ratios.append(fit.series.measured[at].sum() / fit.series.predicted[at].sum())
            samples += len(at)
    return np.array(ratios), samples


def _place(first: float, last: float, ratios: Array, samples: int, tests: int) -> EdgePlace:
    mean = float(ratios.mean())
    if len(ratios) < FEWEST_STROKES:
        return EdgePlace(first, last, finite(mean), None, None, len(ratios), samples, False)
    from scipy.stats import t

    spread = float(ratios.std(ddof=1) / np.sqrt(len(ratios)))
    reach = float(t.ppf(1.0 - 0.5 * FALSE_ALARM / tests, len(ratios) - 1)) * spread
    out = abs(mean - 1.0) > reach
    return EdgePlace(
        first,
        last,
        finite(mean),
        finite(mean - reach),
        finite(mean + reach),
        len(ratios),
        samples,
        out,
    )


def _finding(places: Sequence[EdgePlace]) -> str:
    judged = [p for p in places if p.low is not None and p.ratio is not None]
    if not judged:
        return (
            f"Fewer than {FEWEST_STROKES} strokes touched each place, so nothing can be said with "
            "certainty: record more strokes."
        )
    odd = [p for p in judged if p.conspicuous]
    felt = [p for p in odd if abs((p.ratio or 1.0) - 1.0) >= FELT]
    span = f"{short(1e3 * judged[0].station_low)} and {short(1e3 * judged[-1].station_high)} mm"
    if not odd:
        width = max((p.high or 0.0) - (p.low or 0.0) for p in judged) / 2
        return (
            f"Between {span} from the pivot no place stands out; a change of {percent(width)} "
            "would have been seen everywhere."
        )
    worst = max(odd, key=lambda p: abs((p.ratio or 1.0) - 1.0))
    ratio = worst.ratio or 1.0
    reach = ((worst.high or ratio) - (worst.low or ratio)) / 2
    more = "more" if ratio > 1 else "less"
    words = (
        f"Between {short(1e3 * worst.station_low)} and {short(1e3 * worst.station_high)} mm from "
        f"the pivot the pair needs {percent(abs(ratio - 1.0))} {more} force than the model says "
        f"(± {percent(reach)})."
    )
    if not felt:
        return f"{words} That is steady over strokes, but less than a hand notices."
    others = len(felt) - 1
    also = (
        f" {others} more place{'s' if others > 1 else ''} stand{'' if others > 1 else 's'} out."
        if others
        else ""
    )
    mend = (
        "look there for a blunt spot or a nick"
        if ratio > 1
        else "look there for play between the blades"
    )
    return f"{words} A hand notices that: {mend}, and at the strokes that reach it.{also}"


def _draw(section: EdgeForce, anchor: str) -> Svg:
    figure, axes = new_axes(PANEL)
    for p in section.places:
        if p.ratio is None:
            continue
        x = 500.0 * (p.station_low + p.station_high)
        colour = VERMILLION if p.conspicuous else BLUE
        marker = ("^" if p.ratio > 1 else "v") if p.conspicuous else "o"
        face = colour if p.low is not None else "none"
        if p.low is not None and p.high is not None:
            axes.plot([x, x], [100 * p.low, 100 * p.high], color=colour, lw=1.6)
        axes.plot(x, 100 * p.ratio, marker, ms=6, color=colour, mfc=face, mew=1.2)
    axes.axhline(100, color=INK, lw=1.0)
    for edge in (1 - FELT, 1 + FELT):
        axes.axhline(100 * edge, color=MUTED, lw=0.9, dashes=(4, 3))
    axes.set_xlabel("place along the edge, from the pivot [mm]")
    axes.set_ylabel("measured / model [%]")
    caption = (
        "Bars hold for all places at once with 95 % probability. Triangles stand out; open marks "
        "rest on one or two strokes. Between the dashed lines a hand notices no difference."
    )
    title = "Measured over modelled force along the edge"
    return finish(figure, f"{anchor}-f", title, caption, f"{section.finding} {caption}")
