"""The page of an identified joint: parameters, friction curve, residuals, what is missing."""

from collections.abc import Sequence
from datetime import datetime

import numpy as np

from scissorcal.calibration import friction_curve
from scissorcal.calibration.friction.curve import partial_residuals
from scissorcal.identify.gaps import identified
from scissorcal.identify.joint import Held, Identified
from scissorcal.identify.simple import simple_law
from scissorcal.identify.words import plain
from scissorcal.report.html import panels_page
from scissorcal.report.numbers import shown_place
from scissorcal.report.panel import (
    Axis,
    Chart,
    Panel,
    Row,
    Series,
    Value,
    band,
    curve,
    number,
    percent_of,
    points,
    words,
)
from scissorcal.report.strokes import thinned

PART = "identify"
LEAST_BEYOND = 0.05
"""Share of a log's motion beyond the fitted one from which its band is not promised: half of the
tenth of the samples that the band leaves out."""
MOST_POINTS = 1500
"""Points of a cloud that a page draws."""


def page_of(joint: Identified, panels: Sequence[Panel], made: tuple[datetime, str]) -> str:
    """The offline page of `panels_of`."""
    logs = ", ".join(recording.source for recording in joint.recordings)
    return panels_page("Joint", logs, panels, made=made, findings=(panels[0].sentence,))


def panels_of(joint: Identified, held: Sequence[Held] = ()) -> list[Panel]:
    """The panels in order: the joint, what is missing, other logs, residuals, reading, checks."""
    first = [_parameters(joint), _curve(joint), _gaps(joint)]
    others = [_held(joint, held)] if held else []
    rest = [_residuals(joint), _ripple(joint), _simple(joint), _reading(joint), _checks(joint)]
    return [*first, *others, *rest]


def _parameters(joint: Identified) -> Panel:
    fit = joint.fit
    rows = [
        Row(
            plain(parameter.name),
            (
                number(
                    "median", parameter.q50, parameter.unit, low=parameter.q05, high=parameter.q95
                ),
                words("identified", identified(fit, parameter.name)),
                words("meaning", parameter.meaning),
            ),
        )
        for parameter in fit.parameters
    ]
    sentence = (
        f"{fit.candidate}: inertia {_of(joint, 'inertia')}; the law leaves {joint.rms:.3g} "
        f"{fit.effort_unit} rms, {joint.relative_rms:.1%} of the effort."
    )
    how = (
        "by the posterior's curvature (--effort standard samples it)"
        if fit.effort == "draft"
        else "by sampling"
    )
    return Panel(
        "parameters",
        PART,
        "Parameters",
        sentence,
        rows=tuple(rows),
        caption=f"Medians with 90 % intervals: {how}; widened for autocorrelated residuals.",
    )


def _of(joint: Identified, name: str) -> str:
    parameter = joint.fit.parameter(name)
    value = number("", parameter.q50, low=parameter.q05, high=parameter.q95)
    return f"{value} {parameter.unit}"


def _curve(joint: Identified) -> Panel:
    fit = joint.fit
    factor, unit = shown_place(fit.position_unit)
    found = friction_curve(fit)
    series: list[Series] = []
    if found is not None:
        rate, law, low, high = (
            np.insert(values, len(found.rate) // 2, np.nan)  # no line through rest
            for values in (factor * found.rate, found.friction, found.low, found.high)
        )
        series.append(band("90 %", rate, low, high, "blue"))
        series.append(curve("law", rate, law, "blue"))
        measured = partial_residuals(fit)
        kept = thinned(np.arange(len(measured)), MOST_POINTS)
        places = factor * fit.series.opening_rate[kept]
        series.insert(0, points("measured, less inertia", places, measured[kept], "muted"))
    chart = Chart(
        "friction-curve",
        "Friction over speed",
        Axis("speed", f"{unit}/s"),
        Axis("friction", fit.effort_unit),
        tuple(series),
        caption="Line and band: the law in the middle of the travel. Points: what was measured, "
        "less inertia and offset.",
    )
    return Panel("curve", PART, "Friction curve", charts=(chart,))


def _residuals(joint: Identified) -> Panel:
    fit = joint.fit
    series = fit.series
    factor, unit = shown_place(fit.position_unit)
    left = series.measured - series.predicted
    kept = thinned(np.arange(len(left)), MOST_POINTS)
    over = (
        ("time", series.time_s, "s"),
        ("speed", factor * series.opening_rate, f"{unit}/s"),
        ("position", factor * series.opening, unit),
    )
    charts = [
        Chart(
            f"residuals-{name}",
            f"Residuals over {name}",
            Axis(name, shown),
            Axis("residual", fit.effort_unit),
            (points("measured - law", values[kept], left[kept], "blue"),),
            small=True,
        )
        for name, values, shown in over
    ]
    rows = []
    share = fit.diagnostics.get("independent_share")
    if share is not None:
        rows.append(
            Row(
                "residuals",
                (
                    number("rms", joint.rms, fit.effort_unit),
                    percent_of("of the effort", joint.relative_rms),
                    number("independent", float(share) * len(left)),
                    Value("windows", len(left)),
                ),
            )
        )
    return Panel("residuals", PART, "Residuals", rows=tuple(rows), charts=tuple(charts))


def _ripple(joint: Identified) -> Panel:
    factor, unit = shown_place(joint.fit.position_unit)
    rows = []
    for ripple in joint.ripples:
        size = number(
            "amplitude", ripple.amplitude, joint.fit.effort_unit, low=ripple.low, high=ripple.high
        )
        kind = "friction, changes sign with the direction" if ripple.signed else "both ways alike"
        rows.append(
            Row(
                f"{ripple.speed}, {kind}",
                (
                    size,
                    number("period", factor * ripple.period, unit),
                    words("shown", "yes" if ripple.shown else "no"),
                ),
            )
        )
    return Panel(
        "ripple",
        PART,
        "Ripple over the position, beside the law",
        rows=tuple(rows),
        caption="The strongest sine of the residuals: slow has fewer than 6 periods in the travel. "
        "Shown: noise alone has it in one log of 10,000 at most.",
    )


def _held(joint: Identified, held: Sequence[Held]) -> Panel:
    unit = joint.fit.effort_unit
    rows, charts = [], []
    for place, log in enumerate(held):
        rows.append(
            Row(
                log.source,
                (
                    number("rms", log.rms, unit),
                    percent_of("of the effort", log.relative_rms),
                    percent_of("in the band", log.share_inside),
                    percent_of("beyond the fitted motion", log.beyond),
                ),
                _promise(log),
            )
        )
        seen = log.prediction
        kept = thinned(np.arange(len(seen.time_s)), MOST_POINTS)
        time = seen.time_s[kept]
        charts.append(
            Chart(
                f"predicted-{place}",
                f"{log.source}: predicted from its motion alone",
                Axis("time", "s"),
                Axis("effort", unit),
                (
                    band("band", time, seen.low[kept], seen.high[kept], "blue"),
                    curve("measured", time, seen.measured[kept], "ink"),
                    curve("predicted", time, seen.predicted[kept], "vermillion"),
                ),
            )
        )
    return Panel(
        "held-out",
        PART,
        "Logs that the fit did not see",
        rows=tuple(rows),
        charts=tuple(charts),
    )


def _promise(log: Held) -> str:
    """What the band promises, and why it does not hold where it does not."""
    if log.beyond >= LEAST_BEYOND:
        return (
            f"{log.beyond:.0%} of its motion is faster than the fitted logs, or outside their "
            "positions or loads: the prediction there rests on the form of the law and on what is "
            "not identified, and the band does not hold. Fit a log with such motion as well."
        )
    if log.differs:
        return (
            "The log differs from the fitted ones by more than those do among themselves, as after "
            "another set-up or at another temperature: fit several logs that differ so. "
            + log.promise
        )
    return log.promise


def _gaps(joint: Identified) -> Panel:
    rows = tuple(Row(gap.what, (words("why", gap.why),), gap.motion) for gap in joint.gaps)
    return Panel(
        "gaps",
        PART,
        "Not identified, and which motion would",
        rows=rows,
        caption="No: the 90 % interval spans a decade, or is as wide as the prior. Roughly: the "
        "interval is wider than its middle.",
    )


def _simple(joint: Identified) -> Panel:
    unit, rows = joint.fit.effort_unit, []
    for name, constant in (("symmetric", False), ("symmetric, with a constant effort", True)):
        law = simple_law(joint.fit, constant=constant)
        values = [
            number("Coulomb", law.coulomb, unit),
            number("viscous", law.viscous, f"{unit} s/{joint.fit.position_unit}"),
            number("constant", law.offset, unit),
            number("off by (rms)", law.rms, unit),
            number("leaves of the log", law.measured_rms, unit),
        ]
        rows.append(Row(name, tuple(values)))
    return Panel(
        "simple-laws",
        PART,
        "What a simulator's Coulomb and viscous friction leaves",
        rows=tuple(rows),
        caption="Off: the closest such law less the fitted one, over the motion of the log.",
    )


def _reading(joint: Identified) -> Panel:
    """How the logs were read, and what was done with them."""
    names = ", ".join(recording.source for recording in joint.recordings)
    return Panel("reading", PART, "How it was read", f"{names}.", notes=joint.notes)


def _checks(joint: Identified) -> Panel:
    rows = tuple(
        Row(verdict.check, (words("result", verdict.status),), plain(verdict.why))
        for verdict in joint.fit.verdicts
    )
    return Panel("checks", PART, "Checks", rows=rows)
