"""Which command helps against a failed check: another search, other data, or an earlier step."""

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

from scissorcal.workday.steps import BY_EFFORT, BY_NAME, Step

if TYPE_CHECKING:
    from scissorcal.workday.states import StepState


def remedy(
    step: Step, failed: Sequence[str], effort: str, state: "Callable[[str], StepState]"
) -> str:
    """The command that may clear the failed checks of a step's result.

    A check of what the fit builds on leads to that step; one of the search to a longer search,
    unless it was the longest; every other to new data.
    """
    if step.kind == "sign":
        return "scissorcal report --anew"  # after what was rejected is corrected
    if step.kind != "fit":
        return step.command
    if "foundations" in failed:
        for item in step.inputs:
            below = state(item.rstrip("?"))
            if below.state in ("failed", "incomplete", "stale"):
                return below.command
    if set(failed) <= BY_EFFORT and effort != "thorough":
        return f"{step.command} --effort thorough"
    return BY_NAME[step.inputs[0]].command
