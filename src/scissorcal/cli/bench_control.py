"""``scissorcal bench control``"""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from scissorcal.cli.options import Seed
from scissorcal.cli.output import Answer, command, table
from scissorcal.cli.progress import progress
from scissorcal.cli.verify import Cluster, Workers
from scissorcal.errors import InputError

if TYPE_CHECKING:
    from scissorcal.bench.control.result import ControlBench

Size = Annotated[
    float,
    typer.Option(min=0.01, max=100.0, help="Number of runs, as a multiple of the usual one."),
]
Output = Annotated[
    Path | None,
    typer.Option("--output", "-o", help="Folder for control.html and .json; bench if not given."),
]


@command
def control(
    size: Size = 1.0,
    output: Output = None,
    workers: Workers = None,
    cluster: Cluster = None,
    seed: Seed = 0,
) -> Answer:
    """Measure what contact adds to a camera: for a plate's pose, and for control on it.

    Simulated plates (plane, cylinder, spheres, a probed face, a disc), fixed, moving, without
    pictures for 1 s, and with mirrored poses in bursts, are followed by pictures alone, with
    contact, and with the force's direction; filters that lack a part each are shown to be
    inconsistent; and control by force and by place follows a path with each pose. Needs no
    workspace. Writes control.html and control.json. A figure beyond its limit fails the run (exit
    code 3); rows of fewer than 10 runs judge nothing.

    \b
    Example:
      $ scissorcal bench control --size 0.01
      On a plane contact brings the error along the normal to 0.31 of vision's (fixed), ...
      ...
    """
    from scissorcal.bench.control.study import Extent
    from scissorcal.workday.runs.bench_control import run_bench_control

    if workers is not None and cluster is not None:
        raise InputError("Give --workers or --cluster, not both: a cluster brings its workers.")
    with progress() as tell:
        found = run_bench_control(
            Extent.of_size(size),
            output or Path("bench"),
            seed=seed,
            workers=workers,
            cluster=cluster,
            progress=tell,
        )
    result = found.result
    facts = {
        "sentence": result.sentence,
        "seed": result.seed,
        "poses": result.poses,
        "traps": result.traps,
        "controls": result.controls,
    }
    parts = [result.sentence, _poses(result), _traps(result), _controls(result)]
    return Answer(facts, "\n\n".join(parts), result.verdicts, (found.html, found.json))


def _poses(result: "ControlBench") -> str:
    head = ["plate, scenario, told", "normal mm", "tangent mm", "yaw deg", "tilt deg"]
    rows = [[*head, "NEES", "held"]]
    for row in result.poses:
        errors = (row.normal_mm, row.tangent_mm, row.yaw_deg, row.tilt_deg)
        rows.append(
            [
                f"{row.plate}, {row.scenario}, {row.source}",
                *(f"{one.median:.3f}" for one in errors),
                f"{row.nees:.2f}",
                f"{row.held_95:.0%}",
            ]
        )
    return table(rows, right=range(1, 7))


def _traps(result: "ControlBench") -> str:
    rows = [["left out", "NEES without", "with", "normal mm without", "with"]]
    rows += [
        [
            f"{row.left_out} ({row.scenario})",
            f"{row.nees_without:.3g}",
            f"{row.nees_with:.3g}",
            f"{row.normal_mm_without:.3f}",
            f"{row.normal_mm_with:.3f}",
        ]
        for row in result.traps
    ]
    return table(rows, right=range(1, 5))


def _controls(result: "ControlBench") -> str:
    rows = [["plate, scenario, law, pose", "force N", "path mm", "touch N", "in contact"]]
    rows += [
        [
            f"{row.plate}, {row.scenario}, {row.law}, {row.pose}",
            f"{row.force_N.median:.3f}",
            f"{row.path_mm.median:.3f}",
            f"{row.touch_N.median:.2f}",
            f"{row.contact_share:.0%}",
        ]
        for row in result.controls
    ]
    return table(rows, right=range(1, 5))
