"""Simulation-based calibration of friction and cut fits under strongly autocorrelated noise.

A virtual rig is captured in virtual time and fitted; data are then simulated over its motion with
AR(1) noise on bins, refitted, and the truth ranked, as 'scissorcal verify' does with a user's fit:

    python -m benchmarks.sbc --friction 400 --cut 200 --workers 2 --folder build/sbc

Prints, for each parameter, the coverage of 50 % and 90 % intervals and uniformity p-values, the
share escalated, and the time it took. Results are kept in the folder: a stopped run goes on.
"""

import argparse
import json
import time
from dataclasses import asdict, replace
from pathlib import Path
from typing import get_args

import numpy as np

from scissorcal.calibration import load_fit
from scissorcal.calibration.experiment import Experiment
from scissorcal.calibration.friction import friction_experiment
from scissorcal.calibration.verify import Study, make_study, run, tasks_of
from scissorcal.calibration.verify.judgement import RANKS_SHARE
from scissorcal.calibration.verify.result import Calibration
from scissorcal.calibration.verify.summary import summarise_simulated
from scissorcal.inference import ArNoise
from scissorcal.recipe.load import read_text
from scissorcal.workday.fits import fit_workspace
from scissorcal.workday.pool import open_pool
from scissorcal.workday.recordings import usable_recordings
from scissorcal.workday.records import RecordFile
from scissorcal.workday.workspace import FitKind, Workspace, create_workspace


def main() -> None:
    """Run from the command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--friction", type=int, default=400, help="simulated friction fits")
    parser.add_argument("--cut", type=int, default=200, help="simulated cut fits")
    parser.add_argument("--rho", type=float, default=0.9, help="correlation of neighbouring bins")
    parser.add_argument("--spread", type=float, default=3.0, help="width of the local prior")
    parser.add_argument("--recipe", default="paper-80gsm")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--folder", type=Path, default=Path("build/sbc"))
    given = parser.parse_args()
    workspace = captured(given.folder.absolute(), given.recipe, given.seed, given.cut > 0)
    for kind in get_args(FitKind):
        count = getattr(given, kind)
        if count:
            study, units = studied(workspace, kind, given.rho, given.spread, given.seed)
            found, seconds = calibrated(study, units, count, given.workers, given)
            report(kind, found, seconds, given.workers)
            text = json.dumps(asdict(found), indent=1)
            (workspace.root / f"sbc-{kind}.json").write_text(text, encoding="utf-8")


def captured(folder: Path, recipe_name: str, seed: int, cut: bool) -> Workspace:
    """A workspace with captures of a virtual rig and their fits; made where it is missing."""
    from scissorcal.device.capture import capture_cut, capture_friction, open_writer
    from scissorcal.device.lockstep import LockstepLink
    from scissorcal.device.sim.specimen import load_specimen

    there = (folder / "recipe.toml").is_file()
    workspace = Workspace(folder) if there else create_workspace(folder, recipe_name)
    recipe, text = workspace.recipe(), read_text(workspace.recipe_path)
    specimen = load_specimen(recipe.specimen or recipe.name)
    wanted: tuple[FitKind, ...] = ("friction", "cut") if cut else ("friction",)
    for index, kind in enumerate(wanted):
        if workspace.recordings(kind):
            continue
        link = LockstepLink(specimen, np.random.default_rng([seed, index]))
        with open_writer(workspace.new_recording(kind), kind, link, recipe, text) as writer:
            (capture_friction if kind == "friction" else capture_cut)(link, recipe, writer)
        link.close()
    fit_workspace(workspace, wanted, effort="standard", seed=seed)
    return workspace


def studied(
    workspace: Workspace, kind: FitKind, rho: float, spread: float, seed: int
) -> tuple[Study, list[str]]:
    """The study of a fit with AR(1) noise as loud as its own residuals, and its units."""
    recipe = workspace.recipe()
    recordings = usable_recordings(workspace, recipe, kind).recordings
    friction = load_fit(workspace.fit_path("friction"))
    fit = friction if kind == "friction" else load_fit(workspace.fit_path("cut"))
    if kind == "friction":
        experiment: Experiment = friction_experiment(recordings, recipe.fit.friction, fit)
    else:
        from scissorcal.calibration.cut import cut_experiment

        experiment = cut_experiment(recordings, recipe, friction, fit)
    study = make_study(experiment, fit, seed=seed, spread=spread)
    innovation = study.noise.marginal_sd * float(np.sqrt(1 - rho**2))
    print(
        f"{kind}: {fit.rung}; {len(experiment.observed)} bins, {len(np.unique(experiment.strokes))}"
        f" strokes",
        flush=True,
    )
    units = [fit.parameter(name).unit for name in study.quantities[:-1]]
    return replace(study, noise=ArNoise(1, (rho,), innovation)), [*units, fit.effort_unit]


def calibrated(
    study: Study, units: list[str], count: int, workers: int, given: argparse.Namespace
) -> tuple[Calibration, float]:
    """Calibrate with ``count`` fits; those that are there already are not done again."""
    what = study.experiment.what
    key = f"{what} {given.recipe} {given.rho} {given.spread} {given.seed}"
    began = time.perf_counter()
    with (
        open_pool(workers) as pool,
        RecordFile(given.folder / f"sbc-{what}.jsonl", key) as file,
    ):
        done = {record["index"] for record in file.records}
        left = [task for task in tasks_of(study, ("sbc",), count) if task.index not in done]
        pool.work(_Job(study), left, file.append)
        records = [record for record in file.records if record["index"] < count]
    found = summarise_simulated(study, records, units, RANKS_SHARE)
    if found is None:
        raise SystemExit(f"every simulated fit of {what} broke: {records[0]['broken']}")
    return found, time.perf_counter() - began


def report(kind: str, found: Calibration, seconds: float, workers: int) -> None:
    """Print the table of one kind of fit."""
    print(
        f"{kind}: {found.fits} fits, noise {found.noise}; {found.seconds:.2f} s a fit (median), "
        f"{seconds:.0f} s in all on {workers} workers; escalated {found.escalated:.1%}, "
        f"unreliable {found.unreliable:.1%}, broken {len(found.broken)}, "
        f"{found.effective:.0f} effective draws"
    )
    print(f"{'quantity':18} {'50 %':>7} {'90 %':>7} {'width':>6} {'shift':>6} {'ecdf p':>8} chi2 p")
    for row in found.quantities:
        fifty, ninety = (coverage.share for coverage in row.coverage)
        chi = float("nan") if row.chi_square_p is None else row.chi_square_p
        print(
            f"{row.name:18} {fifty:7.1%} {ninety:7.1%} {row.width:6.2f} {row.shift:6.2f} "
            f"{row.ecdf_p:8.2g} {chi:.2g}",
            flush=True,
        )
    fifty, ninety = found.quantities[0].coverage
    print(f"right are {fifty.low:.1%}-{fifty.high:.1%} and {ninety.low:.1%}-{ninety.high:.1%}")
    print(f"uniform where p > {found.band.alpha:.2g}")


class _Job:
    """One fit; a class, so that it can travel to worker processes."""

    def __init__(self, study: Study) -> None:
        self.study = study

    def __call__(self, task):
        return run(self.study, task)


if __name__ == "__main__":
    main()
