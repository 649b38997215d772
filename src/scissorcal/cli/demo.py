"""``scissorcal demo``"""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from scissorcal.cli.options import Seed
from scissorcal.cli.output import Answer, command
from scissorcal.cli.progress import progress

if TYPE_CHECKING:
    from scissorcal.report import Panel
    from scissorcal.workday.demo.day import DemoResult

VERIFY_FITS = 40
"""They find intervals that are one standard deviation off in 98 of 100 cases, and those that are
half as wide as they should be in 78."""


@command
def demo(
    folder: Annotated[
        Path,
        typer.Option(
            file_okay=False, help="The demo's workspace; that of an earlier demo is replaced."
        ),
    ] = Path("demo-workspace"),
    recipe: Annotated[str, typer.Option(help="A built-in recipe.")] = "paper-photographed",
    effort: Annotated[
        Literal["draft", "standard", "thorough"] | None,
        typer.Option(help="Effort of the fits; the recipe's if not given."),
    ] = None,
    fits: Annotated[
        int,
        typer.Option(
            min=0,
            help="Fits to simulated data that verify each fit; 0 for none. Thorough fits are "
            "left to 'scissorcal verify'.",
        ),
    ] = VERIFY_FITS,
    seed: Seed = 0,
) -> Answer:
    """Run the whole day on a virtual rig: capture, fit, verify, report, package, render.

    Time is virtual: the demo runs as fast as the computer can. Each seed draws another specimen,
    which the fits do not see; the result compares estimates with the truth.

    \b
    Example:
      $ scissorcal demo
      friction: stribeck + angle, symmetric
      cut: power response, rippled fracture
      ...
      Estimates beside the truth: 27 of 29 intervals (90 %) contain the truth.
                     estimate                          truth             inside?
        coulomb_pos  0.01334 (0.01327 to 0.01341) N m  0.01331 N m       yes
      ...
    """
    from scissorcal.recipe.load import recipe_path
    from scissorcal.report import panel_text
    from scissorcal.workday.demo.day import run_demo
    from scissorcal.workday.workspace import demo_folder

    recipe_path(recipe)
    made = demo_folder(folder)
    with progress() as tell:
        day = run_demo(made, recipe_name=recipe, seed=seed, effort=effort, fits=fits, progress=tell)
    panel = _panel(day)
    result = {
        "workspace": day.workspace,
        "specimen": day.specimen,
        "seed": seed,
        "candidates": day.candidates,
        "panels": [panel],
        "share_inside": day.share_inside,
        "torque_error": day.torque_error,
        "rendering": day.rendering,
    }
    report = _shown(day.workspace / "report" / "report.html")
    text = "\n".join([*day.candidates, "", panel_text(panel), "", f"report: {report}"])
    return Answer(result, text, day.verdicts, day.files)


def _panel(day: "DemoResult") -> "Panel":
    """Each estimate beside the truth, then what came of checks, package and rendering."""
    from scissorcal.report.panel import Panel, Row, number, words
    from scissorcal.report.subjects.trust import coverage_found

    rows = []
    for estimate in day.judged:
        unit, ends = estimate.unit, {"low": estimate.low, "high": estimate.high}
        values = [number("estimate", estimate.estimate, unit, **ends)]
        if estimate.truth is not None:
            inside = words("inside?", "yes" if estimate.inside else "no")
            values += [number("truth", estimate.truth, unit, digits=4), inside]
        rows.append(Row(estimate.name, tuple(values), marked=estimate.inside is False))
    known = [estimate.inside for estimate in day.judged if estimate.inside is not None]
    notes = []
    for check in day.verified:
        failed = [verdict.check for verdict in check.verdicts if verdict.status == "fail"]
        outcome = f"failed: {', '.join(failed)}" if failed else "passed"
        coverage = coverage_found(check)
        notes.append(f"{check.what}: verification {outcome}{coverage and f'; {coverage}'}.")
    notes += [
        f"Torque error of the package: {100 * day.torque_error:.2f} % (rms over the scene).",
        f"Rendered {day.rendering.strokes} strokes in {day.rendering.seconds:.1f} s.",
        day.rendering.admission.summary,
    ]
    sentence = f"{sum(known)} of {len(known)} intervals (90 %) contain the truth."
    title = "Estimates beside the truth"
    return Panel("truth", "demo", title, sentence, tuple(rows), notes=tuple(notes))


def _shown(path: Path) -> Path:
    """Name a path from here where that is shorter."""
    here = Path.cwd()
    return path.relative_to(here) if path.is_relative_to(here) else path
