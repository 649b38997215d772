"""The trust check: does the fit's uncertainty hold what it promises."""

from __future__ import annotations

import numpy as np

from scissorcal.calibration.result import FitResult
from scissorcal.calibration.verify.result import Calibration, VerifyResult
from scissorcal.report.numbers import percent, short, significant, unit_text
from scissorcal.report.panel import Panel, Row, Table, absent, columns
from scissorcal.report.svg import (
    BLUE,
    GREEN,
    INK,
    ORANGE,
    PANEL,
    PURPLE,
    VERMILLION,
    Svg,
    finish,
    new_axes,
)

LOOKS = ((BLUE, "-"), (VERMILLION, "--"), (GREEN, ":"), (PURPLE, "-."), (ORANGE, "--"))


def show_trust_check(fit: FitResult, verify: VerifyResult | None, anchor: str) -> tuple[Panel, ...]:
    """Panels for simulation-based calibration, halves and prior sensitivity, as far as made."""
    title, where = "Trust check", f"{anchor}-verify"
    command = f"`scissorcal verify {fit.what}`"
    if verify is None:
        return (absent(where, title, f"It has not been made for this fit: {command} makes it."),)
    if verify.fit_hash != fit.inputs_hash:
        return (absent(where, title, f"It was made for another fit than this one: run {command}."),)
    panels = []
    if verify.calibration is not None:
        panels.append(_calibration(verify.calibration, where))
    if verify.halves is not None:
        panels.append(_halves(verify, where))
    if verify.sensitivity is not None:
        panels.append(_sensitivity(verify, where))
    if verify.not_done or not panels:
        panels.append(
            absent(f"{where}-open", f"{title}: not done", " ".join(verify.not_done) or command)
        )
    return tuple(panels)


def _calibration(found: Calibration, anchor: str) -> Panel:
    levels = sorted({cover.level for quantity in found.quantities for cover in quantity.coverage})
    table_rows = []
    for quantity in found.quantities:
        covers = {cover.level: cover for cover in quantity.coverage}
        cells = [quantity.name]
        out = False
        for level in levels:
            cover = covers.get(level)
            cells.append(
                ""
                if cover is None
                else f"{percent(cover.share, 3)} ({percent(cover.low)} to {percent(cover.high)})"
            )
            out = out or (cover is not None and not cover.low <= cover.share <= cover.high)
        cells += [significant(quantity.ecdf_p, 2), short(quantity.width), short(quantity.shift, 2)]
        table_rows.append(Row(tuple(cells), marked=out))
    heads = columns(
        "Quantity",
        *(f"{percent(level)} interval holds" for level in levels),
        "Uniformity p",
        "Too narrow by",
        "Shift [sd]",
    )
    lead = (
        f"{found.fits} fits to data simulated from known values, at this fit's own motion and size "
        f"({found.generating}; {found.noise}). {percent(found.escalated)} of them went to a higher "
        f"effort by themselves, {percent(found.unreliable)} failed their own diagnostics, "
        f"{len(found.broken)} gave none.",
    )
    table = Table(
        "Share of intervals that held the truth, with the range that right intervals keep to.",
        heads,
        tuple(table_rows),
    )
    out_names = [row.cells[0] for row in table_rows if row.marked]
    finding = (
        f"Intervals do not hold what they promise for {', '.join(out_names)}."
        if out_names
        else "Intervals hold the truth as often as they promise."
    )
    title = "Trust check: intervals on simulated data"
    return Panel(anchor, title, lead, finding, (_draw_ranks(found, anchor),), table)


def _draw_ranks(found: Calibration, anchor: str) -> Svg:
    """The ranks' distribution function less that of uniform ranks, with its simultaneous band."""
    figure, axes = new_axes(PANEL)
    z, low, high = (np.array(v) for v in (found.band.z, found.band.low, found.band.high))
    axes.fill_between(z, low - z, high - z, color=INK, alpha=0.15, lw=0)
    axes.axhline(0, color=INK, lw=0.8)
    outside = []
    for number, quantity in enumerate(found.quantities):
        ranks = (np.array(quantity.ranks) + 0.5) / found.levels
        share = np.searchsorted(np.sort(ranks), z, side="right") / max(len(ranks), 1)
        colour, dashes = LOOKS[number % len(LOOKS)]
        leaves = bool(np.any((share < low) | (share > high)))
        axes.plot(z, share - z, color=colour, lw=2.0 if leaves else 1.0, ls=dashes)
        if leaves:
            at = int(np.argmax(np.abs(share - z)))
            axes.text(float(z[at]), float((share - z)[at]), quantity.name, color=colour, fontsize=8)
            outside.append(quantity.name)
    axes.set_xlabel("share of the rank's range")
    axes.set_ylabel("ECDF − uniform")
    chance = percent(found.band.alpha)
    caption = (
        f"Each line is a quantity; a calibrated one leaves the shade with probability {chance}. "
        + (f"Outside, bold and named: {', '.join(outside)}." if outside else "None leaves it.")
    )
    return finish(figure, f"{anchor}-ranks", "Ranks of the truth among the draws", caption)


def _halves(verify: VerifyResult, anchor: str) -> Panel:
    halves = verify.halves
    assert halves is not None
    found = tuple(
        Row(
            (
                row.name,
                f"{short(row.first)} {unit_text(row.unit)}".rstrip(),
                f"{short(row.second)} {unit_text(row.unit)}".rstrip(),
                short(row.sd, 2),
                "prior alone" if row.z is None else short(row.z, 2),
            ),
            marked=row.z is not None and abs(row.z) > 3.0,
        )
        for row in halves.rows
    )
    heads = columns("Parameter", "First half", "Second half", "Sd of the difference", "z")
    finding = (
        f"Fitted to each half alone, the predicted effort differs by "
        f"{percent(halves.effort_difference)} (rms; {percent(halves.effort_expected)} expected), "
        f"which has a probability of {significant(halves.effort_p_value, 2)}; all parameters "
        f"together {significant(halves.p_value, 2)}."
    )
    lead = (f"Two fits to strokes that they do not share ({halves.split}).",)
    table = Table("Their difference against the uncertainty that each claims.", heads, found)
    return Panel(
        f"{anchor}-halves", "Trust check: two halves of the data", lead, finding, (), table
    )


def _sensitivity(verify: VerifyResult, anchor: str) -> Panel:
    found = verify.sensitivity
    assert found is not None
    told = tuple(
        Row(
            (row.name, short(row.prior, 2), short(row.likelihood, 2), row.diagnosis),
            marked=row.diagnosis != "fine",
        )
        for row in found.rows
    )
    heads = columns("Quantity", "To the prior", "To the data", "=Diagnosis")
    odd = [row.name for row in found.rows if row.diagnosis != "fine"]
    finding = (
        f"The prior matters for {', '.join(odd)}."
        if odd
        else "No quantity depends on how strongly the prior was believed."
    )
    lead = (
        "How the posterior moves when prior or data count a little more; above "
        f"{short(found.threshold)} it matters.",
    )
    table = Table("Power-scaling sensitivities.", heads, told)
    return Panel(
        f"{anchor}-sensitivity", "Trust check: prior sensitivity", lead, finding, (), table
    )
