"""Probe a rig into a workspace: before its first motor run, and again where that is too old."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from typing import TYPE_CHECKING

from scissorcal.errors import InputError
from scissorcal.files import replacing
from scissorcal.foreign import read_json, reading
from scissorcal.foreign.formats import STATE
from scissorcal.verdicts import failed
from scissorcal.workday.rigs import open_session
from scissorcal.workday.workspace import Workspace

if TYPE_CHECKING:
    from scissorcal.device.link import Link
    from scissorcal.device.session import Operator, RigSession
    from scissorcal.recipe.schema import Recipe
    from scissorcal.recording.probe import ProbeResult
    from scissorcal.workday.options import RigOptions


def probe_device(
    recipe: Recipe,
    rig: RigOptions,
    operator: Operator | None = None,
    *,
    workspace: Workspace | None = None,
) -> ProbeResult:
    """Probe a rig and keep the result in the workspace, if there is one.

    A probe that refuses the rig is kept as well, so that what it found can be looked up. Raises
    what `scissorcal.device.probe.probe.probe` raises.
    """
    from scissorcal.device.probe.probe import probe

    with open_session(recipe, rig, operator) as session:
        return probe(session) if workspace is None else probe_into(workspace, session)


def probe_into(workspace: Workspace, session: RigSession, then: str = "") -> ProbeResult:
    """Probe the rig of a session, and keep what was found; as `probe_device`."""
    from scissorcal.device.probe.probe import ProbeRefusedError, probe

    try:
        result = probe(session, then=then)
    except ProbeRefusedError as error:
        _store(workspace, error.result)
        error.kept = (workspace.probe_path,)
        raise
    _store(workspace, result)
    return result


def ensure_probed(
    workspace: Workspace, session: RigSession, then: str = "", now: datetime | None = None
) -> RigSession:
    """The session with the workspace's probe of its rig, or a new one where none still counts.

    One counts if it is of exactly this rig (all that it states) and this ``rig.motor_sign``, found
    nothing wrong, and is not older than ``rig.probe.max_age_h``. The operator is told which it was,
    and what comes ``then``; a person whom a new probe asked has cleared the blades for it. Raises
    DeviceError, besides what the probe raises, where blades of its inertia would get too fast
    without commands (`refuse_unanswered`).
    """
    from scissorcal.device.session import refuse_unanswered

    recipe, say = session.recipe, session.operator.say
    last = _kept(workspace)
    why = _why_again(last, session.link, recipe, now or datetime.now(UTC))
    if not isinstance(last, str) and not why:
        say(f"The rig was probed at {last.made_at} ('scissorcal device probe' repeats it).")
        probed = replace(session, probe=last)
    else:
        say(f"Probing the rig first, with up to {_most(recipe)} at the blades: {why}.")
        result = probe_into(workspace, session, then)
        for verdict in result.verdicts:
            if verdict.status == "not_evaluated" and verdict.value is not None:
                say(verdict.why)
        probed = replace(session, probe=result, cleared=not session.simulated)
    assert probed.probe is not None
    warning = refuse_unanswered(recipe, session.identity, probed.probe.inertia_kg_m2)
    if warning:
        say(warning)
    return probed


def last_probe(workspace: Workspace, link: Link | None = None) -> ProbeResult | None:
    """The probe that the workspace keeps, if it is of the rig on ``link`` (of any without one).

    None where there is none that can be read.
    """
    kept = _kept(workspace)
    if isinstance(kept, str) or (link is not None and _differs(kept, link)):
        return None
    return kept


def probe_state(workspace: Workspace, recipe: Recipe, now: datetime | None = None) -> str:
    """What the workspace's probe says and whether it still counts, in a sentence.

    Whether it is of the rig that will be connected shows only then.
    """
    last = _kept(workspace)
    if isinstance(last, str):
        return f"The rig is probed before its first motor run: {last}."
    said = f"{last.device} was probed at {last.made_at}"
    why = _outdated(last, recipe, now or datetime.now(UTC))
    if why:
        return f"{said}; it is probed again before its next motor run: {why}."
    without = [v.check for v in last.verdicts if v.status == "not_evaluated" and v.value is None]
    left_out = f" (not checked: {', '.join(without)})" if without else ""
    return f"{said}: no check failed{left_out}."


def _kept(workspace: Workspace) -> ProbeResult | str:
    """The probe that the workspace keeps, or why there is none."""
    path = workspace.probe_path
    if not path.exists():
        return "there is no probe of it yet"
    from scissorcal.recording.probe import probe_from_dict

    try:
        with reading(path, STATE):
            return probe_from_dict(read_json(path, STATE))
    except InputError as error:
        return f"{path.name} cannot be read ({error}) and is replaced"


def _most(recipe: Recipe) -> str:
    return f"{1e3 * recipe.rig.probe.largest_torque_Nm:g} mN m"


def _why_again(last: ProbeResult | str, link: Link, recipe: Recipe, now: datetime) -> str:
    """Why a probe does not count, as part of a sentence; empty where it does."""
    if isinstance(last, str):
        return last
    if _differs(last, link):
        return f"the last probe was of another rig, firmware or line ({last.device})"
    return _outdated(last, recipe, now)


def _outdated(last: ProbeResult, recipe: Recipe, now: datetime) -> str:
    """Why a probe of this rig does not count, as part of a sentence; empty where it does."""
    from scissorcal.device.probe.probe import recipe_facts

    if last.motor_sign != recipe.rig.motor_sign:
        return "rig.motor_sign changed since"
    for name, stated in recipe_facts(recipe).items():
        if last.facts.get(name) != stated:
            was = last.facts.get(name, math.nan)
            return f"the recipe's {name} changed since (from {was:g} to {stated:g})"
    if failed(last.verdicts):
        return "the last probe refused it"
    if last.inertia_kg_m2 is None:
        return "the last probe did not determine how it moves"
    age_h = (now - datetime.fromisoformat(last.made_at)) / timedelta(hours=1)
    if age_h < 0.0:
        return f"the last probe is dated {last.made_at}, after this computer's clock"
    most_h = recipe.rig.probe.max_age_h
    if age_h > most_h:
        return f"the last probe is {age_h:.1f} h old, and rig.probe.max_age_h allows {most_h:g} h"
    return ""


def _differs(last: ProbeResult, link: Link) -> bool:
    """Whether a probe is of another rig, or ran in virtual time where this one does not."""
    from scissorcal.device.link import PortLink
    from scissorcal.device.probe.probe import identity_digest
    from scissorcal.device.probe.talk import REAL_TIME

    real = last.facts.get(REAL_TIME) == 1.0
    return last.identity != identity_digest(link.identity) or real != isinstance(link, PortLink)


def _store(workspace: Workspace, result: ProbeResult) -> None:
    text = json.dumps(result.as_dict(), indent=2) + "\n"
    with replacing(workspace.probe_path) as part:
        part.write_text(text, encoding="utf-8")
