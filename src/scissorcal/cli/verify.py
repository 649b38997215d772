"""``scissorcal verify``"""

from dataclasses import replace
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from scissorcal.cli.opening import writes_in
from scissorcal.cli.options import RIG, Axis, Folder, options_of
from scissorcal.cli.output import Answer, command, note
from scissorcal.cli.progress import progress
from scissorcal.errors import InputError
from scissorcal.workday.options import Processes, VerifySettings

if TYPE_CHECKING:
    from scissorcal.calibration.verify.result import CheckKind
    from scissorcal.workday.workspace import FitKind

_CHECKS: "tuple[CheckKind, ...]" = ("sbc", "halves", "prior")
_ALL_CHECKS = ",".join(_CHECKS)


What = Annotated[Literal["friction", "cut", "all"], typer.Argument(help="The fit to check.")]
Checks = Annotated[str, typer.Option(help="Which checks to make, separated by commas.")]
_SETTINGS = {
    "fits": typer.Option(
        min=1,
        help="Fits to simulated data: 100 detect intervals too narrow by a factor of 1.5 in 2 of "
        "3 cases and by 2 always, 200 by 1.5 in 98 of 100.",
    ),
    "prior": typer.Option(
        help="What simulated truths are drawn from: around the posterior, or from the "
        "recipe's prior."
    ),
    "spread": typer.Option(min=1.0, help="Width of the local prior, in posterior widths."),
    "seed": RIG["seed"],
}


CLUSTER = typer.Option(
    metavar="ADDRESS",
    help="Scheduler of a dask.distributed cluster to fit on, such as tcp://host:8786; it can "
    "run programs as you (docs/cluster.md).",
)
_WORKERS = typer.Option(min=1, help="Processes to fit in; one for each core if not given.")


@command
@options_of({**_SETTINGS, "workers": _WORKERS, "cluster": CLUSTER})
def verify(
    settings: VerifySettings,
    processes: Processes,
    what: What = "all",
    axis: Axis = "opening",
    checks: Checks = _ALL_CHECKS,
    folder: Folder = None,
) -> Answer:
    """Check whether a fit's intervals mean what they say.

    sbc (simulation-based calibration, Talts et al. 2018, doi 10.48550/arXiv.1804.06788): recordings
    are simulated with your motion and sensor noise, from parameters around your fit, and fitted
    again. The intervals must contain the truth as often as they state. halves: your strokes are
    split into two halves, whose fits must agree within their intervals. prior: the sensitivity of
    the result to the recipe's prior.

    Each fit is stored when it is done: the command can be interrupted and repeated to continue. A
    failed verdict gives exit code 3; the false alarm rate of all checks together is 1 %.

    \b
    Example:
      $ scissorcal verify friction
      friction: coulomb + viscous, symmetric (standard)
    \b
      Verification: intervals on simulated data: Intervals hold the truth as often as they claim.
                 50 % interval holds [%]  90 % interval holds [%]  uniformity p  too narrow by  ...
        inertia  52 (32 to 68)            90 (78 to 98)            0.71          0.981          ...
        ...
      Verification: two halves of the data: Fitted to each half alone, the predicted effort ...
                 first half         second half        sd of the difference  z
        inertia  0.000192 kg m^2    0.000190 kg m^2    0.0000047 kg m^2      0.34
        ...
    \b
    in brackets: the range of correct intervals; too narrow by: the factor, below 1 for intervals
    that are too wide; shift: their offset from the truth; uniformity p: probability of such ranks
    if the intervals are right.
    """
    from scissorcal.report import panels_text
    from scissorcal.report.subjects.trust import check_panels
    from scissorcal.workday.runs.verify import verify_workspace

    if processes.workers is not None and processes.cluster is not None:
        raise InputError("Give --workers or --cluster, not both: a cluster brings its workers.")
    if axis == "advance" and what != "friction":
        raise InputError(
            "--axis advance is of friction: 'scissorcal verify friction --axis advance'."
        )
    kind: FitKind | Literal["all"] = "friction-advance" if axis == "advance" else what
    wanted: tuple[FitKind, ...] = () if kind == "all" else (kind,)
    settings = replace(settings, checks=_checks(checks))
    with writes_in(folder, "scissorcal verify") as workspace, progress() as tell:
        outcomes = verify_workspace(workspace, wanted, settings, processes, tell)
    for sentence in [sentence for outcome in outcomes for sentence in outcome.notes]:
        note(sentence)
    checked = [outcome.result for outcome in outcomes]
    return Answer(
        {"checks": checked},
        "\n\n".join(
            f"{check.what}: {check.candidate} ({check.effort})\n\n"
            f"{panels_text(check_panels(check, check.what))}"
            for check in checked
        ),
        verdicts=[verdict for check in checked for verdict in check.verdicts],
        files=[outcome.path for outcome in outcomes],
    )


def _checks(value: str) -> "tuple[CheckKind, ...]":
    named = [word.strip() for word in value.split(",") if word.strip()]
    unknown = [word for word in named if word not in _CHECKS]
    if unknown or not named:
        raise InputError(
            f"--checks: {', '.join(unknown) or 'nothing'} is not a check; choose from "
            f"{', '.join(_CHECKS)}."
        )
    return tuple(check for check in _CHECKS if check in named)
