"""What a run of `bench control` ends in, as its JSON twin holds it."""

import json
from collections import defaultdict
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from datetime import datetime
from typing import Literal

import numpy as np

from scissorcal.bench.control.control_study import LAWS, POSES, ControlRun
from scissorcal.bench.control.pose_study import SOURCES, PoseRun
from scissorcal.bench.control.study import CONTROL_CASES, POSE_CASES, Done
from scissorcal.bench.control.traps import traps
from scissorcal.bench.run import Run
from scissorcal.tracking.consistency import mean_band, share_held
from scissorcal.verdicts import Check, Verdict

ALARM = 0.05
"""False-alarm rate of the verdict on consistency over all rows together."""
TRAP_SHARE = 0.999
"""Of mean NEES within the band of a trap's check: 8 filters fail it by chance once in 125 runs."""
LEAST_RUNS = 10
"""Fewer runs than these judge nothing."""
CONSISTENCY = Check(
    "bench.control consistency",
    "the pose's stated uncertainty: rows whose mean NEES no consistent filter has",
    at_most=0.0,
)
NORMAL_ERROR = {
    scenario: Check(
        f"bench.control normal error, {scenario}",
        "what contact adds to the camera: error along the normal over that of vision alone",
        at_most=limit,
    )
    for scenario, limit in (("fixed", 0.35), ("moving", 0.2), ("1 s without pictures", 0.1))
}
TRAPS = Check(
    "bench.control traps", "parts of the filter: crippled filters that stay consistent", at_most=0.0
)
FORCE = Check("bench.control hybrid force", "the pressing force: its rms error, N", at_most=0.12)
STIFF = Check(
    "bench.control stiff position",
    "what contact adds to control by place: force error with vision over that with contact",
    at_least=2.5,
)
PATH = Check(
    "bench.control path on a disc",
    "what contact adds to the path: its error with vision over that with contact",
    at_least=4.0,
)
TOUCH = Check(
    "bench.control touch", "first touch: peak over approach speed times sqrt(k m)", at_most=1.5
)


@dataclass(frozen=True)
class Spread:
    """Median and 95 % quantile of an error's size over the runs."""

    median: float
    most_95: float


@dataclass(frozen=True)
class PoseRow:
    """One plate, scenario and source: errors at the end of the runs, and consistency.

    ``nees`` is the mean over the runs, which a consistent filter keeps within ``band_95`` with
    95 %; ``held_95`` is the share of runs whose error lies in the filter's 95 % set.
    """

    plate: str
    scenario: str
    source: str
    runs: int
    normal_mm: Spread
    tangent_mm: Spread
    yaw_deg: Spread
    tilt_deg: Spread
    normal_over_vision: float
    nees: float
    band_95: tuple[float, float]
    consistent: bool
    held_95: float
    restarts: int


@dataclass(frozen=True)
class TrapRow:
    """A part of the filter, and what goes wrong without it: mean NEES, which should be 6."""

    left_out: str
    scenario: str
    runs: int
    nees_without: float
    held_95_without: float
    normal_mm_without: float
    nees_with: float
    held_95_with: float
    normal_mm_with: float


@dataclass(frozen=True)
class ControlRow:
    """One plate, scenario, law and pose: errors as rms over each run after it has settled."""

    plate: str
    scenario: str
    law: str
    pose: str
    runs: int
    force_N: Spread
    path_mm: Spread
    touch_N: Spread
    touch_ratio: Spread
    contact_share: float


@dataclass(frozen=True)
class ControlBench:
    """The whole result."""

    format: Literal["scissorcal-bench-control/1"]
    created: datetime
    scissorcal_version: str
    machine: str
    workers: int
    seed: int
    seconds: float
    jobs: int
    planned: int
    sentence: str
    poses: tuple[PoseRow, ...]
    traps: tuple[TrapRow, ...]
    controls: tuple[ControlRow, ...]
    verdicts: tuple[Verdict, ...]


def summarise(run: Run, done: Sequence[Done]) -> ControlBench:
    """The tables and verdicts of all jobs that were done."""
    poses, trapped, controls = _pose_rows(done), _trap_rows(done), _control_rows(done)
    return ControlBench(
        format="scissorcal-bench-control/1",
        created=run.created,
        scissorcal_version=run.version,
        machine=run.machine,
        workers=run.workers,
        seed=run.seed,
        seconds=run.seconds,
        jobs=len(done),
        planned=run.planned,
        sentence=_sentence(poses, controls),
        poses=poses,
        traps=trapped,
        controls=controls,
        verdicts=(
            _consistent(poses),
            *(_normal(poses, scenario) for scenario in NORMAL_ERROR),
            _traps(trapped),
            _force(controls),
            _stiff(controls),
            _path(controls),
            _touch(controls),
        ),
    )


def _pose_rows(done: Sequence[Done]) -> tuple[PoseRow, ...]:
    rows = []
    for case, (plate, scenario) in enumerate(POSE_CASES):
        found: dict[str, list[PoseRun]] = defaultdict(list)
        for one in done:
            if (one.job.kind, one.job.case) == ("pose", case):
                for source, runs in one.poses.items():
                    found[source] += runs
        if found:
            vision = _spread(found["vision"], "normal_m", 1e3).median
            rows += [
                _pose_row(plate, scenario.name, source, found[source], vision) for source in SOURCES
            ]
    return tuple(rows)


def _pose_row(
    plate: str, scenario: str, source: str, runs: Sequence[PoseRun], vision_mm: float
) -> PoseRow:
    values = [run.nees for run in runs]
    low, high = mean_band(len(runs))
    mean, normal = float(np.mean(values)), _spread(runs, "normal_m", 1e3)
    return PoseRow(
        plate=plate,
        scenario=scenario,
        source=source,
        runs=len(runs),
        normal_mm=normal,
        tangent_mm=_spread(runs, "tangent_m", 1e3),
        yaw_deg=_spread(runs, "yaw_rad", np.degrees(1.0)),
        tilt_deg=_spread(runs, "tilt_rad", np.degrees(1.0)),
        normal_over_vision=normal.median / vision_mm,
        nees=mean,
        band_95=(low, high),
        consistent=low <= mean <= high,
        held_95=share_held(values),
        restarts=sum(run.restarts for run in runs),
    )


def _trap_rows(done: Sequence[Done]) -> tuple[TrapRow, ...]:
    rows = []
    for case, trap in enumerate(traps()):
        chosen = [one for one in done if (one.job.kind, one.job.case) == ("trap", case)]
        without = [run for one in chosen for run in one.poses["without"]]
        whole = [run for one in chosen for run in one.poses["with"]]
        if not chosen:
            continue
        rows.append(
            TrapRow(
                left_out=trap.left_out,
                scenario=trap.scenario.name,
                runs=len(without),
                nees_without=float(np.mean([run.nees for run in without])),
                held_95_without=share_held([run.nees for run in without]),
                normal_mm_without=_spread(without, "normal_m", 1e3).median,
                nees_with=float(np.mean([run.nees for run in whole])),
                held_95_with=share_held([run.nees for run in whole]),
                normal_mm_with=_spread(whole, "normal_m", 1e3).median,
            )
        )
    return tuple(rows)


def _control_rows(done: Sequence[Done]) -> tuple[ControlRow, ...]:
    rows = []
    for case, (plate, scenario) in enumerate(CONTROL_CASES):
        for law in LAWS:
            for pose in POSES:
                runs = [
                    run
                    for one in done
                    if (one.job.kind, one.job.case, one.job.law, one.job.pose)
                    == ("control", case, law, pose)
                    for run in one.controls
                ]
                if runs:
                    rows.append(_control_row(plate, scenario.name, law, pose, runs))
    return tuple(rows)


def _control_row(
    plate: str, scenario: str, law: str, pose: str, runs: Sequence[ControlRun]
) -> ControlRow:
    return ControlRow(
        plate=plate,
        scenario=scenario,
        law=law,
        pose=pose,
        runs=len(runs),
        force_N=_spread(runs, "force_rms_N", 1.0),
        path_mm=_spread(runs, "path_rms_m", 1e3),
        touch_N=_spread(runs, "touch_N", 1.0),
        touch_ratio=_spread(runs, "touch_ratio", 1.0),
        contact_share=float(np.mean([run.contact_share for run in runs])),
    )


def _spread(runs: Sequence[object], name: str, scale: float) -> Spread:
    sizes = np.abs([getattr(run, name) for run in runs]) * scale
    return Spread(float(np.median(sizes)), float(np.quantile(sizes, 0.95)))


def _consistent(rows: Sequence[PoseRow]) -> Verdict:
    """All rows together: the farthest mean NEES in a band that holds all with 95 %."""
    if not rows or min(row.runs for row in rows) < LEAST_RUNS:
        return _too_few(CONSISTENCY)
    share = (1.0 - ALARM) ** (1.0 / len(rows))
    outside = []
    for row in rows:
        low, high = mean_band(row.runs, share=share)
        if not low <= row.nees <= high:
            outside.append(f"{row.plate}, {row.scenario}, {row.source} ({row.nees:.2f})")
    inside = sum(row.consistent for row in rows)
    said = (
        f"{inside} of {len(rows)} rows have a mean NEES within their 95 % band; "
        f"{len(outside)} are outside the band that holds all rows together with 95 %"
    )
    named = f": {'; '.join(outside)}." if outside else "."
    return CONSISTENCY.judge(len(outside), said + named)


def _normal(rows: Sequence[PoseRow], scenario: str) -> Verdict:
    check = NORMAL_ERROR[scenario]
    row = next(
        (r for r in rows if (r.plate, r.scenario, r.source) == ("plane", scenario, "contact")),
        None,
    )
    if row is None or row.runs < LEAST_RUNS:
        return _too_few(check)
    said = (
        f"With contact the median error along the normal is {row.normal_mm.median:.3g} mm, "
        f"{row.normal_over_vision:.2g} of that of vision alone (limit {check.threshold:g})."
    )
    return check.judge(row.normal_over_vision, said)


def _traps(rows: Sequence[TrapRow]) -> Verdict:
    if not rows or min(row.runs for row in rows) < LEAST_RUNS:
        return _too_few(TRAPS)
    missed, failed = [], []
    for row in rows:
        low, high = mean_band(row.runs, share=TRAP_SHARE)
        if not row.nees_without > high:
            missed.append(row.left_out)
        if not low <= row.nees_with <= high:
            failed.append(row.left_out)
    said = (
        f"{len(rows) - len(missed)} of {len(rows)} crippled filters fail their consistency check, "
        f"and the whole filter passes it in {len(rows) - len(failed)}"
    )
    named = f"; not without: {', '.join(missed)}" if missed else ""
    named += f"; the whole one fails beside: {', '.join(failed)}" if failed else ""
    return TRAPS.judge(len(missed) + len(failed), f"{said}{named}.")


def _force(rows: Sequence[ControlRow]) -> Verdict:
    chosen = [row for row in rows if row.law == "hybrid"]
    if not chosen or min(row.runs for row in chosen) < LEAST_RUNS:
        return _too_few(FORCE)
    worst = max(chosen, key=lambda row: row.force_N.median)
    said = (
        f"Hybrid control holds the force to {worst.force_N.median:.2g} N rms at worst "
        f"({worst.plate}, {worst.scenario}, pose from {worst.pose}; limit {FORCE.threshold:g})."
    )
    return FORCE.judge(worst.force_N.median, said)


def _stiff(rows: Sequence[ControlRow]) -> Verdict:
    said = "Stiff position control errs by {:.2g} N with vision, by {:.2g} N with contact as well"
    rows = _fixed(rows, "plane", "stiff position")
    return _better(STIFF, rows, lambda row: row.force_N.median, said)


def _path(rows: Sequence[ControlRow]) -> Verdict:
    said = (
        "Around a disc of 20 mm radius the path errs by {:.2g} mm with vision, by {:.2g} mm with "
        "contact as well"
    )
    rows = _fixed(rows, "disc 20 mm", "hybrid")
    return _better(PATH, rows, lambda row: row.path_mm.median, said)


def _better(
    check: Check, rows: Sequence[ControlRow], error: Callable[[ControlRow], float], said: str
) -> Verdict:
    """Judge an error with vision over that with contact as well; ``said`` takes both."""
    found = {row.pose: row for row in rows if row.runs >= LEAST_RUNS}
    if not {"vision", "fused"} <= set(found):
        return _too_few(check)
    vision, contact = error(found["vision"]), error(found["fused"])
    gain, least = vision / contact, check.threshold
    why = f"{said.format(vision, contact)}: {gain:.2g} times better (at least {least:g})."
    return check.judge(gain, why)


def _fixed(rows: Sequence[ControlRow], plate: str, law: str) -> list[ControlRow]:
    """Rows of a fixed plate and a law."""
    return [row for row in rows if (row.plate, row.scenario, row.law) == (plate, "fixed", law)]


def _touch(rows: Sequence[ControlRow]) -> Verdict:
    chosen = [row for row in rows if row.law == "hybrid" and row.scenario == "fixed"]
    if not chosen or min(row.runs for row in chosen) < LEAST_RUNS:
        return _too_few(TOUCH)
    worst = max(chosen, key=lambda row: row.touch_ratio.median)
    ratio = worst.touch_ratio.median
    said = (
        f"The first touch peaks at {worst.touch_N.median:.2g} N, {ratio:.2g} of what the "
        f"approach's speed times sqrt(k m) allows (limit {TOUCH.threshold:g})."
    )
    return TOUCH.judge(ratio, said)


def _too_few(check: Check) -> Verdict:
    why = f"Fewer than {LEAST_RUNS} runs judge nothing: take a larger --size."
    return check.not_evaluated(why)


def _sentence(poses: Sequence[PoseRow], controls: Sequence[ControlRow]) -> str:
    gains = [
        f"{row.normal_over_vision:.2g} of vision's ({row.scenario})"
        for row in poses
        if (row.plate, row.source) == ("plane", "contact")
    ]
    said = f"On a plane contact brings the error along the normal to {', '.join(gains)}."
    for scenario in dict.fromkeys(row.scenario for row in controls):
        forces = [
            f"{row.force_N.median:.2g} N ({row.pose})"
            for row in controls
            if (row.plate, row.law, row.scenario) == ("plane", "hybrid", scenario)
        ]
        said += f" Hybrid control of the force, {scenario} plate: {', '.join(forces)} rms."
    return said


def control_text(result: ControlBench) -> str:
    """The JSON twin."""
    from pydantic import TypeAdapter

    plain = TypeAdapter(ControlBench).dump_python(result, mode="json")
    return json.dumps(plain, ensure_ascii=False, allow_nan=False, indent=1) + "\n"
