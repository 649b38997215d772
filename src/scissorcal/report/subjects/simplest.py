"""Two choices of a law: what the data support, and what the scene needs."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from scissorcal.calibration.result import FitResult
from scissorcal.package.simplest.record import AspectRecord
from scissorcal.report.numbers import percent
from scissorcal.report.panel import Panel, Row, Value, count, number, percent_of, words

if TYPE_CHECKING:
    from scissorcal.package.simplest.choice import SceneChoice

ID, PART = "scene-simplest", "scene"
TITLE = "What the data support, and what the scene needs"


def simplest_panel(choice: SceneChoice, fits: Sequence[FitResult]) -> Panel:
    """Aspect by aspect: the fitted candidate, the one that is enough, its cost and savings."""
    record = choice.simplification
    rows = tuple(_row(row, choice) for row in record.aspects if row.tried or row.fitted != "none")
    notes = [f"Data, {fit.what}: {fit.selection or fit.candidate}" for fit in fits]
    notes.append(f"Scene: {record.sentence}")
    rest = 1.0 - (record.allowed_share + record.tables_share) / record.tolerance
    notes.append(
        f"The scene's tolerance, {percent(record.tolerance)} of the local torque, is shared: "
        f"{percent(record.allowed_share)} for everything that is left out together, "
        f"{percent(record.tables_share)} for the tables (twice what was found), the rest "
        f"({percent(rest)} of it) for the posterior."
    )
    if record.within_before is not None and record.within_after is not None:
        notes.append(
            f"Posterior band and tables stay within the tolerance at "
            f"{percent(record.within_before)} of the places that can be felt; with what is left "
            f"out, at {percent(record.within_after)}."
        )
    notes.append(
        f"A step of the kernel takes {choice.step_ns_used:.0f} ns with the laws that are used, "
        f"{choice.step_ratio:.2f} of the {choice.step_ns_fitted:.0f} ns of the fitted ones (half "
        f"of the repeats lie within ±{choice.step_spread_ns:.2g} ns), on the computer that worked "
        f"it out. Tables and draws take {record.bytes_after:,} of {record.bytes_before:,} bytes."
    )
    caption = (
        "Costs are differences of the torque to the fitted laws, over the scene, that are not "
        f"exceeded with {percent(record.confidence)} confidence over the posterior; a candidate "
        "that fails at the best point already was judged there alone."
    )
    return Panel(ID, PART, TITLE, record.sentence, rows, notes=tuple(notes), caption=caption)


def _row(row: AspectRecord, choice: SceneChoice) -> Row:
    judged = row.alone or (row.tried[-1].cost if row.tried else None)
    saved = choice.saving(row.aspect)
    what = "friction" if row.aspect == "friction" else "cut"
    values: list[Value] = [
        words("the data support", row.fitted),
        words("the scene needs", row.used),
        words("judged", row.used if row.omitted else row.tried[-1].name if row.tried else "-"),
    ]
    if judged is not None:
        values += [
            percent_of("worst cost", judged.worst_share),
            percent_of("rms cost", judged.rms_share),
            number("torque", judged.worst_Nm, "N m", digits=2),
            percent_of("confidence", judged.probability),
        ]
    if saved is not None:
        values += [
            count("bytes saved", row.saved_bytes),
            number("step saved", saved.step_ns, "ns", digits=2),
            number("capture saved", saved.capture_s, "s", digits=2),
            count("evaluations of its fit", choice.evaluations.get(what)),
            count("candidates compared", choice.candidates.get(what)),
        ]
    tried = "; ".join(f"{one.name} {one.verdict} ({one.cost.words})" for one in row.tried)
    return Row(row.aspect, tuple(values), note=tried, marked=row.omitted)
