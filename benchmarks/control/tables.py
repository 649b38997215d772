"""The tables of docs/tracking.md from runs, and the figures that have a limit."""

import math
from collections.abc import Iterable, Sequence
from typing import Any, NamedTuple

import numpy as np
from benchmarks.consistency import mean_band, share_held
from benchmarks.control.control_run import POSES
from benchmarks.control.pose_run import BLACKOUT, PoseRun

LEAST_RUNS = 10
"""Fewer runs than these judge nothing."""
ALARM = 0.05
"""False-alarm rate of the check on consistency over all rows together."""
TRAP_SHARE = 0.999
"""Of mean NEES within the band of a trap's check: 8 filters fail it by chance once in 125 runs."""

Runs = dict[str, dict[str, list[Any]]]
"""Runs by case, then by the filter or the pose of control."""


class Check(NamedTuple):
    """A figure and its limit."""

    name: str
    figure: float
    limit: float
    at_least: bool = False

    @property
    def holds(self) -> bool:
        """Whether the figure keeps its limit."""
        return self.figure >= self.limit if self.at_least else self.figure <= self.limit


def median(runs: Iterable[Any], name: str) -> float:
    """Median size of a figure over runs."""
    return float(np.median(np.abs([getattr(run, name) for run in runs])))


def mean_nees(runs: Iterable[PoseRun]) -> float:
    """Mean over runs: 6 where the stated covariance is right."""
    return float(np.mean([run.nees for run in runs]))


def pose_rows(poses: Runs) -> Iterable[list[str]]:
    """Rows of the first table: pictures alone, and with contact."""
    for name, runs in poses.items():
        both = runs["vision"], runs["contact"]
        normal = [1e3 * median(part, "normal_m") for part in both]
        yield [
            name,
            *map(shown, normal),
            shown(normal[1] / normal[0], 2),
            *(shown(1e3 * median(part, "across_m")) for part in both),
            ", ".join(f"{mean_nees(part):.1f}" for part in both),
            ", ".join(f"{100.0 * held(part):.0f}" for part in both) + " %",
        ]


def force_rows(poses: Runs) -> Iterable[list[str]]:
    """Rows of the table of the force's direction."""
    for name, runs in poses.items():
        part = runs["force"]
        errors = (1e3 * median(part, error) for error in ("normal_m", "across_m"))
        yield [name, *map(shown, errors), f"{mean_nees(part):.1f}", f"{100.0 * held(part):.0f} %"]


def trap_rows(traps: Runs) -> Iterable[list[str]]:
    """Rows of the filters that lack a part."""
    for name, runs in traps.items():
        yield [name, *(shown(mean_nees(runs[part]), 2) for part in ("without", "with"))]


def control_rows(controls: Runs, figure: str, scale: float = 1.0) -> Iterable[list[str]]:
    """Rows of one figure of control with each pose."""
    for name, runs in controls.items():
        yield [name, *(shown(scale * median(runs[pose], figure)) for pose in POSES)]


def checks(poses: Runs, traps: Runs, controls: Runs) -> list[Check]:
    """The figures that have a limit."""
    rows = [part for runs in poses.values() for part in runs.values()]
    share = (1.0 - ALARM) ** (1.0 / len(rows))
    crippled = [runs["without"] for runs in traps.values()]
    whole = [runs["with"] for runs in traps.values()]

    def contact_over_vision(name: str) -> float:
        return median(poses[name]["contact"], "normal_m") / median(
            poses[name]["vision"], "normal_m"
        )

    def vision_over_contact(name: str, figure: str) -> float:
        return median(controls[name]["vision"], figure) / median(controls[name]["contact"], figure)

    def worst(figure: str, *names: str) -> float:
        return max(median(controls[name][pose], figure) for name in names for pose in POSES)

    fixed, moving, disc = "hybrid, fixed plane", "hybrid, moving plane", "hybrid, fixed disc"
    added = "normal error with contact over that of vision, "
    return [
        Check("rows outside the band of all", sum(not keeps(part, share) for part in rows), 0),
        Check(added + "fixed", contact_over_vision("plane, fixed"), 0.35),
        Check(added + "moving", contact_over_vision("plane, moving"), 0.2),
        Check(added + BLACKOUT.name, contact_over_vision(f"plane, {BLACKOUT.name}"), 0.1),
        Check("crippled filters that stay consistent", sum(not exceeds(p) for p in crippled), 0),
        Check("whole filters that do not", sum(not keeps(part, TRAP_SHARE) for part in whole), 0),
        Check("force of hybrid control, N", worst("force_rms_N", fixed, moving, disc), 0.12),
        Check(
            "force of stiff position control with vision over that with contact",
            vision_over_contact("stiff position, fixed plane", "force_rms_N"),
            2.5,
            at_least=True,
        ),
        Check(
            "path on a disc with vision over that with contact",
            vision_over_contact(disc, "path_rms_m"),
            4.0,
            at_least=True,
        ),
        Check("first touch over its bound", worst("touch_ratio", fixed, disc), 1.5),
    ]


def check_rows(judged: Iterable[Check]) -> Iterable[list[str]]:
    """Rows of the checks."""
    for check in judged:
        limit = f"at {'least' if check.at_least else 'most'} {check.limit:g}"
        yield [check.name, f"{check.figure:.3g}", limit, "yes" if check.holds else "no"]


def held(runs: Iterable[PoseRun]) -> float:
    """Share of runs in the filter's 95 % set."""
    return share_held([run.nees for run in runs])


def keeps(runs: Sequence[PoseRun], share: float) -> bool:
    """Whether mean NEES lies in the band that a consistent filter keeps with ``share``."""
    low, high = mean_band(len(runs), share)
    return low <= mean_nees(runs) <= high


def exceeds(runs: Sequence[PoseRun]) -> bool:
    """Whether mean NEES shows a filter that is too sure of its pose."""
    return mean_nees(runs) > mean_band(len(runs), TRAP_SHARE)[1]


def shown(value: float, digits: int = 3) -> str:
    """A figure with that many significant digits, of which three decimals at most."""
    decimals = digits - 1 - math.floor(math.log10(value)) if value > 0.0 else 0
    return f"{value:,.{min(max(decimals, 0), 3)}f}"


def table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> None:
    """Print a table in Markdown."""
    for row in (head, ["---"] * len(head), *rows):
        print(f"| {' | '.join(row)} |")
    print(flush=True)
