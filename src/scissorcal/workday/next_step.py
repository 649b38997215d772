"""What comes next in a workspace: the one answer that every command and the report's page give."""

from collections.abc import Sequence
from dataclasses import replace

from scissorcal.workday.engine import Engine
from scissorcal.workday.states import State, StepState
from scissorcal.workday.steps import BY_NAME

PHOTOGRAPHED = ("camera", "blade", "plate")
READY = ("done", "unverified")
AFTER_FITS = ("report", "sign", "package")
"""Kinds of steps that show or pack what the fits say: a verification comes before them."""

VERIFY = "scissorcal verify"


def next_step(engine: Engine) -> str | None:
    """The command that comes next in a workspace; None where nothing is left to do."""
    return next_command(engine.states(), linear=_is_linear(engine))


def next_after_report(engine: Engine) -> str:
    """What comes next once the report is written and before anyone signed it.

    So the page says what `next_step` says then, and stays as it is when it is signed.
    """
    open_steps: dict[str, State] = {"report": "done", "report sign": "missing"}
    states = [
        replace(state, state=open_steps.get(state.name, state.state), command=_command(state))
        for state in engine.states()
    ]
    return next_command(states, linear=_is_linear(engine)) or ""


def next_command(states: Sequence[StepState], *, linear: bool = False) -> str | None:
    """The command of the step that comes next; None where nothing is left to do.

    Steps come in the order of the day, with these exceptions. Photographs that were begun are
    finished before anything else, as the camera stands there. A fit is verified before its report
    is written, so that the report and its signature cover the verification; where a verification
    was made without its counts, or an unverified fit was signed, nobody is sent back. Where the
    recordings are of a linear joint (``linear``), only the steps of friction apply: it carries no
    blades.
    """
    applying = [state for state in states if not linear or _of_linear(state.name)]
    needed = [state for state in applying if not state.optional]
    waiting = _photographs_first([state for state in needed if state.state not in READY], needed)
    first = waiting[0] if waiting else None
    fitted = first is None or BY_NAME[first.name].kind in AFTER_FITS
    if fitted and _is_unverified(states, needed) and not _is_signed(states):
        return VERIFY
    return first.command if first else None


def _command(state: StepState) -> str:
    """The command of a step; that of a result that was done has none any more."""
    return BY_NAME[state.name].command if state.name == "report sign" else state.command


def _is_linear(engine: Engine) -> bool:
    """Whether the recordings of friction are of a linear joint, whatever the recipe says."""
    used = [row for row in engine.recordings("friction") if row.use == "used"]
    return bool(used) and all(row.facts["joint"] == "linear" for row in used)


def _of_linear(name: str) -> bool:
    step = BY_NAME[name]
    return step.what == "friction" or step.kind in ("report", "sign")


def _photographs_first(
    waiting: Sequence[StepState], needed: Sequence[StepState]
) -> Sequence[StepState]:
    """The waiting steps with those of photographs in front, where any was taken."""
    begun = any(BY_NAME[s.name].kind == "photographs" and s.state in READY for s in needed)
    return sorted(waiting, key=lambda s: not (begun and BY_NAME[s.name].what in PHOTOGRAPHED))


def _is_unverified(states: Sequence[StepState], needed: Sequence[StepState]) -> bool:
    """Whether a fit lacks its verification: one that was made in part is the user's choice."""
    unverified = {BY_NAME[s.name].verified_by for s in needed if s.state == "unverified"}
    return any(s.name in unverified and s.state != "incomplete" for s in states)


def _is_signed(states: Sequence[StepState]) -> bool:
    return any(s.name == "report sign" and s.state in ("done", "failed") for s in states)
