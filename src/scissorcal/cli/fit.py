"""``scissorcal fit``: one command for each fit, and for all that the scene requires."""

import time
from collections.abc import Callable, Sequence
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from scissorcal.cli.lazy import group
from scissorcal.cli.opening import open_workspace, writes_in
from scissorcal.cli.options import RIG, Axis, Folder, options_of, positive
from scissorcal.cli.output import Answer, command, table
from scissorcal.cli.progress import progress
from scissorcal.workday.options import FitOptions

if TYPE_CHECKING:
    from scissorcal.workday.history import Version
    from scissorcal.workday.runs.fit import FitOutcome

GRACE_S = 180.0
"""A fit that stops at its limit still measures curvature and scores; it is ended by force later."""

_COMMANDS = {
    "camera": ("scissorcal.cli.fit:camera", "The camera, to photographs of its board."),
    "blade": ("scissorcal.cli.fit:blade", "The blade's edge, to photographs."),
    "plate": ("scissorcal.cli.fit:plate", "The plate's pose, to photographs of its target."),
    "friction": ("scissorcal.cli.fit:friction", "Friction, to recordings of empty motion."),
    "cut": ("scissorcal.cli.fit:cut", "Response, fracture and taper, to recordings of cuts."),
    "all": ("scissorcal.cli.fit:all_", "All that the scene requires."),
    "log": ("scissorcal.cli.fit:log", "The versions of each fit."),
    "restore": ("scissorcal.cli.fit:restore", "Put an earlier version back in use."),
}

_LAW = "scissorcal.cli.fit_law"

_SHOWN = {
    "camera": "scissorcal.cli.fit_camera",
    "blade": "scissorcal.cli.fit_blade",
    "plate": "scissorcal.cli.fit_plate",
    "friction": _LAW,
    "friction-advance": _LAW,
    "cut": _LAW,
}
"""Which module says what a fit found: its ``text`` for people, its ``facts`` for ``--json``."""

_EXAMPLES = {
    "camera": "camera: 2000 x 1500, 15 photographs of the camera board, k1, k2, p1, p2",
    "blade": "blade: arc, 74.92 mm long, 3 photographs",
    "plate": "plate: 5 photographs of the plate board, rms 0.03 px",
    "cut": "cut: power response, rippled fracture (standard)",
    "all": "friction: stribeck + angle, symmetric (standard)",
}
"""What the help of each command shows as its first line of output."""

_OPTIONS = {
    "effort": typer.Option(
        help="draft: quick, intervals unchecked; standard: checked; thorough: by ensembles of "
        "walkers, continues where it was interrupted. The recipe's if not given."
    ),
    "force": typer.Option("--force", help="Fit again even where nothing changed."),
    "seed": RIG["seed"],
    "save_to": typer.Option(
        file_okay=False,
        help="Where a fit is kept if the workspace cannot be written; a folder for temporary files "
        "if not given. 'scissorcal fit restore FILE' puts it in place.",
    ),
}
_CRITIC = typer.Option("--critic", help="Ask the critic, at draft effort too, and print its work.")
MaxMinutes = Annotated[
    float,
    typer.Option(
        callback=positive,
        help="Time after which each fit stops with the result it has; it is then unfinished.",
    ),
]


@group(_COMMANDS, runs_alone=True)
@command
@options_of(_OPTIONS)
def fit(options: FitOptions, max_minutes: MaxMinutes = 10.0, folder: Folder = None) -> Answer:
    """Fit what the scene requires: camera, blade and plate to photographs, friction, the cut.

    A fit whose recordings, photographs and settings are unchanged is not repeated. --effort does
    not apply to camera and plate. Each fit shows the time used and left, and stops after
    --max-minutes (the stage that is running is finished first). The result that was there is kept:
    'scissorcal fit log' lists the versions.

    \b
    Example:
      $ scissorcal fit friction
      friction: stribeck + angle, symmetric (standard)
      parameter  unit         mean         sd        5 %       95 %  sd, next recording  ...
      inertia    kg m^2  0.0002109  2.253e-06  0.0002072  0.0002144           not known  ...
      ...
      $ scissorcal fit friction
      friction: nothing changed since the last fit; stribeck + angle, symmetric is as it was
      ...
    """
    return _run((), options, max_minutes, folder)


def _command_of(*wanted: str) -> Callable[..., None]:
    """Make the command that fits one thing; it has the options of ``fit``."""

    def fit_one(
        options: FitOptions, max_minutes: MaxMinutes = 10.0, folder: Folder = None
    ) -> Answer:
        return _run(wanted, options, max_minutes, folder)

    what = wanted[0] if wanted else "all"
    fit_one.__doc__ = f"""{_COMMANDS[what][1]} See 'scissorcal fit --help'.

    \b
    Example:
      $ scissorcal fit {what}
      {_EXAMPLES[what]}
      ...
    """
    return command(options_of(_OPTIONS)(fit_one))


@command
@options_of({**_OPTIONS, "critic": _CRITIC})
def friction(
    options: FitOptions,
    axis: Axis = "opening",
    max_minutes: MaxMinutes = 10.0,
    folder: Folder = None,
) -> Answer:
    """Friction, to recordings of empty motion. See 'scissorcal fit --help'.

    With --axis advance, mass and friction of the carriage, to captures with the same option. They
    rest on the commanded force: no sensor measures one along the cut.

    The critic searches what the law leaves for drift, ripple, hysteresis and other terms that recur
    over strokes. Standard and thorough effort ask it; --critic asks it at draft effort too and
    prints what it tried.

    \b
    Example:
      $ scissorcal fit friction
      friction: stribeck + angle, symmetric (standard)
      ...
      $ scissorcal fit friction --axis advance
      friction-advance: coulomb + viscous, symmetric (standard)
      ...
      $ scissorcal fit friction --effort draft --critic
      friction: stribeck + angle, asymmetric (draft)
      ...
      The critic tried 49 terms over 43 strokes and proposes sign*time.
      What the law lacks recurs over strokes with 0.0023 N m (13 % of the drive, ...): sign*time.
      ...
    """
    what = "friction" if axis == "opening" else "friction-advance"
    return _run((what,), options, max_minutes, folder)


camera = _command_of("camera")
blade = _command_of("blade")
plate = _command_of("plate")
cut = _command_of("cut")
all_ = _command_of()


def _run(
    wanted: Sequence[str], options: FitOptions, max_minutes: float, folder: Path | None
) -> Answer:
    from scissorcal.workday.engine import Engine
    from scissorcal.workday.runs.fit import fit_step, for_step, steps_to_fit

    limit_s = 60.0 * max_minutes
    outcomes = []
    with writes_in(folder, "scissorcal fit") as workspace:
        engine = Engine.of(workspace)
        for step in steps_to_fit(engine, wanted):
            ends_s = time.monotonic() + limit_s
            with progress(limit_s, grace_s=GRACE_S) as tell:
                outcome = fit_step(
                    engine,
                    step,
                    for_step(options, step, wanted),
                    progress=tell,
                    stop=lambda ends_s=ends_s: time.monotonic() > ends_s,  # type: ignore[misc]
                )
            outcomes.append(outcome)
    return _answer(outcomes, options.critic)


def _answer(outcomes: "Sequence[FitOutcome]", critic: bool) -> Answer:
    """One answer of all fits: laws with their parameters, what photographs gave by its name."""
    from scissorcal.cli.fit_law import critic_text, parameter_facts

    laws = [outcome for outcome in outcomes if _SHOWN[outcome.what] == _LAW]
    geometry = {o.what: _shown(o).facts(o) for o in outcomes if o not in laws}
    result: dict[str, object] = {}
    if laws:
        passed = [outcome for outcome in laws if not outcome.result.rejected]
        result = {
            "parameters": [row for outcome in passed for row in parameter_facts(outcome)],
            "not_a_calibration": {o.what: parameter_facts(o) for o in laws if o not in passed},
            "fits": [_shown(outcome).facts(outcome) for outcome in laws],
            "geometry": geometry,
        }
    elif len(geometry) == 1:
        (result,) = geometry.values()
    else:
        result = {"geometry": geometry}
    return Answer(
        result,
        "\n\n".join(
            _shown(outcome).text(outcome) + (critic_text(outcome) if critic else "")
            for outcome in outcomes
        ),
        verdicts=[verdict for outcome in outcomes for verdict in outcome.verdicts],
        files=[
            file
            for outcome in outcomes
            if not outcome.cached
            for file in (outcome.path, *outcome.pictures)
        ],
    )


def _shown(outcome: "FitOutcome") -> Any:
    return import_module(_SHOWN[outcome.what])


What = Literal["camera", "blade", "plate", "friction", "friction-advance", "cut"]


@command
def log(
    what: Annotated[What | None, typer.Argument(help="One fit; all if not given.")] = None,
    folder: Folder = None,
) -> Answer:
    """List the versions of each fit, the newest first; * marks the one in use.

    \b
    Example:
      $ scissorcal fit log friction
      version              written (UTC)     model                                   checks
      friction-1f2e3d4c *  2026-11-22 14:32  stribeck + angle, symmetric (standard)  passed
      friction-9a8b7c6d    2026-11-21 09:15  coulomb + viscous, symmetric (draft)    failed: k-hat
    """
    from scissorcal.workday.engine import Engine
    from scissorcal.workday.history import versions

    found = versions(Engine.of(open_workspace(folder)), what or "")
    rows = [["version", "written (UTC)", "model", "checks"]]
    for version in found:
        checks = f"failed: {', '.join(version.failed)}" if version.failed else "passed"
        checks += ", verification kept" if version.verified and not version.current else ""
        name = version.name + (" *" if version.current else "")
        rows.append([name, version.written, version.label, checks])
    text = table(rows) if found else "There is no fit yet: run 'scissorcal fit'."
    return Answer({"versions": found}, text)


@command
def restore(
    version: Annotated[
        str,
        typer.Argument(
            help="Name of a version, or how it begins; or a file (.nc) in which a fit was kept "
            "because the workspace could not be written."
        ),
    ],
    folder: Folder = None,
) -> Answer:
    """Put an earlier version of a fit back in use; the one in use is kept as a version.

    Results that were made from the fit in use are stale afterwards.

    \b
    Example:
      $ scissorcal fit restore friction-9a8b
      fits/friction.nc: friction-9a8b7c6d is in use again
      kept: fits/history/friction-20261122T143201Z-1f2e3d4c
      next: scissorcal fit cut
    """
    from scissorcal.workday.engine import Engine
    from scissorcal.workday.history import put_in_place
    from scissorcal.workday.history import restore as restore_version
    from scissorcal.workday.plan import make_plan

    found: Version | None = None
    with writes_in(folder, "scissorcal fit restore") as workspace:
        engine = Engine.of(workspace)
        if version.endswith(".nc"):
            step, before = put_in_place(engine, Path(version))
            path, said = engine.file(step.name), f"{Path(version).name} is in use"
        else:
            found, before = restore_version(engine, version)
            path, said = engine.file(f"fit {found.what}"), f"{found.name} is in use again"
    lines = [f"{workspace.relative(path)}: {said}"]
    lines += [f"kept: {workspace.relative(before)}"] if before else []
    next_command = make_plan(workspace).next_command
    lines += [f"next: {next_command}"] if next_command else []
    result = {"version": found, "fit": path, "kept": before, "next_command": next_command}
    return Answer(result, "\n".join(lines), files=[path])
