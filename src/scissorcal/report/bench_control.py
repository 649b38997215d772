"""The page of `bench control`: what contact adds to a camera, for the pose and for control."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from scissorcal.report.html import made_line, panel_section, parts_nav, prose, whole_page
from scissorcal.report.panel import Axis, Chart, Look, Panel, Row, count, number, percent_of, points

if TYPE_CHECKING:
    from scissorcal.bench.control.result import ControlBench, ControlRow, PoseRow, Spread, TrapRow
    from scissorcal.report.panel import Value

PART = "control"
LOOKS: dict[str, Look] = {
    "vision": "vermillion", "contact": "blue", "force": "green", "fused": "blue", "true": "ink",
}  # fmt: skip
TOLD = {"vision": "pictures", "contact": "and contact", "force": "and the force's direction"}


def control_page(result: ControlBench) -> str:
    """The offline page: the pose's errors, the crippled filters, and control."""
    panels = control_panels(result)
    made = made_line(result.created.strftime("%Y-%m-%d %H:%M %Z"), result.scissorcal_version)
    facts = (
        f"{result.jobs} of {result.planned} jobs, seed {result.seed}, {result.seconds:.0f} s in "
        f"{result.workers} processes ({result.machine})."
    )
    body = (
        '<main><section id="decision" class="plain"><p class="kicker">Vision and contact</p>'
        f'<h1>What contact adds to a camera</h1><p class="finding">{prose(result.sentence)}</p>'
        f"<p>{prose(facts)}</p>{made}</section>"
        f"{parts_nav([(panel.id, panel.title) for panel in panels])}"
    )
    body += "".join(panel_section(panel, open_=True) for panel in panels)
    return whole_page("What contact adds to a camera", body + "</main>")


def control_panels(result: ControlBench) -> list[Panel]:
    """The panels of the page, in order."""
    checks = Panel(
        "checks", PART, "Checks", "Figures against their limits.", verdicts=result.verdicts
    )
    return [checks, _poses(result.poses), _traps(result.traps), _controls(result.controls)]


def error_chart(rows: Sequence[PoseRow]) -> Chart:
    """Median error along the normal, up to its 95 % quantile, by case and by what is told."""
    cases = list(dict.fromkeys(f"{row.plate}, {row.scenario}" for row in rows))
    series = []
    for shift, (source, told) in zip((-0.2, 0.0, 0.2), TOLD.items(), strict=True):
        own = [row for row in rows if row.source == source]
        x = [cases.index(f"{row.plate}, {row.scenario}") + shift for row in own]
        middle = [row.normal_mm.median for row in own]
        top = [row.normal_mm.most_95 for row in own]
        series.append(points(told, x, middle, LOOKS[source], low=middle, high=top))
    return Chart(
        "normal-error",
        "Error along the normal: median, and up to 95 % of the runs",
        Axis("case", categories=tuple(cases)),
        Axis("error along the normal", "mm", log=True),
        tuple(series),
    )


def nees_chart(rows: Sequence[PoseRow]) -> Chart:
    """Mean NEES of every row against the band that a consistent filter keeps."""
    series = []
    for source, told in TOLD.items():
        own = [(place, row) for place, row in enumerate(rows) if row.source == source]
        series.append(points(told, [p for p, _ in own], [r.nees for _, r in own], LOOKS[source]))
    bands = [row.band_95 for row in rows]
    places = list(range(len(rows)))
    middle = [0.5 * (low + high) for low, high in bands]
    series.insert(
        0,
        points(
            "95 % band",
            places,
            middle,
            "muted",
            low=[low for low, _ in bands],
            high=[high for _, high in bands],
        ),
    )
    return Chart(
        "nees",
        "Mean NEES of the pose: 6 where the stated uncertainty is right",
        Axis("number of the row"),
        Axis("mean NEES"),
        tuple(series),
    )


def force_chart(rows: Sequence[ControlRow]) -> Chart:
    """Error of the force, by plate, scenario and law, and by where the pose comes from."""
    cases = list(dict.fromkeys(f"{row.plate}, {row.scenario}, {row.law}" for row in rows))
    series = []
    for shift, pose in zip((-0.2, 0.0, 0.2), ("vision", "fused", "true"), strict=True):
        own = [row for row in rows if row.pose == pose]
        x = [cases.index(f"{row.plate}, {row.scenario}, {row.law}") + shift for row in own]
        middle = [row.force_N.median for row in own]
        top = [row.force_N.most_95 for row in own]
        series.append(points(f"pose: {pose}", x, middle, LOOKS[pose], low=middle, high=top))
    return Chart(
        "force-error",
        "Error of the force (rms of a run): median, and up to 95 % of the runs",
        Axis("case", categories=tuple(cases)),
        Axis("error of the force", "N", log=True),
        tuple(series),
    )


def _poses(rows: Sequence[PoseRow]) -> Panel:
    shown = [
        Row(
            f"{row.plate}, {row.scenario}: {TOLD[row.source]}",
            (
                count("runs", row.runs),
                *_spread("normal", row.normal_mm, "mm"),
                *_spread("tangent", row.tangent_mm, "mm"),
                *_spread("yaw", row.yaw_deg, "deg"),
                *_spread("tilt", row.tilt_deg, "deg"),
                number("normal over vision's", row.normal_over_vision, digits=2),
                number("NEES", row.nees, digits=3),
                percent_of("held by 95 % sets", row.held_95, digits=3),
                count("restarts", row.restarts),
            ),
            marked=not row.consistent,
        )
        for row in rows
    ]
    return Panel(
        "poses",
        PART,
        "Errors of the pose",
        "At the end of each run, under the tip. On a plane contact tells the place along the "
        "normal; place along the plate and yaw stay what the camera says.",
        tuple(shown),
        charts=(error_chart(rows), nees_chart(rows)) if rows else (),
        caption=(
            "Marked rows have a mean NEES outside the 95 % band of a consistent filter; by chance "
            "one row in twenty has."
        ),
    )


def _traps(rows: Sequence[TrapRow]) -> Panel:
    shown = [
        Row(
            f"{row.left_out} ({row.scenario})",
            (
                count("runs", row.runs),
                number("NEES without", row.nees_without, digits=3),
                number("NEES with", row.nees_with, digits=3),
                percent_of("held without", row.held_95_without),
                percent_of("held with", row.held_95_with),
                number("normal without", row.normal_mm_without, "mm", digits=2),
                number("normal with", row.normal_mm_with, "mm", digits=2),
            ),
        )
        for row in rows
    ]
    return Panel(
        "traps",
        PART,
        "What goes wrong without each part",
        "Filters that lack one part each, on a plane, in the same worlds as the whole filter. Mean "
        "NEES should be 6.",
        tuple(shown),
    )


def _controls(rows: Sequence[ControlRow]) -> Panel:
    shown = [
        Row(
            f"{row.plate}, {row.scenario}: {row.law}, pose from {row.pose}",
            (
                count("runs", row.runs),
                *_spread("force", row.force_N, "N"),
                *_spread("path", row.path_mm, "mm"),
                *_spread("touch", row.touch_N, "N"),
                number("touch over bound", row.touch_ratio.median, digits=2),
                percent_of("in contact", row.contact_share, digits=3),
            ),
        )
        for row in rows
    ]
    return Panel(
        "control",
        PART,
        "Control",
        "A path at 2.5 N. Hybrid control closes its loop on the measured force and feels the "
        "surface's rate: the pose does not matter for the force, on a fixed plate or a moving one. "
        "It matters for the path, and for control by place.",
        tuple(shown),
        charts=(force_chart(rows),) if rows else (),
    )


def _spread(name: str, found: Spread, unit: str) -> tuple[Value, Value]:
    return (
        number(name, found.median, unit, digits=2),
        number(f"{name}, 95 %", found.most_95, unit, digits=2),
    )
