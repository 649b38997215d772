"""Captures until the tolerance against the recipe's list on virtual days: minutes, band, coverage.

    python -m benchmarks.until --first 9450 --count 20 [--effort standard] [--json rows.json]

Each day has another specimen, drawn around the recipe's own as in `benchmarks/design.py`, on a rig
that was probed. Friction
and cut are captured until the tolerance, with the recipe's minutes as their limit. Then both are
fitted by themselves, and the fits are compared with the specimen's truth:

- minutes at the rig, a person's part included, against those of the recipe's list;
- *within*: share of the felt places whose band is within the tolerance, as the capture stated it
  last and as the fits of the whole state it;
- *inside*: share of the felt places whose true torque lies in the band (at the scene's confidence);
- *error*: largest and median error of the torque over felt places, as shares of the torque;
- coverage: whether 90 % intervals hold the truth, parameter by parameter, and of the running torque
  (the mean over a crack's cycle, without friction, in the middle of the scene).
"""

import json
import sys
import tempfile
import time
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from benchmarks.days import day_options

from scissorcal.aliases import Array
from scissorcal.calibration import FitResult
from scissorcal.calibration.cut.fit import fit_cut
from scissorcal.calibration.friction.fit import fit_friction
from scissorcal.calibration.result import Effort
from scissorcal.device.capture import capture_by_parts, open_writer
from scissorcal.device.cut_trajectory import cut_plan
from scissorcal.device.lockstep import LockstepLink
from scissorcal.device.probe.probe import probe
from scissorcal.device.session import RigSession
from scissorcal.device.sim.specimen import Specimen, load_specimen
from scissorcal.device.sim.truth import average_torque, true_parameters, varied
from scissorcal.device.trajectory import friction_plan
from scissorcal.package.exact import FitDraws, exact_model, torque_quantiles
from scissorcal.package.scene_torque import SceneTorque, scene_torque
from scissorcal.recipe.library import builtin_recipe, recipe_path
from scissorcal.recipe.requirements import CaptureKind
from scissorcal.recipe.schema import Recipe
from scissorcal.recording import Recording, read_recording
from scissorcal.recording.until import UntilMark
from scissorcal.workday.runs.sweep_speeds import sweep_bounds
from scissorcal.workday.stock import seconds_at_rig
from scissorcal.workday.until import Earlier, Limits, UntilTolerance

RECIPES = ("paper-80gsm", "cotton-cloth")
INTERVAL = (0.05, 0.95)
MOST_DRAWS = 500


@dataclass(frozen=True)
class Row:
    """One day; minutes and strokes are of friction and cut, ``hit`` says which intervals hold."""

    seed: int
    recipe: str
    listed_min: tuple[float, float]
    minutes: tuple[float, float]
    strokes: tuple[int, int]
    pieces: int
    ended: tuple[str, str]
    within_stated: float
    within_fitted: float
    inside: float
    error_median: float
    error_worst: float
    hit: dict[str, bool]
    update_s: float


@dataclass(frozen=True)
class Day:
    """What was captured on one day, with the last fits of friction by which the cut was chosen."""

    seed: int
    name: str
    specimen: Specimen
    listed_min: tuple[float, float]
    swept: Recording
    strokes: Recording
    friction: FitResult
    marks: tuple[UntilMark, UntilMark]
    update_s: float


def one_day(seed: int, effort: Effort) -> Row:
    """Capture, fit and judge one virtual day."""
    return judged(captured(seed, effort), effort)


def captured(seed: int, effort: Effort) -> Day:
    """Capture friction and cut until the tolerance, with the fit of friction between them."""
    name = RECIPES[seed % len(RECIPES)]
    recipe = builtin_recipe(name)
    rng = np.random.default_rng(seed)
    specimen = varied(load_specimen(recipe.specimen or ""), rng)
    link = LockstepLink(specimen, rng.spawn(1)[0])
    session = RigSession(link, recipe)
    session = replace(session, probe=probe(session))
    plans = friction_plan(recipe, link.identity), cut_plan(recipe, link.identity)
    listed = (seconds_at_rig(recipe, plans[0]) / 60.0, seconds_at_rig(recipe, plans[1]) / 60.0)
    spent: list[float] = []
    swept, first = _capture(session, "friction", Earlier(), listed[0], spent)
    friction = fit_friction((swept,), recipe.fit.friction, effort=effort, rng=rng)
    earlier = Earlier(friction_recordings=(swept,), friction=friction)
    strokes, second = _capture(session, "cut", earlier, listed[1], spent)
    median_s = float(np.median(spent))
    return Day(seed, name, specimen, listed, swept, strokes, friction, (first, second), median_s)


def judged(day: Day, effort: Effort) -> Row:
    """Fit the cut as a whole, and compare both fits with the truth."""
    recipe, specimen = builtin_recipe(day.name), day.specimen
    rng = np.random.default_rng((day.seed, 1))
    cut = fit_cut((day.strokes,), recipe, day.friction, effort=effort, rng=rng)
    scene = scene_torque(recipe, cut, day.friction)
    inside, errors = _against_truth(scene, specimen)
    swept, cuts = day.marks
    return Row(
        seed=day.seed,
        recipe=day.name,
        listed_min=day.listed_min,
        minutes=(swept.minutes, cuts.minutes),
        strokes=(swept.strokes, cuts.strokes),
        pieces=cuts.pieces,
        ended=(swept.ended, cuts.ended),
        within_stated=float(cuts.within or 0.0),
        within_fitted=float(scene.within_tolerance or 0.0),
        inside=inside,
        error_median=float(np.median(errors)),
        error_worst=float(errors.max()),
        hit={
            **_held(day.friction, specimen, recipe),
            **_held(cut, specimen, recipe),
            "running torque": _running_torque_held(recipe, cut, specimen),
        },
        update_s=day.update_s,
    )


def _capture(
    session: RigSession,
    kind: CaptureKind,
    earlier: Earlier,
    minutes: float,
    spent: list[float],
) -> tuple[Recording, UntilMark]:
    """Capture until the tolerance; ``spent`` gets the processor seconds of each choice."""
    recipe, identity = session.recipe, session.identity
    slowest = sweep_bounds(recipe, identity, session.probe)[1] if kind == "friction" else 0.0
    limits = Limits(minutes, slowest_sweep=slowest)
    choice = UntilTolerance(kind, recipe, identity, earlier, limits)

    def timed(recorded: Recording, advance: float) -> Any:
        began = time.process_time()
        part = choice(recorded, advance)
        spent.append(time.process_time() - began)
        return part

    text = recipe_path(recipe.name).read_text(encoding="utf-8")
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / f"{kind}.mcap"
        kept = replace(session, recipe_toml=text)
        with open_writer(kept, kind, path, by_parts=True) as writer:
            offered = replace(kept, recipe=choice.recipe)
            capture_by_parts(offered, kind, writer, timed, longest_s=60.0 * minutes)
        return read_recording(path), choice.marks[-1]


def _against_truth(scene: SceneTorque, specimen: Specimen) -> tuple[float, Array]:
    """Share of felt places whose band holds the true torque, and errors as shares of the torque."""
    felt = np.isfinite(scene.share)
    grid = scene.grid
    places = (grid.opening[felt], grid.opening_rate[felt], grid.contact[felt])
    truth = average_torque(specimen, *places, friction=scene.with_friction)
    if scene.with_friction:
        truth = truth - specimen.mechanism.torque_offset_Nm
    held = (grid.low[felt] <= truth) & (truth <= grid.high[felt])
    torque = grid.torque[felt]
    return float(np.mean(held)), np.abs(torque - truth) / np.abs(torque)


def _held(fit: FitResult, specimen: Specimen, recipe: Recipe) -> dict[str, bool]:
    """Whether each parameter's 90 % interval holds the specimen's value, by name.

    A constant torque of the mechanism is in the levels of friction, as the fit has it: nothing
    tells them apart while the blades move.
    """
    truth = true_parameters(
        specimen,
        angle_center=fit.structure.get("angle_center"),
        reference_indentation_m=1e-3 * recipe.fit.cut.reference_indentation_mm,
        symmetric=bool(fit.structure.get("symmetric", False)),
    )
    offset = truth.get("offset", 0.0)
    truth |= {"coulomb_pos": truth["coulomb_pos"] + offset} if "coulomb_pos" in truth else {}
    truth |= {"coulomb_neg": truth["coulomb_neg"] - offset} if "coulomb_neg" in truth else {}
    found = {}
    for index, parameter in enumerate(fit.parameters):
        if parameter.name in truth and parameter.name != "offset":
            low, high = np.quantile(fit.draws[:, index], INTERVAL)
            found[parameter.name] = bool(low <= truth[parameter.name] <= high)
    return found


def _running_torque_held(recipe: Recipe, cut: FitResult, specimen: Specimen) -> bool:
    opening = float(np.mean(recipe.scene.opening_rad))
    rate = -float(np.sqrt(np.prod(recipe.scene.opening_rate_rad_per_s)))
    inner = recipe.scene.contact_m[0]
    model = exact_model(FitDraws.of(cut, cut.draws[:MOST_DRAWS]), None)
    low, high = torque_quantiles(model, opening, rate, inner, INTERVAL)
    truth = average_torque(specimen, opening, rate, inner, friction=False)
    return bool(low <= truth <= high)


def summary(rows: list[Row]) -> dict[str, Any]:
    """What the days show together."""
    ratios = [sum(row.minutes) / sum(row.listed_min) for row in rows]
    reached = [row for row in rows if row.ended[1] == "tolerance"]
    names = sorted({name for row in rows for name in row.hit})
    counts = {name: [row.hit[name] for row in rows if name in row.hit] for name in names}
    every = [hit for row in rows for hit in row.hit.values()]
    return {
        "days": len(rows),
        "cut ended at the tolerance": len(reached),
        "friction ended at its share": sum(row.ended[0] == "tolerance" for row in rows),
        "minutes (mean)": float(np.mean([sum(row.minutes) for row in rows])),
        "minutes of the list (mean)": float(np.mean([sum(row.listed_min) for row in rows])),
        "ratio of minutes (10, 50, 90 %)": np.quantile(ratios, [0.1, 0.5, 0.9]).round(3).tolist(),
        "strokes (median)": np.median([row.strokes for row in rows], axis=0).tolist(),
        "fits that state the tolerance": sum(row.within_fitted >= 0.95 for row in reached),
        "least share stated by those fits": min((row.within_fitted for row in reached), default=1),
        "true torque in the band (mean share)": float(np.mean([row.inside for row in rows])),
        "error of the torque (median over days: median, worst)": [
            float(np.median([row.error_median for row in rows])),
            float(np.median([row.error_worst for row in rows])),
        ],
        "90 % intervals that hold the truth": [sum(every), len(every), float(np.mean(every))],
        "by parameter": {name: [sum(found), len(found)] for name, found in counts.items()},
        "processor seconds of an update (median)": float(np.median([r.update_s for r in rows])),
    }


def main() -> None:
    """Run the days and print one line each, then the summary."""
    parser = day_options(__doc__, first=9450, count=20)
    parser.add_argument("--effort", choices=("draft", "standard"), default="standard")
    arguments = parser.parse_args()
    rows = []
    for seed in range(arguments.first, arguments.first + arguments.count):
        rows.append(one_day(seed, arguments.effort))
        print(json.dumps(asdict(rows[-1])), flush=True)
    found = summary(rows)
    print(json.dumps(found, indent=1))
    if arguments.json:
        text = json.dumps({"rows": [asdict(row) for row in rows], "summary": found}, indent=1)
        arguments.json.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    sys.exit(main())
