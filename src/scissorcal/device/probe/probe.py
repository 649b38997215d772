"""The probe: look, then touch, then push a little; stop and say why at the first thing wrong."""

import math
from dataclasses import dataclass, replace
from datetime import UTC, datetime

from scissorcal.device.link import PortLink
from scissorcal.device.probe.clipping import clipping, follow
from scissorcal.device.probe.hand_pass import (
    HandPass,
    by_virtual_hand,
    fallen,
    hand_pass,
    judge_hand_pass,
    let_go,
    virtual_hand,
)
from scissorcal.device.probe.idle import Idle, idle, jitters, observed_step
from scissorcal.device.probe.joint_values import Prior
from scissorcal.device.probe.judge import judge_follow, judge_idle, judge_step, judge_watchdog
from scissorcal.device.probe.judge_push import (
    BLADES,
    CARRIAGE,
    Outcome,
    judge_joint,
    judge_rest,
    judge_search,
    judge_sense,
)
from scissorcal.device.probe.lag import judge_lag, lag, watchdog
from scissorcal.device.probe.pushes import axis_of, push
from scissorcal.device.probe.search import search, sense
from scissorcal.device.probe.swings import Swung, swings
from scissorcal.device.probe.talk import REAL_TIME, Bounds, RunawayError, Talk
from scissorcal.device.session import (
    Confirm,
    RigSession,
    ShowProgress,
    identity_facts,
    is_simulator,
    refuse_nobody,
)
from scissorcal.errors import DeviceError
from scissorcal.identity import digest
from scissorcal.kernel import Capability, ConfigKey, Identity
from scissorcal.recipe.schema import Recipe
from scissorcal.recording.probe import Estimate, ProbeResult
from scissorcal.verdicts import Verdict, failed

REQUEST = (
    "Take everything out from between the blades, leave them half open, let go of the handles and "
    "keep clear: the motors move the blades by up to {degrees:.2g} degrees each push, both ways"
)
REQUEST_CARRIAGE = ", and the carriage by up to {millimetres:.2g} mm each push"
PUSH_BRAKE_S, PUSH_BRAKE_TICKS = 3e-3, 1.6
"""The watchdog while the motors push: a host that is away cannot make a push longer by more. Below
1.6 ticks a command that arrives late in its tick would brake a sound device."""
JITTER_SDS = 17.0
"""Time over which rates are taken, in units of jitter over the bound of the rate: six standard
deviations of the difference of two readings then are half of the bound."""
FLAG_TO_DELAY_TICKS, DELAY_SD_TICKS = 0.25, 0.6
"""A flag shows at the end of the tick in which a torque began; where in the tick it was measured
and began is the device's affair."""
DETERMINED_SD = 0.25
"""Of the logarithms of Stribeck's level and rate, of presliding's lengths, and of the odds of its
share: beyond 50 % at 90 % they are the prior's and no facts. A capture then judges slow sweeps by a
bound, and a fit of cuts lets friction jump at turns."""
GAIN_HOLD_S, HELD_SHARE = 0.1, 0.6
"""How long an effort is held for its gain, and its share of the one that moved the blades."""
CARRIAGE_FORCE_SHARE = 0.2
"""Of the recipe's and the device's force limit, for the carriage."""
NOISE_FACTS = {"motor_torque": "torque_noise_Nm", "handle_force": "force_noise_N"}
"""Facts of what is subtracted at rest; whatever else a device measures is a fact by its name."""
CARRIAGE_WAY_M, CARRIAGE_SPEED_M_PER_S = 2e-3, 0.05


class ProbeRefusedError(DeviceError):
    """The probe found something that no motor may run with; ``result`` is what it found so far."""

    def __init__(self, message: str, result: ProbeResult) -> None:
        super().__init__(message)
        self.result = result


@dataclass
class _Finding:
    """The result as it grows, how far it is, and whether the encoder was seen to move by hand."""

    result: ProbeResult
    tell: ShowProgress
    by_hand: bool = False

    def add(self, verdicts: list[Verdict], **found: object) -> None:
        """Take verdicts and findings; ProbeRefusedError where a verdict failed."""
        facts = {**self.result.facts, **found.pop("facts", {})}  # type: ignore[dict-item]
        known = (*self.result.verdicts, *verdicts)
        self.result = replace(self.result, verdicts=known, facts=facts, **found)  # type: ignore[arg-type]
        wrong = failed(tuple(verdicts))
        if wrong:
            raise ProbeRefusedError(" ".join(verdict.why for verdict in wrong), self.result)

    def take(self, outcome: Outcome, **found: object) -> None:
        """As `add`; ProbeRefusedError as well where the outcome leaves it undetermined."""
        self.add(list(outcome.verdicts), **found)
        if outcome.undetermined:
            raise ProbeRefusedError(outcome.undetermined, self.result)


def probe(session: RigSession, *, then: str = "", now: datetime | None = None) -> ProbeResult:
    """Check a rig before its motors run: sensors, clock, line, watchdog, signs, gains, mechanics.

    First a person moves the blades to both stops, motors off, so that scale, sign and zero of the
    encoder show without torque. Then pushes of torque grow until the blades move each way, pairs of
    pushes tell which way, and swings are planned until a model of inertia, friction, load and delay
    is known. Torque, rate and the angle of each push stay within ``rig.probe``. The person is asked
    and told what comes ``then``; a simulator moves and clears the blades itself. Where nobody
    follows the requests, pushes stay so small that light blades behind a stuck encoder keep
    within the bound of the rate.

    Raises ProbeRefusedError (a DeviceError) at the first stage that finds something wrong or cannot
    determine it, with the cause or what to do, before the next one moves anything; InputError where
    nobody can be asked; DeviceError where the link fails. The motors are off afterwards in every
    case.
    """
    identity, recipe = session.identity, session.recipe
    confirm, tell = session.operator.confirm, session.operator.progress
    refuse_nobody(identity, confirm, "The probe must ask a person to clear the blades first")
    made = (now or datetime.now(UTC)).astimezone(UTC).isoformat(timespec="seconds")
    finding = _Finding(
        ProbeResult(session.name, identity_digest(identity), made, recipe.rig.motor_sign), tell
    )
    with Talk(session.link, bounds_of(recipe, identity), recipe.rig.motor_sign) as talk:
        talk.refuse_not_homed()
        tell(0.0, "the blades by hand, motors off")
        try:
            finding.by_hand = _by_hand(talk, finding, recipe, confirm, then)
            _stages(talk, finding, recipe)
        except RunawayError as error:
            raise ProbeRefusedError(str(error), finding.result) from error
    tell(1.0, "done")
    return finding.result


def _stages(talk: Talk, finding: _Finding, recipe: Recipe) -> None:
    """Everything after the pass by hand to the last motion; ends at the first that stops it."""
    identity, tell = talk.identity, finding.tell
    tell(0.1, "listening with the motors off")
    quiet = idle(talk)
    finding.add(
        judge_idle(quiet, identity, recipe.rig.handle_radius_mm), **_of_idle(quiet, identity)
    )
    finding.take(judge_rest(quiet))
    finding.add(
        [], facts={REAL_TIME: float(isinstance(talk.link, PortLink)), **recipe_facts(recipe)}
    )
    jitter_s = JITTER_SDS * quiet.jitter_rad / talk.bounds.rate_rad_per_s
    talk.rate_over_s = max(talk.rate_over_s, jitter_s)
    tell(0.2, "lag, lost commands and watchdog, at zero torque")
    late = lag(talk)
    lag_facts = {"command_lag_ticks": late.median} if late.ticks else {}
    finding.add(judge_lag(late, identity.tick_us * 1e-3), facts=lag_facts)
    watched = watchdog(talk, recipe.rig.line.brake_after_ms)
    talk.expiry_s = 1e-3 * watched.brake_after_ms
    finding.add(judge_watchdog(watched, late, identity.tick_us * 1e-3))
    expiry_ms = 1e3 * max(PUSH_BRAKE_S, PUSH_BRAKE_TICKS * talk.tick_s)
    with talk.braking_after(min(expiry_ms, recipe.rig.line.brake_after_ms)):
        tell(0.35, "pushes that grow until the blades move")
        talk.pushing = True
        _push(talk, finding, quiet, recipe)
        if _pushes_carriage(identity):
            tell(0.85, "small pushes on the carriage")
            _push_carriage(talk, finding, recipe)
    finding.add([clipping(talk, finding.result.inertia_kg_m2, recipe.rig.line.brake_after_ms)])
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
        force_N=CARRIAGE_FORCE_SHARE * force,
        rate_rad_per_s=limits.largest_rate_rad_per_s,
        speed_m_per_s=CARRIAGE_SPEED_M_PER_S,
        angle_rad=math.radians(limits.largest_angle_deg),
        way_m=CARRIAGE_WAY_M,
    )


def identity_digest(identity: Identity) -> str:
    """Digest of everything that the device states: another firmware or limit is another rig."""
    return digest(identity_facts(identity))


def request_of(recipe: Recipe, identity: Identity) -> str:
    """What a person is asked before a probe: to clear the blades, and what will move how far."""
    request = REQUEST.format(degrees=recipe.rig.probe.largest_angle_deg)
    if _pushes_carriage(identity):
        request += REQUEST_CARRIAGE.format(millimetres=1e3 * CARRIAGE_WAY_M)
    return request + "."


def _pushes_carriage(identity: Identity) -> bool:
    return bool(identity.capabilities & Capability.ADVANCE_MOTOR) and identity.force_limit > 0.0


def _by_hand(
    talk: Talk, finding: _Finding, recipe: Recipe, confirm: Confirm | None, then: str
) -> bool:
    """The pass by hand and its verdicts; whether the encoder was seen to move."""
    identity = talk.identity
    if is_simulator(identity):
        talk.link.configure(ConfigKey.MATERIAL, 0.0)
        alive = virtual_hand(talk)
        finding.add([by_virtual_hand(alive)])
        return alive
    assert confirm is not None
    passed = hand_pass(talk, confirm)
    finding.add(judge_hand_pass(passed, identity), facts=_of_hand(passed, identity))
    let_go(talk, confirm, f"{request_of(recipe, identity)} {then}".strip())
    return passed.alive


def _of_hand(passed: HandPass, identity: Identity) -> dict[str, float]:
    stated = identity.opening_max - identity.opening_min
    return {"range_ratio": passed.ranges[-1] / stated} if passed.alive else {}


def _of_idle(found: Idle, identity: Identity) -> dict[str, object]:
    sensor = identity.capabilities & Capability.HANDLE_FORCE_SENSOR
    return {
        "torque_zero_Nm": _finite(found.zeros["motor_torque"]),
        "force_zero_N": _finite(found.zeros["handle_force"]) if sensor else None,
        "facts": {
            **{NOISE_FACTS.get(name, f"{name}_noise"): sd for name, sd in found.noises.items()},
            **{name: at.mean for name, at in found.zeros.items() if name not in NOISE_FACTS},
            "encoder_jitter_rad": found.jitter_rad,
            "encoder_jitters": float(jitters(found, identity)),
            "clock_ratio": found.clock_ratio,
            "clock_by_host_ratio": found.host_ratio,
            "lost_share": found.lost_share,
            "garbled_share": found.garbled_share,
            "repeated_share": found.duplicate_share,
        },
    }


def _push(talk: Talk, finding: _Finding, quiet: Idle, recipe: Recipe) -> None:
    """Pushes on the blades: what moves them, which way, how the torque follows; then swings."""
    identity, hand = talk.identity, finding.by_hand
    axis = axis_of(talk, "opening", quiet.jitter_rad, identity.opening_resolution)
    found = search(talk, axis, alive=hand)
    fell = fallen(float(talk.heard(talk.mark() - 1)["opening"][0]), identity)
    if fell is not None and hand and not found.stop:
        finding.take(Outcome((fell,), fell.why))
    finding.take(judge_search(found, axis, BLADES, hand))
    sensed = sense(talk, axis, found)
    finding.take(judge_sense(found, sensed, BLADES, recipe.rig.motor_sign, hand))
    held = [
        push(talk, axis, sign * HELD_SHARE * found.effort, GAIN_HOLD_S, found.hold)
        for sign in (1, -1)
    ]
    finding.tell(0.5, "swings, planned by what the last ones taught")
    lag_ticks = finding.result.facts["command_lag_ticks"]
    prior = Prior(
        (lag_ticks - 1.0 + FLAG_TO_DELAY_TICKS) * talk.tick_s,
        DELAY_SD_TICKS * talk.tick_s,
        found.effort,
        found.stop,
    )
    step = observed_step(talk.heard()["opening"])
    judged = [judge_step(step, identity.opening_resolution)]
    finding.add(judged, facts={"encoder_step_rad": step})
    noise = math.hypot(quiet.jitter_rad, identity.opening_resolution / math.sqrt(12.0))
    swung = swings(talk, axis, (*found.pushes, *sensed.pushes, *held), prior, noise, found.hold)
    zero = finding.result.torque_zero_Nm
    whole = talk.heard()
    parts = [whole[one.begin : one.end] for one in swung.pushes]
    answered = follow(
        parts, zero.mean if zero is not None else 0.0, (lag_ticks + 1.0) * talk.tick_s
    )
    facts = {
        "breakaway_Nm": found.effort,
        "breakaway_opening_Nm": abs(found.pushed.effort) if found.pushed else math.nan,
        "breakaway_closing_Nm": abs(found.pulled.effort) if found.pulled else math.nan,
        "measured_torque_lag_s": answered.lag_s,
    }
    gain = _finite(answered.gain)
    finding.add([judge_follow(answered)], torque_gain=gain, facts=facts)
    finding.take(judge_joint(swung, axis, talk.tick_s, lag_ticks), **_of_swings(swung))


def _of_swings(swung: Swung) -> dict[str, object]:
    """Estimates and facts of the joint."""
    fit = swung.fit
    joint = fit.joint
    fall = ("log_rise_share", "log_rise_rate")
    estimates = {
        "stribeck_Nm": (fit.built_up * joint.rise, fall),
        "stribeck_rate_rad_per_s": (joint.rise_rate, fall),
        "presliding_fine_rad": (joint.fine, ("log_fine",)),
    }
    return {
        "inertia_kg_m2": fit.inertia,
        "coulomb_Nm": fit.coulomb,
        "viscous_Nm_s_per_rad": fit.viscous,
        "delay_s": fit.delay,
        "posterior": fit.posterior,
        "swings": swung.shown,
        "facts": {
            **{
                name: value
                for name, (value, by) in estimates.items()
                if max(fit.sd(one) for one in by) <= DETERMINED_SD
            },
            "coulomb_opening_Nm": fit.built_up * joint.opening,
            "coulomb_closing_Nm": fit.built_up * joint.closing,
            "carrying_Nm": joint.carrying,
            "log_inertia_sd": fit.sd("log_inertia"),
            "misfit": fit.misfit,
        },
    }


def _push_carriage(talk: Talk, finding: _Finding, recipe: Recipe) -> None:
    axis = axis_of(talk, "advance", 0.0, talk.identity.advance_resolution)
    found = search(talk, axis, alive=True)
    finding.take(judge_search(found, axis, CARRIAGE, hand=False))
    sensed = sense(talk, axis, found)
    finding.take(judge_sense(found, sensed, CARRIAGE, recipe.rig.motor_sign, hand=False))
    finding.add([], facts={"carriage_breakaway_N": found.effort})


def _finite(estimate: Estimate) -> Estimate | None:
    return estimate if math.isfinite(estimate.mean) and math.isfinite(estimate.sd) else None
