"""Fits of two and three recordings that scatter by a known share: coverage, width and tails.

    python -m benchmarks.between_recordings --first 0 --count 20
    python -m benchmarks.between_recordings --days --first 0 --count 20 [--effort standard]

Recordings of empty sweeps are made by the tests' own simulator, which shares nothing with the fit.
Inertia and levels of each recording are drawn about one centre; each row states, over all studies
and parameters: the share of 90 % intervals that hold the centre; the median half-width in percent;
the range of half-width over standard deviation, 1.645 for a normal; the largest draw in robust
standard deviations (half of what lies between 16 and 84 %); the same of the package's draws.

``--days`` fits two and three captures of whole virtual days instead, friction and cut, one row
each; nothing scatters there. Odd seeds are days of cotton, even ones of paper.
"""

import argparse
from dataclasses import dataclass, replace

import numpy as np
from benchmarks.design import FirstRig
from tests.calibration.truth import QUICK, Truth, friction_recording

from scissorcal.calibration import FitResult, fit_cut, fit_friction
from scissorcal.calibration.result import Effort
from scissorcal.device.sim.specimen import load_specimen
from scissorcal.device.sim.truth import true_parameters, varied
from scissorcal.package.exact import pick_draws
from scissorcal.recipe.schema import FitFriction
from scissorcal.recording.recording import Recording

SETTINGS = FitFriction(law="coulomb+viscous", symmetry="asymmetric", critic=False)
SCATTERED = ("inertia", "coulomb_pos", "coulomb_neg", "viscous")
SEED = 184


@dataclass(frozen=True)
class Row:
    """What one fit states of the parameters that scatter, each (p,)."""

    held: list[bool]
    half_width: list[float]
    over_sd: list[float]
    farthest: list[float]
    farthest_packed: list[float]


def made(count: int, scatter: float, seed: int, only: str = "") -> tuple[Recording, ...]:
    """Recordings whose parameters scatter about the truth; ``only`` one of them if named."""
    rng = np.random.default_rng([SEED, count, round(1e3 * scatter), seed, len(only)])
    truth, recordings = Truth(), []
    for index in range(count):
        moved = {
            name: getattr(truth, name) * float(np.exp(scatter * rng.standard_normal()))
            for name in SCATTERED
            if not only or name == only
        }
        recording = friction_recording(replace(truth, **moved), rng, QUICK)
        recordings.append(replace(recording, source=f"friction-{index}.mcap"))
    return tuple(recordings)


def judged(fit: FitResult, truth: dict[str, float], rng: np.random.Generator) -> Row:
    """Compare intervals with the truth, where it has the parameter, and moments with quantiles."""
    packed = pick_draws(fit, None, rng)["draws/cut.npy"]
    held, width, over, far, far_packed = [], [], [], [], []
    for place, one in enumerate(fit.parameters):
        true = truth.get(one.name)
        if not true:
            continue
        low, high = np.quantile(fit.draws[:, place], [0.16, 0.84])
        robust = 0.5 * (high - low)
        held.append(bool(one.q05 <= true <= one.q95))
        width.append(0.5 * (one.q95 - one.q05) / abs(true))
        over.append(0.5 * (one.q95 - one.q05) / one.sd)
        far.append(float(np.abs(fit.draws[:, place] - one.q50).max() / robust))
        far_packed.append(float(np.abs(packed[:, place] - one.q50).max() / robust))
    return Row(held, width, over, far, far_packed)


def line(label: str, rows: list[Row]) -> str:
    """A row of the table."""
    held = [held for row in rows for held in row.held]
    over = np.concatenate([row.over_sd for row in rows])
    width = 100.0 * np.median(np.concatenate([row.half_width for row in rows]))
    far = max(max(row.farthest) for row in rows)
    packed = max(max(row.farthest_packed) for row in rows)
    return (
        f"| {label} | {sum(held)} of {len(held)} | {width:.2g} "
        f"| {over.min():.2f} to {over.max():.2f} | {far:.1f} | {packed:.1f} |"
    )


def scattered(count: int, scatter: float, only: str, seeds: range) -> list[Row]:
    """Fits of recordings that scatter, one for each seed."""
    truth = {name: getattr(Truth(), name) for name in SCATTERED}
    truth |= {f"viscous_{way}": truth["viscous"] for way in ("pos", "neg")}
    rows = []
    for seed in seeds:
        rng = np.random.default_rng([SEED, seed])
        fit = fit_friction(made(count, scatter, seed, only), SETTINGS, effort="draft", rng=rng)
        rows.append(judged(fit, truth, rng))
    return rows


def day(seed: int, effort: Effort) -> list[tuple[str, Row]]:
    """Fits of two and of three captures of one virtual day."""
    name = ("paper-80gsm", "cotton-cloth")[seed % 2]
    rig = FirstRig(name, SEED * 1000 + seed)
    recipe = rig.recipe
    specimen = varied(
        load_specimen(recipe.specimen or ""), np.random.default_rng(SEED * 1000 + seed)
    )
    sweeps, cuts = (
        tuple(replace(rig.capture(kind, recipe), source=f"{kind}-{k}.mcap") for k in range(3))
        for kind in ("friction", "cut")
    )
    rows = []
    for count in (2, 3):
        rng = np.random.default_rng([SEED, seed, count])
        settings = recipe.fit.friction
        friction = fit_friction(sweeps[:count], settings, effort=effort, rng=rng)
        cut = fit_cut(cuts[:count], recipe, friction, effort=effort, rng=rng)
        for fit in (friction, cut):
            known = true_parameters(
                specimen,
                angle_center=float(friction.structure["angle_center"]),
                reference_indentation_m=1e-3 * recipe.fit.cut.reference_indentation_mm,
            )
            offset = known.pop("offset")  # a torque of the rig, which the levels contain
            known["coulomb_pos"] += offset
            known["coulomb_neg"] -= offset
            label = f"{seed} | {name}, {fit.what} | {count}"
            rows.append((label, judged(fit, known, rng)))
    return rows


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--count", type=int, default=20, help="studies for each row, or days")
    parser.add_argument("--first", type=int, default=0, help="first seed")
    parser.add_argument("--days", action="store_true", help="whole virtual days")
    parser.add_argument("--effort", choices=("draft", "standard"), default="draft")
    given = parser.parse_args()
    seeds = range(given.first, given.first + given.count)
    columns = (
        "intervals that hold | half-width, % | half-width over sd "
        "| farthest draw, robust sds | the same of the package |"
    )
    if given.days:
        print(f"| day | fit | recordings | {columns}\n|---|---|---|---|---|---|---|---|")
        for seed in seeds:
            for label, row in day(seed, given.effort):
                print(line(label, [row]), flush=True)
        return
    print(f"| recordings | scatter | {columns}\n|---|---|---|---|---|---|---|")
    cases = [(scatter, "") for scatter in (0.0, 0.02, 0.1)] + [(0.1, "inertia")]
    for count in (2, 3):
        for scatter, only in cases:
            label = f"{count} | {100 * scatter:g} %, {only or 'all'}"
            print(line(label, scattered(count, scatter, only, seeds)), flush=True)


if __name__ == "__main__":
    main()
