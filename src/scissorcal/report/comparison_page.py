"""The page of a comparison: both runs' facts and figures in one HTML file."""

from __future__ import annotations

import numpy as np

from scissorcal.report.comparison import NOTABLE_SD, Comparison, FitComparison, Side
from scissorcal.report.numbers import (
    decimals_for,
    percent,
    short,
    unit_text,
    with_decimals,
)
from scissorcal.report.page import environment, style_sheet
from scissorcal.report.panel import Panel, Row, Table, columns
from scissorcal.report.sections.scene_torque import SceneTorque
from scissorcal.report.svg import (
    BLUE,
    INK,
    MUTED,
    PANEL,
    VERMILLION,
    Svg,
    drawing_style,
    finish,
    new_axes,
)

OUTCOMES = {
    "pass": "✓ pass",
    "fail": "✗ fail",
    "not_evaluated": "– not evaluated",
    None: "not made",
}


def comparison_text(found: Comparison, first: Side, second: Side) -> str:
    """Write the page; every value from outside is escaped."""
    with drawing_style():
        panels = [_torque(found, first, second)]
        panels += [_fit(fit) for fit in found.fits]
    panels.append(_verdicts(found))
    template = environment().get_template("comparison.html.j2")
    return template.render(found=found, panels=panels, style=style_sheet())


def _fit(fit: FitComparison) -> Panel:
    rows = tuple(
        Row(
            (
                row.name,
                unit_text(row.unit),
                _with_sd(row.first, row.first_sd),
                _with_sd(row.second, row.second_sd),
                short(row.difference),
                short(row.in_sd, 2),
            ),
            marked=row.changed,
        )
        for row in fit.parameters
    )
    heads = columns("Parameter", "=Unit", "First (A)", "Second (B)", "B − A", "In sd")
    lead = [f"{fit.rung}. Effort: {fit.efforts[0]} and {fit.efforts[1]}."]
    if fit.same_inputs:
        lead.append("Both were made from the same recordings, settings and effort.")
    median, worst = fit.held_out_median, fit.held_out_worst
    lead.append(
        f"Held-out error by stroke: {percent(median[0])} and {percent(median[1])} (median), "
        f"{percent(worst[0])} and {percent(worst[1])} (worst)."
    )
    changed = [row.name for row in fit.parameters if row.changed]
    finding = f"Changed: {', '.join(changed)}." if changed else "No parameter has changed."
    caption = (
        "Mean ± standard deviation. The difference is taken as that of independent runs; runs that "
        "share data differ by less."
    )
    table = Table(caption, heads, rows)
    title = f"{fit.what.capitalize()} fit"
    return Panel(f"fit-{fit.what}", title, tuple(lead), finding, (_draw_changes(fit),), table)


def _draw_changes(fit: FitComparison) -> Svg:
    shown = [row for row in fit.parameters if row.in_sd is not None]
    figure, axes = new_axes((PANEL[0], max(1.4, 0.9 + 0.19 * len(shown))))
    axes.axvspan(-NOTABLE_SD, NOTABLE_SD, color=MUTED, alpha=0.12, lw=0)
    axes.axvline(0, color=INK, lw=0.8)
    for place, row in enumerate(shown):
        colour, marker = (VERMILLION, "^") if row.changed else (BLUE, "o")
        axes.plot(row.in_sd or 0.0, place, marker, color=colour, ms=6, mew=0)
    axes.set_yticks(range(len(shown)), labels=[row.name.replace("_", " ") for row in shown])
    axes.tick_params(axis="y", length=0)
    axes.set_ylim(len(shown) - 0.4, -0.6)
    reach = max([NOTABLE_SD + 1.0, *(abs(row.in_sd or 0.0) * 1.1 for row in shown)])
    axes.set_xlim(-reach, reach)
    axes.set_xlabel("B − A in standard deviations")
    caption = (
        f"Within the grey, up to {short(NOTABLE_SD)}, a difference is chance; triangles are not."
    )
    return finish(figure, f"fit-{fit.what}-f", f"{fit.what} parameters, B against A", caption)


def _torque(found: Comparison, first: Side, second: Side) -> Panel:
    title, torque = "Rendered torque over the scene", found.torque
    if torque.missing or first.scene_torque is None or second.scene_torque is None:
        return Panel("torque", title, (torque.missing,))
    figures = tuple(
        _draw_slice(first.scene_torque, second.scene_torque, place)
        for place, cut in enumerate(first.scene_torque.slices)
        if cut.along == "opening"
    )
    place = torque.largest
    rows = []
    if place is not None:
        rows.append(
            Row(
                (
                    "largest difference",
                    short(torque.largest_difference),
                    short(None if place.opening is None else float(np.rad2deg(place.opening))),
                    short(place.opening_rate),
                    short(None if place.contact is None else 1e3 * place.contact),
                )
            )
        )
    rows.append(Row(("root mean square", short(torque.rms), "", "", "")))
    heads = columns("", "B − A [N m]", "Opening [°]", "Rate [rad/s]", "Contact [mm]")
    table = Table("Over a grid that covers the scene.", heads, tuple(rows))
    lead = ("A is the full line, B the dashed one, each with its band.",)
    return Panel("torque", title, lead, torque.sentence, figures, table)


def _draw_slice(first: SceneTorque, second: SceneTorque, number: int) -> Svg:
    figure, axes = new_axes(PANEL)
    label = first.slices[number].label
    for side, colour, dashes in ((first, BLUE, "-"), (second, VERMILLION, "--")):
        cut = side.slices[number]
        x = np.rad2deg(np.array(cut.x, dtype=np.float64))
        low, high, y = (
            np.array(v, dtype=np.float64) for v in (cut.band_low, cut.band_high, cut.torque)
        )
        axes.fill_between(x, low, high, color=colour, alpha=0.2, lw=0)
        axes.plot(x, y, color=colour, lw=1.5, ls=dashes)
    axes.set_xlabel("opening [°]")
    axes.set_ylabel("torque [N m]")
    caption = f"At a contact of {label}, closing. Full and blue is A, dashed and vermillion B."
    return finish(figure, f"torque-{number}", f"Torque of both at a contact of {label}", caption)


def _verdicts(found: Comparison) -> Panel:
    rows = tuple(
        Row(
            (f"{row.scope}, {row.check}", OUTCOMES[row.first], OUTCOMES[row.second]),
            marked=row.changed,
        )
        for row in found.verdicts
    )
    changed = sum(row.changed for row in found.verdicts)
    finding = f"{changed} of {len(found.verdicts)} checks came out otherwise."
    table = Table("Checks that differ stand first.", columns("Check", "=A", "=B"), rows)
    return Panel("verdicts", "Verdicts", (), finding, (), table)


def _with_sd(mean: float | None, sd: float | None) -> str:
    place = decimals_for(sd, mean)
    return f"{with_decimals(mean, place)} ± {with_decimals(sd, decimals_for(sd, sd))}"
