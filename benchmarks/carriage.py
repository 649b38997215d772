"""Mass and friction of carriages on two virtual rigs: errors, and what the 90 % intervals hold.

    python -m benchmarks.carriage --count 42

Each run draws another carriage: mass, Coulomb and viscous friction, how late its force acts, the
encoder's step, and on the second rig (tests/second_rig, Runge-Kutta steps) how dry friction builds
up after a reversal. Captures and fits are those of the commands; standard effort.
"""

import argparse
import sys
import tempfile
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from scissorcal.calibration.friction.advance import fit_friction_advance
from scissorcal.calibration.result import FitResult
from scissorcal.device.capture import capture, open_writer
from scissorcal.device.lockstep import LockstepLink
from scissorcal.device.session import RigSession
from scissorcal.device.sim.specimen import load_specimen
from scissorcal.recipe.library import builtin_recipe
from scissorcal.recipe.schema import Recipe
from scissorcal.recording import Recording, read_recording

RECIPE = "paper-80gsm"
NAMES = {"inertia": "mass", "coulomb": "Coulomb friction", "viscous": "viscous friction"}


@dataclass(frozen=True)
class Run:
    """One carriage: its true parameters, recording and recipe."""

    truth: dict[str, float]
    recording: Recording
    recipe: Recipe


@dataclass(frozen=True)
class Row:
    """What a fit says of one parameter: relative error, relative sd, and whether 90 % hold it."""

    name: str
    error: float
    sd: float
    held: bool


def main() -> None:
    """Run the benchmark and print its tables."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--count", type=int, default=42)
    parser.add_argument("--seed", type=int, default=200)
    parser.add_argument("--rig", choices=("first", "second", "both"), default="both")
    given = parser.parse_args()
    wanted = ("first", "second") if given.rig == "both" else (given.rig,)
    for name in wanted:
        rows: list[Row] = []
        odd: list[str] = []
        for seed in range(given.seed, given.seed + given.count):
            made = RIGS[name](seed)
            fit = fit_friction_advance(
                (made.recording,),
                made.recipe.fit.advance,
                effort="standard",
                rng=np.random.default_rng([seed, 3]),
            )
            rows += [_row(fit, key, value) for key, value in made.truth.items()]
            failed = [verdict.check for verdict in fit.rejected]
            odd += [f"seed {seed}, {fit.candidate}: {', '.join(failed)} failed"] if failed else []
            print(f"{name} rig, seed {seed}: {fit.candidate}", file=sys.stderr)
        _print(name, rows, odd)


def first_rig(seed: int) -> Run:
    """A carriage on the virtual rig of --device sim, captured in virtual time."""
    rng = np.random.default_rng([seed, 1])
    truth = _carriage(rng)
    specimen = load_specimen("office-paper")
    advance = specimen.mechanism.advance.model_copy(
        update={
            "mass_kg": truth["inertia"],
            "coulomb_N": truth["coulomb"],
            "viscous_N_s_per_m": truth["viscous"],
        }
    )
    lag_ms, step_um = _log_uniform(rng, 0.3, 2.5), _log_uniform(rng, 0.5, 5.0)
    parts = {
        "mechanism": specimen.mechanism.model_copy(update={"advance": advance}),
        "motor": specimen.motor.model_copy(update={"lag_ms": lag_ms}),
        "sensors": specimen.sensors.model_copy(update={"advance_step_um": step_um}),
    }
    link = LockstepLink(specimen.model_copy(update=parts), np.random.default_rng(seed))
    recipe = builtin_recipe(RECIPE)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "friction-advance.mcap"
        session = RigSession(link, recipe)
        with open_writer(session, "friction-advance", path) as writer:
            capture(session, "friction-advance", writer)
        return Run(truth, read_recording(path), recipe)


def second_rig(seed: int) -> Run:
    """A carriage on the rig of other construction; friction builds up after a reversal."""
    from tests.second_rig import capture_friction_advance as captured
    from tests.second_rig import coarse, fine, recipe_for

    rng = np.random.default_rng([seed, 2])
    truth = _carriage(rng)
    rig = (fine if seed % 2 else coarse)()
    mechanism = replace(
        rig.mechanism,
        sledge_mass_kg=truth["inertia"],
        sledge_coulomb_N=truth["coulomb"],
        sledge_viscous_N_s_per_m=truth["viscous"],
        sledge_presliding_m=_log_uniform(rng, 5e-7, 1e-4),
    )
    motor = replace(rig.motor, delay_ticks=rng.uniform(0.0, 1.5), lag_ticks=rng.uniform(0.0, 1.0))
    sensors = replace(rig.sensors, sledge_step_m=_log_uniform(rng, 5e-7, 5e-6))
    rig = replace(rig, mechanism=mechanism, motor=motor, sensors=sensors)
    recipe = recipe_for(rig)
    recording, _ = captured(rig, recipe, np.random.default_rng(seed))
    return Run(truth, recording, recipe)


RIGS: dict[str, Callable[[int], Run]] = {"first": first_rig, "second": second_rig}


def _carriage(rng: np.random.Generator) -> dict[str, float]:
    return {
        "inertia": _log_uniform(rng, 0.45, 1.5),
        "coulomb": _log_uniform(rng, 0.2, 2.0),
        "viscous": _log_uniform(rng, 1.0, 12.0),
    }


def _log_uniform(rng: np.random.Generator, low: float, high: float) -> float:
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))


def _row(fit: FitResult, name: str, truth: float) -> Row:
    """One parameter; of an asymmetric law the mean of both directions."""
    names = [parameter.name for parameter in fit.parameters]
    sides = [one for one in (name, f"{name}_pos", f"{name}_neg") if one in names]
    draws = (
        np.mean([fit.column(one) for one in sides], axis=0) if sides else np.zeros(len(fit.draws))
    )
    low, high = np.quantile(draws, [0.05, 0.95])
    return Row(name, draws.mean() / truth - 1.0, draws.std() / truth, bool(low <= truth <= high))


def _print(rig: str, rows: list[Row], odd: list[str]) -> None:
    print(f"\n{rig} rig")
    print("| parameter | 90 % intervals hold | median error | largest error | median sd |")
    print("|---|---|---|---|---|")
    for name, words in NAMES.items():
        own = [row for row in rows if row.name == name]
        errors = np.abs([row.error for row in own])
        print(
            f"| {words} | {sum(row.held for row in own)} of {len(own)} | "
            f"{100 * np.median(errors):.3f} % | {100 * errors.max():.2f} % | "
            f"{100 * np.median([row.sd for row in own]):.2f} % |"
        )
    print("\n".join(odd) or "no check failed")


if __name__ == "__main__":
    main()
