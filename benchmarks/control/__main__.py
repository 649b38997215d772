"""What contact adds to a camera: for a plate's pose, and for control on it.

    python -m benchmarks.control [--size 0.1] [--workers 2] [--seed 0]

Simulated plates are followed by pictures alone, with contact, and with the force's direction;
filters lack a part each; control follows a path with each pose. Prints the tables of
docs/tracking.md, and the figures that have a limit; exit code 1 where one is beyond it.
"""

import argparse
import sys
from collections.abc import Callable, Iterable
from itertools import product
from multiprocessing import Pool
from typing import Any

from benchmarks.control.control_run import POSES, ControlRun, control_run
from benchmarks.control.plates import plate_of
from benchmarks.control.pose_run import (
    BLACKOUT,
    FIXED_PLATE,
    FLIPS,
    MOVING_PLATE,
    SOURCES,
    TRAPS,
    Filter,
    PoseRun,
    pose_runs,
    settings_for,
    trap_runs,
)
from benchmarks.control.tables import (
    LEAST_RUNS,
    Runs,
    check_rows,
    checks,
    control_rows,
    force_rows,
    pose_rows,
    table,
    trap_rows,
)

POSE_CASES = {
    **{f"plane, {s.name}": ("plane", s) for s in (FIXED_PLATE, MOVING_PLATE, BLACKOUT, FLIPS)},
    "cylinder, radius 30 mm": ("cylinder, radius 30 mm", FIXED_PLATE),
    "sphere, radius 30 mm": ("sphere, radius 30 mm", FIXED_PLATE),
    "sphere, radius 10 mm": ("sphere, radius 10 mm", FIXED_PLATE),
    "probed face": ("probed face", FIXED_PLATE),
    "probed face, moving": ("probed face", MOVING_PLATE),
    "rim of a disc, radius 20 mm": ("rim of a disc, radius 20 mm", FIXED_PLATE),
    "rim of a disc, moving": ("rim of a disc, radius 20 mm", MOVING_PLATE),
}
CONTROL_CASES = {
    "hybrid, fixed plane": ("hybrid", "plane", FIXED_PLATE),
    "hybrid, moving plane": ("hybrid", "plane", MOVING_PLATE),
    "stiff position, fixed plane": ("stiff position", "plane", FIXED_PLATE),
    "stiff position, moving plane": ("stiff position", "plane", MOVING_PLATE),
    "soft position, fixed plane": ("soft position", "plane", FIXED_PLATE),
    "hybrid, fixed disc": ("hybrid", "rim of a disc, radius 20 mm", FIXED_PLATE),
}
RUNS = {"poses": 200, "traps": 60, "controls": 20}
SEEDS_APART = 1_000_000


def pose_case(name: str, seed: int) -> dict[str, PoseRun]:
    """A run of each of `SOURCES` in one world."""
    plate, scenario = POSE_CASES[name]
    filters = {source: Filter(settings_for(scenario), source) for source in SOURCES}
    return pose_runs(scenario, plate_of(plate), filters, seed)


def control_case(name: str, seed: int) -> dict[str, ControlRun]:
    """A run with each of `POSES`."""
    law, plate, scenario = CONTROL_CASES[name]
    return {pose: control_run(scenario, plate_of(plate), law, pose, seed) for pose in POSES}


def gather(
    pool: Any, run: Callable[[str, int], dict[str, Any]], cases: Iterable[str], seeds: Iterable[int]
) -> Runs:
    """Runs of every case and seed, spread over the processes of a pool."""
    tasks = list(product(cases, seeds))
    runs: Runs = {}
    for (case, _), by_filter in zip(tasks, pool.starmap(run, tasks, chunksize=4), strict=True):
        for name, result in by_filter.items():
            runs.setdefault(case, {}).setdefault(name, []).append(result)
    return runs


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--size", type=float, default=1.0, help="multiple of the usual runs")
    parser.add_argument("--workers", type=int, default=1, help="processes")
    parser.add_argument("--seed", type=int, default=0, help="same seed, same worlds")
    options = parser.parse_args()

    def seeds(kind: str) -> range:
        first = SEEDS_APART * options.seed
        return range(first, first + max(2, round(options.size * RUNS[kind])))

    with Pool(options.workers) as pool:
        poses = gather(pool, pose_case, POSE_CASES, seeds("poses"))
        head = ["plate", "vision: along the normal, mm", "with contact, mm", "ratio"]
        head += ["across, vision", "with contact", "NEES, vision and contact", "in the 95 % set"]
        table(head, pose_rows(poses))
        head = ["plate, with the force's direction", "along the normal, mm", "across, mm"]
        table([*head, "NEES", "in the 95 % set"], force_rows(poses))
        traps = gather(pool, trap_runs, TRAPS, seeds("traps"))
        table(["left out", "NEES without", "with"], trap_rows(traps))
        controls = gather(pool, control_case, CONTROL_CASES, seeds("controls"))
        for title, figure, scale in (
            ("force, N", "force_rms_N", 1.0),
            ("path, mm", "path_rms_m", 1e3),
            ("first touch beyond the wanted force, N", "touch_N", 1.0),
            ("the same over its bound", "touch_ratio", 1.0),
        ):
            head = [f"law: {title}", "vision", "with contact", "true pose"]
            table(head, control_rows(controls, figure, scale))
    if len(seeds("controls")) < LEAST_RUNS:
        print(f"No figure is judged: a law has fewer than {LEAST_RUNS} runs.")
        return
    judged = checks(poses, traps, controls)
    table(["check", "figure", "limit", "holds"], check_rows(judged))
    sys.exit(not all(check.holds for check in judged))


if __name__ == "__main__":
    main()
