"""``scissorcal verify``"""

from pathlib import Path
from typing import TYPE_CHECKING, Literal

import click

from scissorcal.cli.opening import open_workspace
from scissorcal.cli.options import seed_option, workspace_option
from scissorcal.cli.output import Answer, command, note, table
from scissorcal.cli.progress import progress

if TYPE_CHECKING:
    from scissorcal.calibration.verify import Calibration, Check, Halves, Sensitivity, VerifyResult

_CHECKS: "tuple[Check, ...]" = ("sbc", "halves", "prior")


def _checks(context: click.Context, parameter: click.Parameter, value: str) -> "tuple[Check, ...]":
    named = [word.strip() for word in value.split(",") if word.strip()]
    unknown = [word for word in named if word not in _CHECKS]
    if unknown or not named:
        raise click.BadParameter(
            f"{', '.join(unknown) or 'nothing'} is no check; name some of {', '.join(_CHECKS)}."
        )
    return tuple(check for check in _CHECKS if check in named)


@click.command("verify")
@click.argument("what", type=click.Choice(["friction", "cut", "all"]), default="all")
@click.option(
    "--fits",
    type=click.IntRange(min=1),
    default=200,
    show_default=True,
    help="Fits to simulated data; 200 find intervals too narrow by 1.5 in 99 of 100 cases.",
)
@click.option(
    "--checks",
    callback=_checks,
    default=",".join(_CHECKS),
    show_default=True,
    help="Which checks to make, separated by commas.",
)
@click.option(
    "--prior",
    type=click.Choice(["local", "recipe"]),
    default="local",
    show_default=True,
    help="What simulated truths are drawn from: around the posterior, or from the recipe's prior.",
)
@click.option(
    "--spread",
    type=click.FloatRange(min=1.0),
    default=3.0,
    show_default=True,
    help="How much wider than the posterior the local prior is.",
)
@click.option(
    "--workers",
    type=click.IntRange(min=1),
    default=None,
    help="Processes to fit in; one for each core if not given.",
)
@click.option(
    "--cluster",
    metavar="ADDRESS",
    default=None,
    help="Scheduler of a dask.distributed cluster to fit on, such as tcp://host:8786.",
)
@seed_option
@workspace_option
@command
def verify(
    what: Literal["friction", "cut", "all"],
    fits: int,
    checks: "tuple[Check, ...]",
    prior: Literal["local", "recipe"],
    spread: float,
    workers: int | None,
    cluster: str | None,
    seed: int,
    folder: Path | None,
) -> Answer:
    """Check whether a fit's intervals mean what they say.

    sbc: raw recordings are simulated over your own motion, with the noise of your own sensors, from
    parameters around your fit, and the whole fit is run on them. The intervals must hold the
    truth as often as they say. halves: your strokes are parted into two halves, which must differ
    by no more than each claims. prior: how much the result owes to the recipe's prior.

    Every fit is kept as it is done: stop the command when you like, and give it again to go on.
    A failed verdict ends it with exit code 3; all together fail in 1 % of the cases although
    nothing is wrong.

    \b
    Example:
      $ scissorcal verify friction
      friction: coulomb + viscous, symmetric (standard)
    \b
      200 fits to simulated data (truths: a normal distribution around the posterior, ...
      quantity    in 50 %  in 90 %  width  shift     p
      inertia       52.0%    90.5%   0.98   0.03  0.71
      ...
      two halves: whole strokes of a kind, alternating by speed
      parameter  unit        one half  the other        sd     z
      inertia    kg m^2     9.492e-05  0.0001172  2.93e-05   0.8
      ...
    \b
    Width is the factor by which intervals are too narrow (above 1) or too wide, shift how far they
    lie beside the truth, p the probability of such ranks where they are right.
    """
    from scissorcal.workday.runs.verify import VerifySettings, verify_workspace

    if workers is not None and cluster is not None:
        raise click.UsageError("A cluster has workers of its own: give --workers or --cluster.")
    workspace = open_workspace(folder)
    wanted: tuple[Literal["friction", "cut"], ...] = () if what == "all" else (what,)
    settings = VerifySettings(checks=checks, fits=fits, prior=prior, spread=spread, seed=seed)
    with progress() as tell:
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
        f"right are {fifty.low:.0%} to {fifty.high:.0%} and {ninety.low:.0%} to {ninety.high:.0%}"
    )
    return f"{head}\n{table(rows, right=range(1, 6))}"


def _halves(found: "Halves") -> str:
    rows = [["parameter", "unit", "one half", "the other", "sd", "z"]]
    for row in found.rows:
        numbers = [f"{number:.4g}" for number in (row.first, row.second, row.sd)]
        rows.append([row.name, row.unit, *numbers, "-" if row.z is None else f"{row.z:.1f}"])
    return f"two halves: {found.split}\n{table(rows, right=range(2, 6))}"


def _sensitivity(found: "Sensitivity") -> str:
    rows = [["quantity", "prior", "likelihood", ""]]
    rows += [
        [row.name, f"{row.prior:.3f}", f"{row.likelihood:.3f}", row.diagnosis] for row in found.rows
    ]
    head = f"sensitivity to the powers of prior and likelihood; above {found.threshold:g} matters"
    return f"{head}\n{table(rows, right=(1, 2))}"
