"""``scissorcal demo``"""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from scissorcal.cli.options import Seed
from scissorcal.cli.output import Answer, command, table
from scissorcal.cli.progress import progress

if TYPE_CHECKING:
    from scissorcal.calibration.verify.result import VerifyResult
    from scissorcal.workday.demo.day import DemoResult

VERIFY_FITS = 40
"""They find intervals that are one standard deviation off in 98 of 100 cases, and those that are
half as wide as they should be in 78."""

_ANSWERS = {True: "yes", False: "no", None: "-"}


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
      parameter          unit           truth   estimate        5 %       95 %  inside?
      inertia            kg m^2      0.000189  0.0001879  0.0001843  0.0001912  yes
      ...
    """
    from scissorcal.recipe.library import recipe_path
    from scissorcal.workday.demo.day import run_demo
    from scissorcal.workday.workspace import demo_folder

    recipe_path(recipe)
    made = demo_folder(folder)
    with progress() as tell:
        found = run_demo(
            made, recipe_name=recipe, seed=seed, effort=effort, fits=fits, progress=tell
        )
    result = {
        "workspace": found.workspace,
        "specimen": found.specimen,
        "seed": seed,
        "rungs": found.rungs,
        "parameters": [
            {**row.parameter.as_dict(), "truth": row.truth, "inside": row.inside}
            for row in found.judged
        ],
        "geometry": [
            {
                "name": row.name,
                "unit": row.unit,
                "truth": row.truth,
                "estimate": row.estimate,
                "sd": row.sd,
                "inside": row.inside,
            }
            for row in found.geometry
        ],
        "share_inside": found.share_inside,
        "verified": [
            {
                "what": check.what,
                "fits": check.calibration.fits if check.calibration else 0,
                "passed": not any(verdict.status == "fail" for verdict in check.verdicts),
            }
            for check in found.verified
        ],
        "torque_error": found.torque_error,
        "rendering": found.rendering,
    }
    return Answer(result, _text(found), found.verdicts, found.files)


def _text(found: "DemoResult") -> str:
    rows = [["parameter", "unit", "truth", "estimate", "5 %", "95 %", "inside?"]]
    for row in found.judged:
        parameter = row.parameter
        truth = "-" if row.truth is None else f"{row.truth:.4g}"
        centre = parameter.moments[0] if parameter.moments else parameter.q50
        estimate = [f"{value:.4g}" for value in (centre, parameter.q05, parameter.q95)]
        rows.append([parameter.name, parameter.unit, truth, *estimate, _ANSWERS[row.inside]])
    for seen in found.geometry:
        reach = 1.6449 * seen.sd
        numbers = (seen.truth, seen.estimate, seen.estimate - reach, seen.estimate + reach)
        cells = [f"{value:.4g}" for value in numbers]
        rows.append([seen.name, seen.unit, *cells, _ANSWERS[seen.inside]])
    inside = [row.inside for row in found.judged if row.inside is not None]
    inside += [seen.inside for seen in found.geometry]
    lines = [
        *found.rungs,
        "",
        table(rows, right=[2, 3, 4, 5]),
        "",
        f"{sum(inside)} of {len(inside)} intervals (90 %) contain the truth",
        *(_verified(check) for check in found.verified),
        f"torque error of the package {100 * found.torque_error:.2f} % (rms over the scene)",
        f"rendered {found.rendering.strokes} strokes in {found.rendering.seconds:.1f} s",
        found.rendering.admission.summary,
        "",
        f"report: {_shown(found.workspace / 'report' / 'report.html')}",
    ]
    return "\n".join(lines)


def _verified(check: "VerifyResult") -> str:
    failed = [verdict.check for verdict in check.verdicts if verdict.status == "fail"]
    outcome = f"failed: {', '.join(failed)}" if failed else "passed"
    if check.calibration is None:
        return f"{check.what}: trust check {outcome}"
    shares = [one.share for row in check.calibration.quantities for one in row.coverage[1:]]
    return (
        f"{check.what}: trust check {outcome}; in {check.calibration.fits} fits to simulated data "
        f"the 90 % intervals contain the truth in {min(shares):.0%} to {max(shares):.0%}"
    )


def _shown(path: Path) -> Path:
    """Name a path from here where that is shorter."""
    here = Path.cwd()
    return path.relative_to(here) if path.is_relative_to(here) else path
