"""Verdicts and intervals on days without a fault: what fails by chance, and what intervals hold.

    python -m benchmarks.clean_days --count 200 [--first 1] [--rig RIG] [--json FILE]

Each day has another rig and another material, drawn around a recipe's own; recipes take turns
(paper, cloth, press-only and, on every tenth day, photographs). It is captured in virtual time and
fitted at standard effort as `scissorcal fit` does. Nothing is wrong on any of these days, so that
every failed verdict is a false one. Parameters are compared with the truth: the share of 90 %
intervals that hold it and the root mean square of (mean - truth) / sd, and so are friction's torque
at the middle opening, mean of both directions and half their difference, at four rates. ``second``
is the rig of tests/second_rig, whose motion, friction and crack share no code with the product;
``coarse`` the same behind 20,000 counts, with a late motor, ``coarser`` behind 8,192. Their days
are fitted without a package.
All friction of the coarse rigs builds up after a turn, a share of 1, which no interval of a share
holds.
"""

import json
import os
import sys
import tempfile
import warnings
from collections import defaultdict
from concurrent.futures import ProcessPoolExecutor
from dataclasses import asdict, dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from benchmarks.days import day_options

from scissorcal.calibration import FitResult, fit_cut, fit_friction
from scissorcal.calibration.friction.layout import friction_and_offset
from scissorcal.workday.demo.day import make_day, specimen_of
from scissorcal.workday.workspace import create_workspace

sys.path.insert(0, str(Path(__file__).parents[1]))

RECIPES = ("paper-80gsm", "cotton-cloth", "press-only")
PHOTOGRAPHED, EVERY = "paper-photographed", 10
RATES_rad_per_s = (0.05, 0.1, 0.3, 1.0)
LEVELS = (
    *("coulomb_pos", "coulomb_neg", "viscous_pos", "viscous_neg"),
    *("stribeck", "stribeck_rate", "angle_slope", "angle_curvature"),
)
Truth = dict[str, float]


@dataclass(frozen=True)
class Estimate:
    """One quantity of a day: its truth, posterior mean and sd, and 90 % interval."""

    name: str
    truth: float
    mean: float
    sd: float
    low: float
    high: float

    @property
    def inside(self) -> bool:
        return self.low <= self.truth <= self.high


@dataclass(frozen=True)
class Row:
    """One day: which, the verdicts that failed (scope and check, with its reason), estimates."""

    seed: int
    recipe: str
    laws: tuple[str, ...]
    failed: tuple[tuple[str, str], ...]
    estimates: tuple[Estimate, ...]


def own_day(seed: int) -> Row:
    """A day of the product's virtual rig, with captures, photographs and fits as in the demo."""
    from scissorcal.device.sim.truth import true_parameters

    name = PHOTOGRAPHED if seed % EVERY == 0 else RECIPES[seed % len(RECIPES)]
    with tempfile.TemporaryDirectory() as folder:
        workspace = create_workspace(Path(folder) / "day", name)
        geometry, outcomes = make_day(workspace, seed=seed)
        specimen = specimen_of(workspace.recipe(), seed)
    fits = [outcome.result for outcome in outcomes]
    verdicts = [v for found in geometry for v in found.verdicts]
    return _row(seed, name, fits, verdicts, partial(true_parameters, specimen))


def _coarse(counts_per_turn: int, material: Any) -> Any:
    from tests.second_rig import presets

    rig = presets.coarse(material)
    return replace(rig, sensors=replace(rig.sensors, counts_per_turn=counts_per_turn))


def second_day(seed: int, counts_per_turn: int = 0) -> Row:
    """A day of the second rig, fitted in memory; of the coarse one where its counts are given."""
    from benchmarks.design import SecondRig
    from tests.second_rig.truth import true_parameters

    material = ("paper", "cotton")[seed % 2]
    day = SecondRig(material, seed, partial(_coarse, counts_per_turn) if counts_per_turn else None)
    friction = fit_friction(
        (day.capture("friction", day.recipe),),
        day.recipe.fit.friction,
        effort="standard",
        rng=np.random.default_rng([seed, 1]),
    )
    cut = fit_cut(
        (day.capture("cut", day.recipe),),
        day.recipe,
        friction,
        effort="standard",
        rng=np.random.default_rng([seed, 2]),
    )
    return _row(seed, material, [friction, cut], [], partial(true_parameters, day.rig))


def _row(seed: int, name: str, fits: list[FitResult], verdicts: list[Any], truth: Any) -> Row:
    failed = [v for v in verdicts if v.status == "fail"]
    estimates: list[Estimate] = []
    for fit in fits:
        failed += fit.rejected
        estimates += _friction(fit, truth) if fit.what == "friction" else _cut(fit, truth)
    return Row(
        seed,
        name,
        tuple(fit.candidate for fit in fits),
        tuple((f"{verdict.scope} {verdict.check}", verdict.why) for verdict in failed),
        tuple(estimates),
    )


def _friction(fit: FitResult, truth: Any) -> list[Estimate]:
    centre = float(fit.structure["angle_center"])
    true = truth(angle_center=centre)
    if not fit.structure["symmetric"]:
        true["coulomb_pos"] += true["offset"]
        true["coulomb_neg"] -= true["offset"]
        true["offset"] = 0.0
    left_out = {"offset", *(name for name in ("presliding_share",) if true.get(name) == 1.0)}
    known = [p for p in fit.parameters if p.name in true and p.name not in left_out]
    if fit.structure["symmetric"]:
        both = truth(angle_center=centre, symmetric=True)
        true = {**true, **both}
        known = [p for p in fit.parameters if p.name in both and p.name != "offset"]
    rows = [_of_draws(p.name, true[p.name], fit.column(p.name)) for p in known]
    # Friction as it is rendered: unequal levels contain an offset of the joint, and the fit's own
    # offset is what is left of the sensors' zeros.
    levels = {name: np.asarray(true[name]) for name in LEVELS}
    draws = {p.name: fit.column(p.name) for p in fit.parameters if p.name != "offset"}
    for rate in RATES_rad_per_s:
        opening, closing = (
            friction_and_offset(draws, centre, sign * rate) * np.ones(len(fit.draws))
            for sign in (1.0, -1.0)
        )
        ahead, back = (float(friction_and_offset(levels, centre, s * rate)) for s in (1.0, -1.0))
        rows.append(_of_draws(f"torque at {rate:g}", (ahead - back) / 2, (opening - closing) / 2))
        half = f"half difference at {rate:g}"
        rows.append(_of_draws(half, (ahead + back) / 2, (opening + closing) / 2))
    return rows


def _cut(fit: FitResult, truth: Any) -> list[Estimate]:
    true = truth(reference_indentation_m=float(fit.structure["reference_indentation_m"]))
    wanted = {"response_force", "response_exponent", "fracture_energy", "kappa"}
    if fit.structure["fracture"] == "smooth":
        wanted -= {"fracture_energy"}
    return [
        _of_draws(p.name, true[p.name], fit.column(p.name))
        for p in fit.parameters
        if p.name in wanted and p.name in true
    ]


def _of_draws(name: str, truth: float, draws: Any) -> Estimate:
    low, high = np.quantile(draws, [0.05, 0.95])
    return Estimate(name, truth, float(draws.mean()), float(draws.std(ddof=1)), low, high)


def tabulated(rows: list[Row]) -> str:
    """Days with a failed verdict, and by quantity and recipe what intervals held."""
    wrong = [row for row in rows if row.failed]
    lines = [f"{len(wrong)} of {len(rows)} days have a failed verdict"]
    for row in wrong:
        lines += [f"  day {row.seed}, {row.recipe}: {name}: {why}" for name, why in row.failed]
    groups: dict[tuple[str, str], list[Estimate]] = defaultdict(list)
    for row in rows:
        for one in row.estimates:
            groups["all", one.name].append(one)
            groups[row.recipe, one.name].append(one)
    lines.append(f"{'quantity':28s}{'days':>6s}{'inside':>8s}{'z rms':>7s}{'z mean':>8s}")
    for (recipe, name), found in sorted(groups.items(), key=lambda item: item[0][0] != "all"):
        z = np.array([(one.mean - one.truth) / one.sd for one in found if one.sd > 0])
        inside = np.mean([one.inside for one in found])
        label = name if recipe == "all" else f"{recipe}: {name}"
        lines.append(
            f"{label:28s}{len(found):6d}{inside:8.0%}{np.sqrt(np.mean(z**2)):7.2f}{z.mean():8.2f}"
        )
    return "\n".join(lines)


DAYS: dict[str, Any] = {
    "own": own_day,
    "second": second_day,
    "coarse": partial(second_day, counts_per_turn=20_000),
    "coarser": partial(second_day, counts_per_turn=8_192),
}


def _safely(day: Any, seed: int) -> Row:
    warnings.simplefilter("ignore")
    try:
        return day(seed)
    except Exception as error:  # noqa: BLE001 - a day that ends in an error is a failed one
        said = f"{type(error).__name__}: {error}"
        return Row(seed, "-", (), ((said.split(":")[0], said),), ())


def main() -> None:
    parser = day_options(__doc__, first=1, count=200)
    parser.add_argument("--rig", choices=sorted(DAYS), default="own")
    parser.add_argument("--workers", type=int, default=len(os.sched_getaffinity(0)))
    arguments = parser.parse_args()
    os.environ.setdefault("OMP_NUM_THREADS", "1")
    seeds = range(arguments.first, arguments.first + arguments.count)
    rows: list[Row] = []
    with ProcessPoolExecutor(arguments.workers) as pool:
        for row in pool.map(partial(_safely, DAYS[arguments.rig]), seeds):
            rows.append(row)
            said = "; ".join(name for name, _ in row.failed) or "no check failed"
            print(f"day {row.seed}, {row.recipe}: {said}", file=sys.stderr, flush=True)
            if arguments.json:
                arguments.json.write_text(json.dumps([asdict(one) for one in rows]))
    print(tabulated(rows))


if __name__ == "__main__":
    main()
