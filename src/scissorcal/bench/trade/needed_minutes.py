"""Minutes at the rig that a candidate needs: the recipe's plan with no more speeds than that."""

from collections.abc import Sequence
from typing import TypeVar

import numpy as np

from scissorcal.bench.trade.case import Case
from scissorcal.device.cut_trajectory import cut_plan
from scissorcal.device.session import identity_of
from scissorcal.device.trajectory import friction_plan
from scissorcal.errors import ScissorcalError
from scissorcal.recipe.schema import CaptureCut, CaptureFriction

Section = TypeVar("Section", CaptureFriction, CaptureCut)


def needed_minutes(case: Case, friction_speeds: int, cut_speeds: int) -> float | None:
    """Planned minutes of motion with so many of the recipe's speeds, pauses excluded.

    A law with k parameters over the rate needs motion at k speeds at least; repeats, strokes,
    sheets and the excitation stay as the recipe has them. None where the recordings do not state
    the rig, or where the recipe cannot be planned on it.
    """
    known = next((one for one in case.friction if "schema_hash" in one.device), None)
    if known is None:
        return None
    identity, capture = identity_of(known.device, known.source), case.recipe.capture
    fewer = capture.model_copy(
        update={
            "friction": _with_speeds(capture.friction, friction_speeds),
            "cut": _with_speeds(capture.cut, cut_speeds),
        }
    )
    recipe = case.recipe.model_copy(update={"capture": fewer})
    plans = (friction_plan, cut_plan) if case.cut else (friction_plan,)
    try:
        return sum(plan(recipe, identity).duration_s for plan in plans) / 60.0
    except ScissorcalError:
        return None


def some_speeds(speeds: Sequence[float], count: int) -> tuple[float, ...]:
    """So many of some speeds, spread over their range: the middle one alone, or both ends and more.

    >>> some_speeds((0.05, 0.12, 0.3, 0.7, 1.5), 1), some_speeds((0.05, 0.12, 0.3, 0.7, 1.5), 3)
    ((0.3,), (0.05, 0.3, 1.5))
    """
    ordered = sorted(set(speeds))
    if count == 1:
        return (ordered[len(ordered) // 2],)
    picked = np.unique(np.round(np.linspace(0, len(ordered) - 1, min(count, len(ordered)))))
    return tuple(ordered[int(index)] for index in picked)


def _with_speeds(section: Section, count: int) -> Section:
    speeds = some_speeds(section.speeds_rad_per_s, count)
    return section.model_copy(update={"speeds_rad_per_s": speeds})
