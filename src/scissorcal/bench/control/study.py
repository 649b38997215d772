"""Which runs the benchmark makes, and what one job of them does."""

import time
from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import zip_longest

from scissorcal.bench.control.control_study import LAWS, POSES, ControlRun, control_run
from scissorcal.bench.control.objects import plate_of
from scissorcal.bench.control.pose_study import SOURCES, PoseRun, pose_runs
from scissorcal.bench.control.traps import (
    BLACKOUT,
    FIXED_PLATE,
    FLIPS,
    MOVING_PLATE,
    settings_for,
    trap_runs,
    traps,
)

POSE_CASES = (
    *(("plane", scenario) for scenario in (FIXED_PLATE, MOVING_PLATE, BLACKOUT, FLIPS)),
    *((plate, FIXED_PLATE) for plate in ("cylinder 30 mm", "sphere 30 mm", "sphere 10 mm")),
    ("spline", FIXED_PLATE),
    ("spline", MOVING_PLATE),
    ("disc 20 mm", FIXED_PLATE),
    ("disc 20 mm", MOVING_PLATE),
)
"""Plate and scenario of each case; every case is run with each of `SOURCES`."""
CONTROL_CASES = (("plane", FIXED_PLATE), ("plane", MOVING_PLATE), ("disc 20 mm", FIXED_PLATE))
POSE_SEEDS, TRAP_SEEDS, CONTROL_SEEDS = 10, 5, 2
"""Runs of one job: some seconds of work."""
SPREAD = 1_000_000
"""Seeds of one run of the benchmark lie so far from those of the next."""


@dataclass(frozen=True)
class Extent:
    """How many runs each row has: of the pose (in every case), of the traps, and of control."""

    pose_runs: int = 200
    trap_runs: int = 60
    control_runs: int = 20

    @classmethod
    def of_size(cls, size: float) -> "Extent":
        """The default times a size; 2 runs at least."""
        whole = cls()
        counts = (whole.pose_runs, whole.trap_runs, whole.control_runs)
        return cls(*(max(2, round(size * count)) for count in counts))


@dataclass(frozen=True)
class Job:
    """Runs of one case: a kind, what it is about, and its seeds."""

    kind: str
    case: int
    law: str = ""
    pose: str = ""
    seeds: tuple[int, ...] = ()


@dataclass(frozen=True)
class Done:
    """What a job found: pose runs by source, or control runs; and the seconds it took."""

    job: Job
    poses: dict[str, list[PoseRun]]
    controls: list[ControlRun]
    seconds: float = 0.0


def jobs(extent: Extent, seed: int) -> Iterator[Job]:
    """The jobs of a run, one of each kind in turn."""
    first = SPREAD * seed
    poses = [
        Job("pose", case, seeds=chunk)
        for chunk in _chunks(first, extent.pose_runs, POSE_SEEDS)
        for case in range(len(POSE_CASES))
    ]
    trapped = [
        Job("trap", case, seeds=chunk)
        for chunk in _chunks(first, extent.trap_runs, TRAP_SEEDS)
        for case in range(len(traps()))
    ]
    controls = [
        Job("control", case, law, pose, chunk)
        for chunk in _chunks(first, extent.control_runs, CONTROL_SEEDS)
        for case in range(len(CONTROL_CASES))
        for law in LAWS
        for pose in POSES
    ]
    for together in zip_longest(poses, trapped, controls):
        yield from (job for job in together if job is not None)


def do(job: Job) -> Done:
    """Do one job."""
    began = time.monotonic()
    done = Done(job, {}, [])
    if job.kind == "pose":
        plate, scenario = POSE_CASES[job.case]
        settings = settings_for(scenario)
        done = Done(job, pose_runs(scenario, plate_of(plate), SOURCES, settings, job.seeds), [])
    elif job.kind == "trap":
        without, whole = trap_runs(traps()[job.case], job.seeds)
        done = Done(job, {"without": without, "with": whole}, [])
    else:
        plate, scenario = CONTROL_CASES[job.case]
        runs = [control_run(scenario, plate_of(plate), job.law, job.pose, s) for s in job.seeds]
        done = Done(job, {}, runs)
    return replace(done, seconds=time.monotonic() - began)


def _chunks(first: int, count: int, size: int) -> list[tuple[int, ...]]:
    seeds = range(first, first + count)
    return [tuple(seeds[at : at + size]) for at in range(0, count, size)]
