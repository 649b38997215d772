"""``scissorcal fit``"""

from pathlib import Path
from typing import TYPE_CHECKING, Literal

import click

from scissorcal.cli.opening import open_workspace
from scissorcal.cli.options import seed_option, workspace_option
from scissorcal.cli.output import Answer, command, table
from scissorcal.cli.progress import progress

if TYPE_CHECKING:
    from scissorcal.calibration import FittedParameter
    from scissorcal.workday.fits import FitOutcome


@click.command("fit")
@click.argument(
    "what", type=click.Choice(["friction", "cut", "camera", "blade", "plate", "all"]), default="all"
)
@click.option(
    "--effort",
    type=click.Choice(["draft", "standard"]),
    default=None,
    help="draft: quick, intervals unchecked; standard: checked. The recipe's if not given.",
)
@click.option("--force", is_flag=True, help="Fit again even where nothing changed.")
@seed_option
@workspace_option
@command
def fit(
    what: Literal["friction", "cut", "camera", "blade", "plate", "all"],
    effort: Literal["draft", "standard"] | None,
    force: bool,
    seed: int,
    folder: Path | None,
) -> Answer:
    """Fit friction and the cut, as far as the scene requires them; or the camera.

    A fit whose recordings, photographs and settings have not changed is not done again. The
    camera's fit has one effort.

    \b
    Example:
      $ scissorcal fit friction
      friction: stribeck + angle, symmetric (standard)
      parameter        unit            mean         sd        5 %       95 %  identifiability
      inertia          kg m^2     0.0002109  2.253e-06  0.0002072  0.0002144             0.00
      ...
      $ scissorcal fit friction
      friction: nothing changed since the last fit; stribeck + angle, symmetric is as it was
      ...
    """
    from scissorcal.workday.fits import fit_workspace

    if what == "camera":
        from scissorcal.cli.fit_camera import fit_camera

        return fit_camera(folder, seed=seed, force=force)
    if what == "blade":
        from scissorcal.cli.fit_blade import fit_blade

        return fit_blade(folder, effort=effort, seed=seed, force=force)
    if what == "plate":
        from scissorcal.cli.fit_plate import fit_plate

        return fit_plate(folder, force=force)
    workspace = open_workspace(folder)
    wanted: tuple[Literal["friction", "cut"], ...] = () if what == "all" else (what,)
    with progress() as tell:
        outcomes = fit_workspace(
            workspace, wanted, effort=effort, seed=seed, force=force, progress=tell
        )
    fits = [
        {
            "what": outcome.what,
            "cached": outcome.cached,
            "rung": outcome.result.rung,
            "parameters": [parameter.name for parameter in outcome.result.parameters],
            "effort": outcome.result.effort,
            "calibration": not outcome.result.rejected,
            "rungs": outcome.result.rungs,
            "selection": outcome.result.selection,
            "critic": outcome.result.critic,
            "replay": outcome.result.replay,
            "diagnostics": outcome.result.diagnostics,
            "held_out": outcome.result.held_out,
            "inputs_hash": outcome.result.inputs_hash,
            "notes": outcome.result.notes,
        }
        for outcome in outcomes
    ]
    result = {
        "parameters": [
            parameter.as_dict()
            for outcome in outcomes
            for parameter in outcome.result.parameters
            if not outcome.result.rejected
        ],
        "not_a_calibration": {
            outcome.what: [parameter.as_dict() for parameter in outcome.result.parameters]
            for outcome in outcomes
            if outcome.result.rejected
        },
        "fits": fits,
    }
    return Answer(
        result,
        "\n\n".join(_text(outcome) for outcome in outcomes),
        verdicts=[verdict for outcome in outcomes for verdict in outcome.result.verdicts],
        files=[outcome.path for outcome in outcomes if not outcome.cached],
    )


def _text(outcome: "FitOutcome") -> str:
    fitted = outcome.result
    head = f"{outcome.what}: {fitted.rung} ({fitted.effort})"
    if outcome.cached:
        head = f"{outcome.what}: nothing changed since the last fit; {fitted.rung} is as it was"
    if fitted.rejected:
        reasons = "\n".join(f"  {verdict.check}: {verdict.why}" for verdict in fitted.rejected)
        shown = parameter_table(fitted.parameters).replace("\n", "\n  ")
        return (
            f"{outcome.what}: not a calibration:\n{reasons}\n"
            f"{head}; the search ended with these numbers, which are not to be used:\n  {shown}"
        )
    said = [head, parameter_table(fitted.parameters), fitted.selection]
    said += [proposal.sentence for proposal in fitted.critic]
    said += [fitted.replay.sentence] if fitted.replay else []
    return "\n".join(line for line in said if line)


def parameter_table(parameters: "tuple[FittedParameter, ...]") -> str:
    """Set out fitted parameters for people."""
    rows = [["parameter", "unit", "mean", "sd", "5 %", "95 %", "identifiability"]]
    for parameter in parameters:
        numbers = (parameter.mean, parameter.sd, parameter.q05, parameter.q95)
        rows.append(
            [parameter.name, parameter.unit]
            + [f"{number:.4g}" for number in numbers]
            + [f"{parameter.identifiability:.2f}"]
        )
    return table(rows, right=range(2, 7))
