"""``scissorcal verify``"""

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from scissorcal.cli.opening import writes_in
from scissorcal.cli.options import RIG, Axis, Folder, options_of
from scissorcal.cli.output import Answer, command, note, table
from scissorcal.cli.progress import progress
from scissorcal.errors import InputError
from scissorcal.workday.options import VerifySettings

if TYPE_CHECKING:
    from scissorcal.calibration.verify.result import (
        Calibration,
        CheckKind,
        Halves,
        Sensitivity,
        VerifyResult,
    )
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


@dataclass(frozen=True)
class Processes:
    """Where work is done: in ``workers`` processes of this computer, or on a ``cluster``."""

    workers: int | None = None
    cluster: str | None = None


CLUSTER = typer.Option(
    metavar="ADDRESS",
    help="Scheduler of a dask.distributed cluster to fit on, such as tcp://host:8786; it can "
    "run programs as you (docs/cluster.md).",
)
_WORKERS = typer.Option(min=1, help="Processes to fit in; one for each core if not given.")
Cluster = Annotated[str | None, CLUSTER]
Workers = Annotated[int | None, _WORKERS]


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

    sbc (simulation-based calibration): recordings are simulated with your motion and sensor noise,
    from parameters around your fit, and fitted again. The intervals must contain the truth as often
    as they state. halves: your strokes are split into two halves, whose fits must agree within
    their intervals. prior: the sensitivity of the result to the recipe's prior.

    Each fit is stored when it is done: the command can be interrupted and repeated to continue. A
    failed verdict gives exit code 3; the false alarm rate of all checks together is 1 %.

    \b
    Example:
      $ scissorcal verify friction
      friction: coulomb + viscous, symmetric (standard)
    \b
      100 fits to simulated data (truths: a normal distribution around the posterior, ...
      quantity    in 50 %  in 90 %  width  shift     p
      inertia       52.0%    90.5%   0.98   0.03  0.71
      ...
      two halves: whole strokes of a kind, alternating by speed
      parameter  unit      first half  second half        sd     z
      inertia    kg m^2     9.492e-05    0.0001172  2.93e-05   0.8
      ...
    \b
    width: factor by which intervals are too narrow (above 1) or too wide; shift: their offset from
    the truth; p: probability of such ranks if the intervals are right.
    """
    from scissorcal.workday.runs.verify import verify_workspace

    workers, cluster = processes.workers, processes.cluster
    if workers is not None and cluster is not None:
        raise InputError("Give --workers or --cluster, not both: a cluster brings its workers.")
    if axis == "advance" and what != "friction":
        raise InputError(
            "--axis advance is of friction: 'scissorcal verify friction --axis advance'."
        )
    kind: FitKind | Literal["all"] = "friction-advance" if axis == "advance" else what
    wanted: tuple[FitKind, ...] = () if kind == "all" else (kind,)
    settings = replace(settings, checks=_checks(checks))
    with writes_in(folder, "scissorcal verify") as workspace, progress() as tell:
        outcomes = verify_workspace(
            workspace, wanted, settings, workers=workers, cluster=cluster, progress=tell
        )
    for sentence in [sentence for outcome in outcomes for sentence in outcome.notes]:
        note(sentence)
    return Answer(
        {"checks": [outcome.result for outcome in outcomes]},
        "\n\n".join(_text(outcome.result) for outcome in outcomes),
        verdicts=[verdict for outcome in outcomes for verdict in outcome.result.verdicts],
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


def _text(result: "VerifyResult") -> str:
    parts = [f"{result.what}: {result.rung} ({result.effort})"]
    if result.calibration:
        parts.append(_calibration(result.calibration))
    if result.halves:
        parts.append(_halves(result.halves))
    if result.sensitivity:
        parts.append(_sensitivity(result.sensitivity))
    return "\n\n".join(parts)


def _calibration(found: "Calibration") -> str:
    rows = [["quantity", "in 50 %", "in 90 %", "width", "shift", "p"]]
    for quantity in found.quantities:
        fifty, ninety = quantity.coverage
        rows.append(
            [
                quantity.name,
                f"{fifty.share:.1%}",
                f"{ninety.share:.1%}",
                f"{quantity.width:.2f}",
                f"{quantity.shift:.2f}",
                f"{quantity.ecdf_p:.2g}",
            ]
        )
    fifty, ninety = found.quantities[0].coverage
    head = (
        f"{found.fits} fits to simulated data (truths: {found.generating}; noise: {found.noise}); "
        f"expected {fifty.low:.0%} to {fifty.high:.0%} and {ninety.low:.0%} to {ninety.high:.0%}"
    )
    return f"{head}\n{table(rows, right=range(1, 6))}"


def _halves(found: "Halves") -> str:
    rows = [["parameter", "unit", "first half", "second half", "sd", "z"]]
    for row in found.rows:
        numbers = [f"{number:.4g}" for number in (row.first, row.second, row.sd)]
        rows.append([row.name, row.unit, *numbers, "-" if row.z is None else f"{row.z:.1f}"])
    return f"two halves: {found.split}\n{table(rows, right=range(2, 6))}"


def _sensitivity(found: "Sensitivity") -> str:
    rows = [["quantity", "prior", "likelihood", ""]]
    rows += [
        [row.name, f"{row.prior:.3f}", f"{row.likelihood:.3f}", row.diagnosis] for row in found.rows
    ]
    head = f"power-scaling sensitivity to prior and likelihood (limit {found.threshold:g})"
    return f"{head}\n{table(rows, right=(1, 2))}"
