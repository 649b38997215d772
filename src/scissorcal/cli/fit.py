"""``scissorcal fit``"""

import time
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from scissorcal.cli.fit_request import FitRequest
from scissorcal.cli.opening import open_workspace
from scissorcal.cli.options import Folder, Seed, positive
from scissorcal.cli.output import Answer, command, table
from scissorcal.cli.progress import progress

if TYPE_CHECKING:
    from collections.abc import Collection

    from scissorcal.calibration import FittedParameter
    from scissorcal.workday.runs.fit import FitOutcome

GRACE_S = 180.0
"""A fit that stops at its limit still measures curvature and scores; it is ended by force later."""


@command
def fit(
    what: Annotated[
        Literal["friction", "cut", "camera", "blade", "plate", "all"],
        typer.Argument(help="What to fit; all: what the scene requires."),
    ] = "all",
    effort: Annotated[
        Literal["draft", "standard", "thorough"] | None,
        typer.Option(
            help="draft: quick, intervals unchecked; standard: checked; thorough: by ensembles of "
            "walkers, continues where it was interrupted. The recipe's if not given."
        ),
    ] = None,
    force: Annotated[
        bool, typer.Option("--force", help="Fit again even where nothing changed.")
    ] = False,
    max_minutes: Annotated[
        float,
        typer.Option(
            callback=positive,
            help="Time after which each fit stops with the result it has; it is then unfinished.",
        ),
    ] = 10.0,
    seed: Seed = 0,
    folder: Folder = None,
) -> Answer:
    """Fit what the scene requires: camera, blade and plate to photographs, friction, the cut.

    A fit whose recordings, photographs and settings are unchanged is not repeated. --effort does
    not apply to camera and plate. Each fit shows the time used and left, and stops after
    --max-minutes (the stage that is running is finished first).

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
    request = FitRequest(folder, effort, seed, force, 60.0 * max_minutes)
    if what != "all":
        return _FITS[what](request)
    from scissorcal.recipe.requirements import requirements

    needed = requirements(open_workspace(folder).recipe()).geometry
    before = [(item.name, _FITS[item.name](request)) for item in needed]
    return _together(before, _fit_laws((), request))


def _fit_camera(request: FitRequest) -> Answer:
    from scissorcal.cli.fit_camera import fit_camera

    return fit_camera(request)


def _fit_blade(request: FitRequest) -> Answer:
    from scissorcal.cli.fit_blade import fit_blade

    return fit_blade(request)


def _fit_plate(request: FitRequest) -> Answer:
    from scissorcal.cli.fit_plate import fit_plate

    return fit_plate(request)


def _together(before: "list[tuple[str, Answer]]", last: Answer) -> Answer:
    """One answer of several; what geometry's fits found stands below their names."""
    answers = [answer for _, answer in before] + [last]
    return Answer(
        {**last.result, "geometry": {name: answer.result for name, answer in before}},
        "\n\n".join(answer.text for answer in answers),
        verdicts=[verdict for answer in answers for verdict in answer.verdicts],
        files=[file for answer in answers for file in answer.files],
    )


def _fit_laws(wanted: "tuple[Literal['friction', 'cut'], ...]", request: FitRequest) -> Answer:
    from scissorcal.workday.runs.fit import fit_workspace

    ends_s = time.monotonic() + request.limit_s
    with progress(request.limit_s, grace_s=GRACE_S) as tell:
        outcomes = fit_workspace(
            open_workspace(request.folder),
            wanted,
            effort=request.effort,
            seed=request.seed,
            force=request.force,
            progress=tell,
            stop=lambda: time.monotonic() > ends_s,
        )
    fits = [
        {
            "what": outcome.what,
            "cached": outcome.cached,
            "rung": outcome.result.rung,
            "parameters": [parameter.name for parameter in outcome.result.parameters],
            "effort": outcome.result.effort,
            "calibration": not outcome.result.rejected,
            "verified": outcome.verified,
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
            row
            for outcome in outcomes
            for row in _parameter_facts(outcome)
            if not outcome.result.rejected
        ],
        "not_a_calibration": {
            outcome.what: _parameter_facts(outcome)
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


_FITS: Mapping[str, Callable[[FitRequest], Answer]] = {
    "friction": lambda request: _fit_laws(("friction",), request),
    "cut": lambda request: _fit_laws(("cut",), request),
    "camera": _fit_camera,
    "blade": _fit_blade,
    "plate": _fit_plate,
}
"""What can be fitted, and by which function."""


def _text(outcome: "FitOutcome") -> str:
    fitted = outcome.result
    head = f"{outcome.what}: {fitted.rung} ({fitted.effort})"
    if outcome.cached:
        head = f"{outcome.what}: nothing changed since the last fit; {fitted.rung} is as it was"
    if fitted.rejected:
        reasons = "\n".join(f"  {verdict.check}: {verdict.why}" for verdict in fitted.rejected)
        shown = _shown(outcome).replace("\n", "\n  ")
        return (
            f"{outcome.what}: not a calibration:\n{reasons}\n"
            f"{head}; the search ended with these numbers, which are not to be used:\n  {shown}"
        )
    said = [head, _shown(outcome), fitted.selection]
    said += [proposal.sentence for proposal in fitted.critic]
    said += [fitted.replay.sentence] if fitted.replay else []
    if not outcome.verified:
        said.append(
            f"unverified: 'scissorcal verify {outcome.what}' checks whether these intervals hold."
        )
    return "\n".join(line for line in said if line)


def _reported(outcome: "FitOutcome") -> "tuple[FittedParameter, ...]":
    return (*outcome.result.parameters, *outcome.result.derived)


def _parameter_facts(outcome: "FitOutcome") -> list[dict[str, object]]:
    """Parameters as ``--json`` prints them, each with what is known to be poor about it."""
    from scissorcal.calibration.caveats import caveats_by_parameter

    known = caveats_by_parameter(outcome.result)
    return [
        {**parameter.as_dict(), "caveats": list(known.get(parameter.name, ()))}
        for parameter in _reported(outcome)
    ]


def _shown(outcome: "FitOutcome") -> str:
    """The table of parameters, and below it which of their intervals are known to be poor."""
    from scissorcal.calibration.caveats import caveats_of

    known = caveats_of(outcome.result)
    marked = {name for caveat in known for name in caveat.parameters}
    lines = [parameter_table(_reported(outcome), marked)]
    lines += [f"* {', '.join(caveat.parameters)}: {caveat.sentence}" for caveat in known]
    return "\n".join(lines)


def parameter_table(
    parameters: "tuple[FittedParameter, ...]", marked: "Collection[str]" = ()
) -> str:
    """Set out fitted parameters for people; those that are ``marked`` get an asterisk."""
    rows = [["parameter", "unit", "mean", "sd", "5 %", "95 %", "identifiability"]]
    for parameter in parameters:
        numbers = (parameter.mean, parameter.sd, parameter.q05, parameter.q95)
        rows.append(
            [f"{parameter.name} *" if parameter.name in marked else parameter.name, parameter.unit]
            + [f"{number:.4g}" for number in numbers]
            + [f"{parameter.identifiability:.2f}"]
        )
    return table(rows, right=range(2, 7))
