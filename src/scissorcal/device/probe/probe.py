"""The probe: look, then touch, then push a little; stop and say why at the first thing wrong."""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from datetime import UTC, datetime

from scissorcal.device.link import Link, PortLink
from scissorcal.device.loading import Confirm, is_simulator
from scissorcal.device.probe.clipping import clipping
from scissorcal.device.probe.creep import count_scale_not_checked, creep
from scissorcal.device.probe.idle import Idle, idle, jitters, observed_step
from scissorcal.device.probe.judge import (
    OPENING,
    SLEDGE,
    judge_follow,
    judge_idle,
    judge_signs,
    judge_step,
    judge_watchdog,
)
from scissorcal.device.probe.mechanics import follow, mechanics, swing_of
from scissorcal.device.probe.pulses import (
    Axis,
    Stairs,
    axis_of,
    holds,
    joined,
    make_room,
    stairs,
    swings,
)
from scissorcal.device.probe.result import REAL_TIME, Estimate, ProbeResult
from scissorcal.device.probe.talk import Bounds, RunawayError, Talk
from scissorcal.device.probe.watchdog import Watchdog, lag_ticks, watchdog
from scissorcal.device.rig_record import identity_facts
from scissorcal.errors import DeviceError, InputError
from scissorcal.identity import digest
from scissorcal.kernel import Capability, ConfigKey, Identity
from scissorcal.recipe.schema import Recipe
from scissorcal.verdicts import Verdict, failed

Progress = Callable[[float, str], None]

REQUEST = (
    "Take everything out from between the blades, let go of the handles and keep clear: the motors "
    "move the blades by up to {degrees:.2g} degrees each push, both ways"
)
REQUEST_SLEDGE = ", and the sledge by up to {millimetres:.2g} mm each push"
REQUEST_CREEP = "; then the blades slowly to both stops ({degrees:.2g} degrees)"
ROOM_PULSES = 40
SWING_SHARE, SWING_MORE_NM = 1.35, 4e-3
"""A swing's torque: so many times breakaway and a little more, which accelerates well."""
SLEDGE_FORCE_SHARE = 0.2
"""Of the recipe's and the device's force limit, for the sledge."""
SLEDGE_WAY_M, SLEDGE_SPEED_M_PER_S = 2e-3, 0.05


class ProbeRefusedError(DeviceError):
    """The probe found something that no motor may run with; ``result`` is what it found so far."""

    def __init__(self, message: str, result: ProbeResult) -> None:
        super().__init__(message)
        self.result = result


@dataclass
class _Finding:
    """The result as it grows, and the errors of what was looked at so far."""

    result: ProbeResult

    def add(self, verdicts: list[Verdict], **found: object) -> None:
        """Take verdicts and findings; ProbeRefusedError where a verdict failed."""
        facts = {**self.result.facts, **found.pop("facts", {})}  # type: ignore[dict-item]
        known = (*self.result.verdicts, *verdicts)
        self.result = replace(self.result, verdicts=known, facts=facts, **found)  # type: ignore[arg-type]
        wrong = failed(tuple(verdicts))
        if wrong:
            raise ProbeRefusedError(" ".join(verdict.why for verdict in wrong), self.result)


def probe(
    link: Link,
    recipe: Recipe,
    *,
    progress: Progress | None = None,
    confirm: Confirm | None = None,
    now: datetime | None = None,
) -> ProbeResult:
    """Check a rig before its motors run: sensors, clock, line, watchdog, signs, gains, mechanics.

    Nothing moves in the first second and a half; then pulses of torque grow until the blades move
    by a few encoder steps each way, and small swings follow. Torque, rate and the angle of each
    push stay within ``rig.probe``. ``confirm`` asks a person to clear the blades; a simulator
    clears them itself.

    Raises ProbeRefusedError (a DeviceError), with the cause and the remedy, at the first stage
    that finds something wrong, before the next one moves anything; InputError where nobody can be
    asked; DeviceError where the link fails. The motors are off afterwards in every case.
    """
    identity = link.identity
    tell = progress or (lambda done, sentence: None)
    _clear(link, confirm, request_of(recipe, identity))
    made = (now or datetime.now(UTC)).astimezone(UTC).isoformat(timespec="seconds")
    finding = _Finding(
        ProbeResult(rig_name(identity), identity_digest(identity), made, recipe.rig.motor_sign)
    )
    with Talk(link, bounds_of(recipe, identity), recipe.rig.motor_sign) as talk:
        try:
            _stages(talk, finding, recipe, tell)
        except RunawayError as error:
            raise ProbeRefusedError(str(error), finding.result) from error
    tell(1.0, "done")
    return finding.result


def _stages(talk: Talk, finding: _Finding, recipe: Recipe, tell: Progress) -> None:
    """Everything from listening to the last motion; ends at the first verdict that fails."""
    identity, limits = talk.identity, recipe.rig.probe
    tell(0.0, "listening with the motors off")
    quiet = idle(talk)
    finding.add(
        judge_idle(quiet, identity, recipe.rig.handle_radius_mm), **_of_idle(quiet, identity)
    )
    finding.add(
        [], facts={REAL_TIME: float(isinstance(talk.link, PortLink)), **recipe_facts(recipe)}
    )
    tell(0.4, "watchdog, at zero torque")
    watched = watchdog(talk, recipe.rig.line.brake_after_ms)
    finding.add(judge_watchdog(watched, identity.tick_us * 1e-3), **_of_watchdog(watched, talk))
    tell(0.5, "small pulses of torque")
    _push(talk, finding, quiet, recipe)
    if _pushes_sledge(identity):
        tell(0.85, "small pulses of force on the sledge")
        _push_sledge(talk, finding, recipe)
    brake_after_ms = recipe.rig.line.brake_after_ms
    finding.add([clipping(talk, finding.result.inertia_kg_m2, brake_after_ms)])
    if limits.creep:
        tell(0.9, "creeping to the stops")
        verdicts, facts = creep(talk, finding.result.facts["breakaway_Nm"], tell)
        finding.add(verdicts, facts=facts)
    else:
        finding.add([count_scale_not_checked()])
    finding.add(
        [],
        facts={
            "largest_torque_Nm": talk.largest_torque,
            "largest_rate_rad_per_s": talk.largest_rate,
        },
    )


def recipe_facts(recipe: Recipe) -> dict[str, float]:
    """The numbers of the recipe that a probe judges: another probe is due where they change."""
    rig = recipe.rig
    return {
        "rig.handle_radius_mm": rig.handle_radius_mm,
        "rig.line.brake_after_ms": rig.line.brake_after_ms,
    }


def bounds_of(recipe: Recipe, identity: Identity) -> Bounds:
    """The largest torque, rate and way of a probe: the tightest of recipe and device."""
    limits = recipe.rig.probe
    force = min(recipe.limits.force_N, identity.force_limit)
    return Bounds(
        torque_Nm=min(limits.largest_torque_Nm, recipe.limits.torque_Nm, identity.torque_limit),
        force_N=SLEDGE_FORCE_SHARE * force,
        rate_rad_per_s=limits.largest_rate_rad_per_s,
        speed_m_per_s=SLEDGE_SPEED_M_PER_S,
        angle_rad=math.radians(limits.largest_angle_deg),
        way_m=SLEDGE_WAY_M,
    )


def rig_name(identity: Identity) -> str:
    """Name and serial number, as people know the rig."""
    return f"{identity.name} {identity.serial}"


def identity_digest(identity: Identity) -> str:
    """Digest of everything that the device states: another firmware or limit is another rig."""
    return digest(identity_facts(identity))


def request_of(recipe: Recipe, identity: Identity) -> str:
    """What a person is asked before a probe: to clear the blades, and what will move how far."""
    request = REQUEST.format(degrees=recipe.rig.probe.largest_angle_deg)
    if _pushes_sledge(identity):
        request += REQUEST_SLEDGE.format(millimetres=1e3 * SLEDGE_WAY_M)
    if recipe.rig.probe.creep:
        apart = math.degrees(identity.opening_max - identity.opening_min)
        request += REQUEST_CREEP.format(degrees=apart)
    return request + "."


def _pushes_sledge(identity: Identity) -> bool:
    return bool(identity.capabilities & Capability.ADVANCE_MOTOR) and identity.force_limit > 0.0


def _clear(link: Link, confirm: Confirm | None, request: str) -> None:
    if is_simulator(link.identity):
        link.configure(ConfigKey.HAND_SPEED_rad_per_s, 0.0)
        link.configure(ConfigKey.MATERIAL, 0.0)
        return
    if confirm is None:
        raise InputError(
            "The probe must ask a person to clear the blades first: pass a confirm callback that "
            "shows a sentence and returns when that is done."
        )
    confirm(request)


def _of_idle(found: Idle, identity: Identity) -> dict[str, object]:
    sensor = identity.capabilities & Capability.HANDLE_FORCE_SENSOR
    return {
        "torque_zero_Nm": _finite(found.torque_zero),
        "force_zero_N": _finite(found.force_zero) if sensor else None,
        "facts": {
            "torque_noise_Nm": found.torque_noise,
            "force_noise_N": found.force_noise,
            "encoder_jitter_rad": found.jitter_rad,
            "encoder_jitters": float(jitters(found, identity)),
            "clock_ratio": found.clock_ratio,
            "clock_by_host_ratio": found.host_ratio,
            "lost_share": found.lost_share,
            "garbled_share": found.garbled_share,
            "repeated_share": found.duplicate_share,
        },
    }


def _of_watchdog(found: Watchdog, talk: Talk) -> dict[str, object]:
    """The delay as far as flags show it: somewhere in the tick before the one that shows it.

    Swings replace it by what the blades show.
    """
    if not found.lags:
        return {}
    lag = lag_ticks(found.lags)
    delay = Estimate((lag - 0.5) * talk.tick_s, talk.tick_s / math.sqrt(12.0))
    return {"delay_s": delay, "facts": {"command_lag_ticks": lag}}


def _push(talk: Talk, finding: _Finding, quiet: Idle, recipe: Recipe) -> None:
    """Pulses on the blades: signs, breakaway, gain; then swings: inertia, friction, delay."""
    identity = talk.identity
    axis = axis_of(talk, "opening", quiet.jitter_rad, identity.opening_resolution)
    found = _both_ways(talk, axis, quiet)
    finding.add(judge_signs(found, axis, OPENING, recipe.rig.motor_sign))
    pushed, pulled = found.pushed, found.pulled
    assert pushed is not None
    assert pulled is not None
    most = axis.effort
    push = min(most, SWING_SHARE * pushed.effort + SWING_MORE_NM)
    pull = -min(most, SWING_SHARE * -pulled.effort + SWING_MORE_NM)
    held = holds(talk, axis, pushed.effort, pulled.effort)
    swung = swings(talk, axis, push, pull)
    zero = finding.result.torque_zero_Nm
    parts = joined(talk, (*found.pulses, *held, *swung), disturbed=True)
    answered = follow(parts, zero.mean if zero is not None else 0.0)
    step = observed_step(talk.heard()["opening"])
    moving = [swing_of(part, axis.moved) for part in joined(talk, swung)]
    resolution = step if math.isfinite(step) else identity.opening_resolution
    noise = max(quiet.jitter_rad, resolution / math.sqrt(12.0))
    fitted = mechanics([swing for swing in moving if swing is not None], noise)
    facts = {
        "breakaway_Nm": max(pushed.effort, -pulled.effort),
        "breakaway_opening_Nm": pushed.effort,
        "breakaway_closing_Nm": -pulled.effort,
        "encoder_step_rad": step,
        "measured_torque_lag_s": answered.lag_s,
    }
    estimates: dict[str, object] = {"torque_gain": _finite(answered.gain)}
    if fitted is not None:
        facts["coulomb_opening_Nm"] = fitted.coulomb_opening
        facts["coulomb_closing_Nm"] = fitted.coulomb_closing
        estimates |= {
            "inertia_kg_m2": fitted.inertia,
            "coulomb_Nm": fitted.coulomb,
            "viscous_Nm_s_per_rad": fitted.viscous,
            "delay_s": fitted.delay,
        }
    verdicts = [judge_follow(answered), judge_step(step, identity.opening_resolution)]
    finding.add(verdicts, **estimates, facts=facts)


def _both_ways(talk: Talk, axis: Axis, quiet: Idle) -> Stairs:
    """Push the axis both ways, first away from the nearer stop."""
    identity = talk.identity
    low, high = identity.opening_min, identity.opening_max
    middle = 0.5 * (low + high)
    sign = 1 if quiet.opening_high < middle else -1
    found = stairs(talk, axis, sign)
    moved = found.pushed or found.pulled
    if moved is None or (found.pushed and found.pulled):
        return found
    make_room(talk, axis, moved.effort, ROOM_PULSES)
    return stairs(talk, axis, -1 if moved.effort > 0.0 else 1)


def _push_sledge(talk: Talk, finding: _Finding, recipe: Recipe) -> None:
    axis = axis_of(talk, "advance", 0.0, talk.identity.advance_resolution)
    found = stairs(talk, axis, 1)
    finding.add(judge_signs(found, axis, SLEDGE, recipe.rig.motor_sign, "N"))
    assert found.pushed is not None
    assert found.pulled is not None
    finding.add([], facts={"sledge_breakaway_N": max(found.pushed.effort, -found.pulled.effort)})


def _finite(estimate: Estimate) -> Estimate | None:
    return estimate if math.isfinite(estimate.mean) and math.isfinite(estimate.sd) else None
