"""The result of following a path: force, path, touches, and verdicts."""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from scissorcal.control.gains import HybridGains
from scissorcal.device.loop_verdicts import loop_verdicts
from scissorcal.device.motion import MotionReport
from scissorcal.kernel import ControlConfig, ControlFlag, HybridFlag
from scissorcal.verdicts import STATED, Check, Verdict

FORCE_SHARE, LEAST_FORCE_N = 0.05, 0.12
"""Of the wanted force that its rms error may be, and what it may be in any case."""
SETTLED_S = 0.2
PEAK_S = 0.1
"""After a touch, in which its force peaks; as in the benchmark."""
FORCE = Check(
    "control force", "force on a surface: rms error while the path goes on, N", at_most=STATED
)
PATH = Check(
    "control path", "path on a surface: 95 % of its errors while it goes on, mm", at_most=1.0
)
TOUCH = Check("control touch", "what is pressed on: largest force of a touch, N", at_most=STATED)
CONTACT = Check(
    "control contact", "path on a surface: how often contact was lost or let go of", at_most=0.0
)
NO_FORCE = Check(
    "control no force", "force on a surface: the balance's before the touch, N", at_most=STATED
)


@dataclass(frozen=True)
class ControlFigures:
    """Figures of a path that was followed. Forces are along the surface's normal, as the balance of
    the opening axis gives them; none is measured at the tip.

    ``seconds`` passed in CONTROL, of which ``pressing_s`` pressed and went on along ``way_mm`` of
    path. ``force_rms_N`` and ``force_95_N`` are errors of the force there, rms and what 95 % of the
    ticks do not exceed; ``force_sd_N`` is the standard deviation that the balance states, and
    ``free_N`` what it made of no force at all, before the first touch (mean). ``held_share`` of the
    ticks the blades stood, and the force was the last known one. Path errors are along the surface,
    by the encoders and the pose that was used. ``touches`` came; ``peaks_N`` says by how much the
    force of each went beyond the one that was wanted then (``force_aim``). ``losses`` of them ended
    before the path did, and ``let_goes`` counts the times without a pose.
    ``limited_share`` of the ticks an axis was at its limit.
    """

    seconds: float
    pressing_s: float
    way_mm: float
    reached_share: float
    force_rms_N: float
    force_95_N: float
    force_sd_N: float
    free_N: float
    held_share: float
    path_rms_mm: float
    path_95_mm: float
    path_largest_mm: float
    touches: int
    peaks_N: tuple[float, ...]
    losses: int
    let_goes: int
    limited_share: float


@dataclass(frozen=True)
class ControlResult:
    """A path that was followed: figures, gains, how the servo ran, verdicts and warnings.

    ``stiffness_N_per_mm`` is the stated one, ``masses_kg`` what the surface met along the path.
    """

    figures: ControlFigures
    wanted_N: float
    stiffness_N_per_mm: float
    masses_kg: tuple[float, float]
    gains: HybridGains
    report: MotionReport
    verdicts: tuple[Verdict, ...]
    warnings: tuple[str, ...]


def control_figures(
    samples: NDArray[np.void], tick_s: float, share: float, path_size: int, way: float
) -> ControlFigures:
    """Figures of the samples of CONTROL, shape (n,) with CONTROL_DTYPE; without, all are NaN or 0.

    ``share`` is how much of the surface's normal lies in the blades' plane; ``path_size`` and
    ``way`` (m) are those of the path.
    """
    flags = samples["flags"].astype(np.int64)
    touching = (flags & int(HybridFlag.CONTACT)) != 0
    going = touching & ((flags & int(ControlFlag.LETS_GO)) == 0)
    settled = going & (samples["force_aim"] >= 0.99 * samples["force_wanted"])
    settled &= _lasting(settled, round(SETTLED_S / tick_s))
    force = (samples["force"] - samples["force_wanted"])[settled] / share
    error = 1e3 * np.abs(samples["place"] - samples["place_wanted"])[settled]
    lets_go = (flags & int(ControlFlag.LETS_GO)) != 0
    touched = np.flatnonzero((flags & int(HybridFlag.TOUCHED) != 0) & ~lets_go)
    first = int(touched[0]) if len(touched) else len(samples)
    free = samples["force"][:first] / share
    beyond = (samples["force"] - samples["force_aim"]) / share
    limited = int(HybridFlag.EFFORT_LIMITED | HybridFlag.PATH_YIELDS)
    done = (flags & int(ControlFlag.DONE)) != 0
    before = lets_go & ~np.logical_or.accumulate(done) if len(done) else lets_go
    return ControlFigures(
        seconds=len(samples) * tick_s,
        pressing_s=float(np.count_nonzero(settled)) * tick_s,
        way_mm=1e3 * way,
        reached_share=float(samples["index"].max()) / (path_size - 1) if len(samples) else 0.0,
        force_rms_N=_rms(force),
        force_95_N=_share(np.abs(force)),
        force_sd_N=_mean(samples["force_sd"][settled]) / share,
        free_N=_mean(free),
        held_share=_mean((flags & int(ControlFlag.HELD) != 0)[settled]),
        path_rms_mm=_rms(error),
        path_95_mm=_share(error),
        path_largest_mm=float(error.max()) if len(error) else math.nan,
        touches=len(touched),
        peaks_N=tuple(
            float(beyond[at : at + round(PEAK_S / tick_s)].max()) for at in touched.tolist()
        ),
        losses=int(np.count_nonzero((flags & int(HybridFlag.LOST) != 0) & ~lets_go)),
        let_goes=int(np.count_nonzero(np.diff(before.astype(np.int8), prepend=0) > 0)),
        limited_share=_mean((flags & limited) != 0),
    )


def control_verdicts(
    figures: ControlFigures,
    wanted_N: float,
    config: ControlConfig,
    peak_N: float,
    report: MotionReport,
) -> tuple[Verdict, ...]:
    """Judge a path: force, path, touch, contact, what was made of no force, and the loop."""
    allowed = max(LEAST_FORCE_N, FORCE_SHARE * wanted_N)
    force = f"The force was off by {figures.force_rms_N:.3f} N (rms) of {wanted_N:g} N."
    path = f"The tip was off its path by {figures.path_95_mm:.2f} mm in 95 % of the time."
    peak = max(figures.peaks_N, default=math.nan)
    touch = f"A touch peaked {peak:.2f} N beyond the force that was wanted then."
    lost = f"Contact was lost {figures.losses} times, and {figures.let_goes} times let go of."
    free = f"Before the touch the balance made {figures.free_N:.2f} N of no force."
    return (
        FORCE.judge(figures.force_rms_N, force,
                    f"{force} Fit friction anew, or go slower.", allowed),
        PATH.judge(figures.path_95_mm, path,
                   f"{path} Go slower, or fit friction of the advance anew."),
        TOUCH.judge(peak, touch,
                    f"{touch} State the plate's stiffness as it is (plate.touch).", peak_N),
        CONTACT.judge(figures.losses + figures.let_goes, lost,
                      f"{lost} Check the pose and the surface, or press harder."),
        NO_FORCE.judge(abs(figures.free_N), free,
                       f"{free} Fit friction anew: the force is wrong by as much.",
                       config.law.touch_force / 2.0),
        *loop_verdicts("control", report, report.latency, round(1e6 * config.tick_s)),
    )  # fmt: skip


def _lasting(holds: NDArray[np.bool_], ticks: int) -> NDArray[np.bool_]:
    """Where something has held for so many ticks."""
    since = np.arange(len(holds)) - np.maximum.accumulate(
        np.where(holds, -1, np.arange(len(holds)))
    )
    return np.asarray(since > ticks)


def _rms(values: NDArray[np.floating]) -> float:
    return float(np.sqrt(np.mean(np.square(values, dtype=np.float64)))) if len(values) else math.nan


def _mean(values: NDArray[Any]) -> float:
    return float(np.mean(values, dtype=np.float64)) if len(values) else math.nan


def _share(values: NDArray[np.floating]) -> float:
    return float(np.quantile(values, 0.95)) if len(values) else math.nan
