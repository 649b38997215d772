"""Recommendations of `bench trade` on other captures of the same specimen, against its truth.

    python -m benchmarks.trade_on_fresh_days --count 10 [--first 1] [--budget "3 min"] [--json FILE]

Each day has another rig and another material, drawn around a recipe's own; recipes take turns
(paper, cloth, press-only). It is captured in virtual time, fitted, and traded within the budget.
Each setting that is recommended in place of the present one is then applied to fresh captures of
the same specimen, which have other noise and other sheets, fitted and compiled as a package is.
The torque of the tables is compared with the specimen's own over the scene: the worst error, as a
share of the largest torque. A recommendation holds on a capture where that error is at most what
its sentence states: its error on the traded capture and the limit of 90 % on simulated ones. The
second share counts captures on which the setting adds no more than the limit of one knob to the
error that the present settings have there. Loop rates and candidates of the edge change no fit, and
are not tried.
"""

import json
import sys
import tempfile
import warnings
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
from benchmarks.days import day_options
from numpy.typing import NDArray

from scissorcal.bench.trade.case import Case
from scissorcal.bench.trade.fits import fit_case
from scissorcal.bench.trade.knob import make_knob
from scissorcal.bench.trade.models import held_law, model_of_law, tables_of
from scissorcal.bench.trade.point import Curve
from scissorcal.bench.trade.recommend import stated
from scissorcal.bench.trade.together import Together, rendered_torque
from scissorcal.bench.trade.torque import scene_places
from scissorcal.cli.bench import seconds_of
from scissorcal.device.sim.specimen import Specimen
from scissorcal.device.sim.truth import average_torque
from scissorcal.workday.demo.day import make_day, specimen_of
from scissorcal.workday.engine import Engine
from scissorcal.workday.options import Processes, TradeOptions
from scissorcal.workday.runs.bench import trade_workspace
from scissorcal.workday.runs.bench_case import load_case
from scissorcal.workday.workspace import create_workspace

RECIPES = ("paper-80gsm", "cotton-cloth", "press-only")
Choice = tuple[str, str]


@dataclass(frozen=True)
class Row:
    """One recommendation on one fresh capture; shares of the scene's largest torque.

    ``stated`` is what its sentence states, ``error`` that of the recommended setting, ``present``
    that of the present ones, ``limit`` of one knob.
    """

    seed: int
    recipe: str
    knob: str
    label: str
    capture: int
    stated: float
    error: float
    present: float
    limit: float

    @property
    def holds(self) -> bool:
        """Whether the error is at most what was stated."""
        return self.error <= self.stated

    @property
    def enough(self) -> bool:
        """Whether the setting adds no more than one knob may."""
        return self.error <= self.present + self.limit


def day(seed: int, budget_s: float, fresh: int, workers: int) -> list[Row]:
    """Trade one day, and try its recommendations on so many fresh captures."""
    name = RECIPES[seed % len(RECIPES)]
    with tempfile.TemporaryDirectory() as folder:
        workspace = create_workspace(Path(folder) / "day", name)
        make_day(workspace, seed=seed)
        specimen = specimen_of(workspace.recipe(), seed)
        settings = TradeOptions(budget_s=budget_s)
        trade = trade_workspace(workspace, settings, Processes(workers))[0]
        print(f"day {seed}, {name}: {trade.measured} measurements in {trade.seconds:g} s")
        for sentence in trade.sentences:
            print(f"  {sentence}", flush=True)
        claims = {choice: share for curve in trade.curves for choice, share in stated_by(curve)}
        rows = []
        for capture in range(1, fresh + 1 if claims else 1):
            again = create_workspace(Path(folder) / f"again{capture}", name)
            make_day(again, seed=seed, capture=capture)
            case = load_case(Engine.of(again))
            present = error_of(case, specimen, ())
            for choice, share in claims.items():
                error = error_of(case, specimen, (choice,))
                rows.append(Row(seed, name, *choice, capture, share, error, present, trade.limit))
    return rows


def stated_by(curve: Curve) -> Iterator[tuple[Choice, float]]:
    """The recommended setting of a curve, if another than the present one, and what is stated."""
    for point in curve.points:
        share = stated(curve, point)
        tried = point.recommended and not point.setting.present
        if tried and share is not None and make_knob(curve.knob).combined:
            yield (curve.knob, point.setting.label), share


def error_of(case: Case, specimen: Specimen, choices: tuple[Choice, ...]) -> float:
    """Worst error of the tables' torque with these choices, as a share of the largest torque."""
    knob = Together(choices)
    chosen, _ = knob.prepared(case, knob.settings(case)[1], 0)
    cut, friction, _, _ = fit_case(chosen, 0)
    assert cut is not None
    model = model_of_law(held_law(chosen, cut, friction))
    found = np.asarray(rendered_torque(chosen, model, tables_of(chosen, model)), dtype=float)
    true = true_torque(case, specimen)
    return float(np.nanmax(np.abs(found - true)) / np.nanmax(np.abs(true)))


def true_torque(case: Case, specimen: Specimen) -> NDArray[np.float64]:
    """The specimen's torque at the places of the scene (n,), within the recipe's limit."""
    places, recipe = scene_places(case), case.recipe
    torque = average_torque(
        specimen,
        places.opening,
        places.opening_rate,
        places.contact,
        recipe.scene.render_friction,
    )
    return np.clip(torque, -recipe.limits.torque_Nm, recipe.limits.torque_Nm)


def tabulated(rows: list[Row]) -> str:
    """Each recommendation with what was stated and found, and the shares that hold."""
    lines = [f"{'day':>5s} {'setting':42s}{'stated':>8s}{'found':>8s}{'present':>8s}"]
    for row in rows:
        said = "" if row.holds else "  not held"
        said += "" if row.enough else "  adds more than the limit"
        name = f"{row.recipe} {row.knob} {row.label}"
        figures = "".join(f"{100.0 * v:7.2f}%" for v in (row.stated, row.error, row.present))
        lines.append(f"{row.seed:5d} {name:42s}{figures}{said}")
    held, enough = (sum(getattr(row, name) for row in rows) for name in ("holds", "enough"))
    choices = {(row.seed, row.knob, row.label) for row in rows}
    lines.append(
        f"{len(choices)} recommendations on {len(rows)} fresh captures: {held} within what was "
        f"stated, {enough} within the limit of one knob beside the present settings"
    )
    return "\n".join(lines)


def main() -> None:
    parser = day_options(__doc__, first=1, count=10)
    parser.add_argument("--budget", default="3 min")
    parser.add_argument("--fresh", type=int, default=2, help="fresh captures of each day")
    parser.add_argument("--workers", type=int, default=1)
    arguments = parser.parse_args()
    warnings.simplefilter("ignore")
    rows: list[Row] = []
    budget_s = seconds_of(arguments.budget)
    for seed in range(arguments.first, arguments.first + arguments.count):
        rows += day(seed, budget_s, arguments.fresh, arguments.workers)
        print(f"day {seed} done", file=sys.stderr, flush=True)
        if arguments.json:
            arguments.json.write_text(json.dumps([asdict(one) for one in rows]))
    print(tabulated(rows))


if __name__ == "__main__":
    main()
