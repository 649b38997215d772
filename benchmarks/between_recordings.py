"""Fits of two and three recordings that scatter by a known share: coverage, width and tails.

    python -m benchmarks.between_recordings --first 0 --count 20

Recordings of empty sweeps are made by the tests' own simulator, which shares nothing with the fit.
Inertia and levels of each recording are drawn about one centre; each row states, over all studies
and parameters: the share of 90 % intervals that hold the centre; the median half-width in percent;
the range of half-width over standard deviation, 1.645 for a normal; the largest draw in robust
standard deviations (half of what lies between 16 and 84 %); the same of the package's draws.
"""

import argparse
from dataclasses import dataclass, replace

import numpy as np
from tests.calibration.truth import QUICK, Truth, friction_recording

from scissorcal.calibration import FitResult, fit_friction
from scissorcal.package.build import pick_draws
from scissorcal.recipe.schema import FitFriction
from scissorcal.recording.recording import Recording

SETTINGS = FitFriction(rung="coulomb+viscous", symmetry="asymmetric", critic=False)
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


def judged(fit: FitResult, rng: np.random.Generator) -> Row:
    """Compare intervals with the truth, and moments with quantiles."""
    packed = pick_draws(fit, None, rng)["draws/cut.npy"]
    held, width, over, far, far_packed = [], [], [], [], []
    for place, one in enumerate(fit.parameters):
        name = "viscous" if one.name.startswith("viscous") else one.name
        true = getattr(Truth(), name, None)
        if true is None:
            continue
        low, high = np.quantile(fit.draws[:, place], [0.16, 0.84])
        robust = 0.5 * (high - low)
        held.append(bool(one.q05 <= true <= one.q95))
        width.append(0.5 * (one.q95 - one.q05) / true)
        over.append(0.5 * (one.q95 - one.q05) / one.sd)
        far.append(float(np.abs(fit.draws[:, place] - one.q50).max() / robust))
        far_packed.append(float(np.abs(packed[:, place] - one.q50).max() / robust))
    return Row(held, width, over, far, far_packed)


def line(count: int, scatter: float, only: str, rows: list[Row]) -> str:
    """A row of the table."""
    held = np.array([row.held for row in rows])
    over = np.array([row.over_sd for row in rows])
    width = 100.0 * np.median([row.half_width for row in rows])
    far = max(max(row.farthest) for row in rows)
    packed = max(max(row.farthest_packed) for row in rows)
    which = only or "all"
    return (
        f"| {count} | {100 * scatter:g} %, {which} | {held.sum()} of {held.size} | {width:.2g} "
        f"| {over.min():.2f} to {over.max():.2f} | {far:.1f} | {packed:.1f} |"
    )


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--count", type=int, default=20, help="studies for each row")
    parser.add_argument("--first", type=int, default=0, help="first seed")
    given = parser.parse_args()
    print(
        "| recordings | scatter | intervals that hold | half-width, % | half-width over sd "
        "| farthest draw, robust sds | the same of the package |\n|---|---|---|---|---|---|---|"
    )
    cases = [(scatter, "") for scatter in (0.0, 0.02, 0.1)] + [(0.1, "inertia")]
    for count in (2, 3):
        for scatter, only in cases:
            rows = []
            for seed in range(given.first, given.first + given.count):
                rng = np.random.default_rng([SEED, seed])
                recordings = made(count, scatter, seed, only)
                fit = fit_friction(recordings, SETTINGS, effort="draft", rng=rng)
                rows.append(judged(fit, rng))
            print(line(count, scatter, only, rows), flush=True)


if __name__ == "__main__":
    main()
