"""Verdicts on pushes: what moves, which way, and whether a joint's law explains it.

Each is right, wrong with its name, or not determined with what to do. An `Outcome` that is not
determined ends a probe as a verdict that fails does, without accusing anything.
"""

import math
from typing import NamedTuple

from scissorcal.device.probe.idle import REST_RAD, Idle
from scissorcal.device.probe.joint_values import LATE_S
from scissorcal.device.probe.pushes import Axis
from scissorcal.device.probe.search import LEAST_INERTIA, Search, Sense
from scissorcal.device.probe.swings import Swung
from scissorcal.device.probe.talk import MOTORS, SENSORS
from scissorcal.recording.probe import NORMAL_90
from scissorcal.verdicts import Check, Verdict

MISFIT_LIMIT = 15.0
"""Mean square of the residuals over their errors. Joints of another friction law stay below it, a
loose coupling or blades that touch something do not (figures in decision 175)."""
MOST_LOG_SPREAD = math.log(1e3)
"""An inertia that is known to a factor of a thousand is not known; its sd may be anything."""
REST = Check("probe.sensors rest", f"{SENSORS}: motion with the motors off, rad", at_most=REST_RAD)
MOVE = {
    "blades": Check("probe.motors blades move", f"{MOTORS}: largest torque that was tried, mN m"),
    "carriage": Check("probe.motors carriage move", f"{MOTORS}: largest force that was tried, N"),
}
DIRECTION = {
    axis: Check(
        f"probe.motors {axis} direction", f"{MOTORS}: 1 if pairs of pushes obey", at_least=1.0
    )
    for axis in MOVE
}
INERTIA = Check(
    "probe.motors inertia", f"{MOTORS}: sd of its logarithm, from the pushes", at_most=0.3
)
"""Of ln inertia: gains that hold at both ends of its interval of 90 % then lose half of their
margin, which is what a gain margin of 2 allows."""


class Words(NamedTuple):
    """The words for an axis: its name, what each sign does, and the remedies."""

    name: str
    plus: str
    minus: str
    effort: str
    unit: str
    scale: float
    reversed: str
    reversed_alone: str
    more: str


BLADES = Words(
    "blades", "opens", "closes", "torque", "mN m", 1e3,
    "the motor or the encoder is reversed. Set rig.motor_sign = {sign} in the recipe or swap the "
    "motor's wires (or the encoder's channels, if the opening shrinks while the blades open)",
    "the motor is reversed (the encoder counts rightly, as the pass by hand showed). Set "
    "rig.motor_sign = {sign} in the recipe or swap the motor's wires",
    "Clear the blades, check the encoder's cable and the motor's supply, or raise "
    "rig.probe.largest_torque_Nm",
)  # fmt: skip
CARRIAGE = Words(
    "carriage", "advances", "retracts", "force", "N", 1.0,
    "its motor or its encoder is reversed. Swap the motor's wires, or the encoder's channels if "
    "the advance shrinks while the carriage moves along the cut",
    "",
    "Clear its way, check its encoder's cable and its motor",
)  # fmt: skip


class Outcome(NamedTuple):
    """Verdicts, and the sentence that ends the probe undetermined; empty where it goes on."""

    verdicts: tuple[Verdict, ...]
    undetermined: str = ""


def judge_rest(found: Idle) -> Outcome:
    """Whether the blades rest with the motors off."""
    moved = max(found.moved_rad, 2.0 * found.jitter_rad if found.swings else 0.0)
    if moved <= REST_RAD:
        good = "The blades are at rest."
        return Outcome((REST.verdict("pass", moved, good),))
    why = (
        f"Not determined: the blades moved by {moved:.2g} rad in a second with the motors off. Let "
        "go of the handles, wait until they hang still, fix what pulls them, and probe again."
    )
    return Outcome((REST.not_evaluated(why, moved),), why)


def judge_search(found: Search, axis: Axis, words: Words, hand: bool) -> Outcome:
    """Whether the axis moved both ways; ``hand``: a pass by hand has shown the encoder alive."""
    if found.stop or len(found.movers) == 2:
        return Outcome(())
    check = MOVE[words.name]
    if found.bounded_at is not None:
        why = (
            f"Not determined: no push up to {words.scale * found.bounded_at:.3g} {words.unit} "
            f"moved the {words.name}, and behind a stuck encoder a larger one could make light "
            f"ones ({1e6 * LEAST_INERTIA:.0f} kg mm^2) faster than rig.probe allows. Probe again "
            "and move the blades to both stops by hand when asked: that shows that the encoder is "
            "alive, and larger pushes are allowed."
        )
        return _open(check, why, words.scale * axis.effort)
    most = f"{words.scale * axis.effort:.3g} {words.unit}"
    moved = found.pushed or found.pulled
    if moved is None:
        cause = "an obstacle, a brake, a motor without supply, or more friction than that"
        if not hand:
            cause = f"a stuck or unplugged encoder, {cause}"
        why = f"The {words.name} did not move either way, up to {most}: {cause}. {words.more}."
        return Outcome((check.verdict("fail", words.scale * axis.effort, why),))
    sign = "positive" if moved.effort > 0.0 else "negative"
    why = (
        f"Not determined: the {words.name} moved only by {sign} efforts, up to {most}: they stand "
        "at a stop or at something between them, or gravity or a spring carries them. Leave the "
        f"blades half open, balance what carries them, and probe again. {words.more}."
    )
    return _open(check, why, words.scale * axis.effort)


def judge_sense(found: Search, sensed: Sense, words: Words, motor_sign: int, hand: bool) -> Outcome:
    """Which way the axis goes when it is pushed."""
    check = DIRECTION[words.name]
    share = 0.5 + 0.5 * sensed.votes / max(sensed.pairs, 1)
    if sensed.direction == "not determined":
        why = (
            f"Not determined: {sensed.pairs} pairs of pushes did not agree on which way the "
            f"{words.name} go (votes {sensed.votes:+d}): something else moves them (a hand, a "
            "spring, gravity), or the encoder counts one way only. Let go of the handles, clear "
            "the blades, and probe again."
        )
        return _open(check, why, share)
    ends = (f"{words.scale * abs(one.effort):.3g}" for one in found.movers)
    good = (
        f"Positive {words.effort} {words.plus}, negative {words.effort} {words.minus} the "
        f"{words.name}, from {' and '.join(ends)} {words.unit} on."
    )
    if found.stop:
        good += (
            f" They lie on their {'closed' if found.stop > 0 else 'open'} stop, where gravity or "
            "a spring carries them, and were pushed off it."
        )
    remedy = words.reversed_alone if hand and words.reversed_alone else words.reversed
    bad = f"Positive {words.effort} {words.minus} the {words.name}: "
    bad += remedy.format(sign=-motor_sign) + "."
    right = float(sensed.direction == "right")
    return Outcome((check.judge(right, good, bad),))


def judge_joint(swung: Swung, axis: Axis, tick_s: float, lag_ticks: float) -> Outcome:
    """Whether inertia and friction explain the pushes, and are known well enough."""
    fit = swung.fit
    sd = fit.sd("log_inertia")
    spread = math.exp(min(NORMAL_90 * fit.inertia.sd / fit.inertia.mean, MOST_LOG_SPREAD))
    inertia = 1e6 * fit.inertia.mean
    if not fit.misfit <= MISFIT_LIMIT:
        why = (
            "Not determined: no inertia and friction explain how the blades move (misfit "
            f"{fit.misfit:.3g}, at most {MISFIT_LIMIT:g}): a loose coupling between blades and "
            "encoder, or blades that touch something. Clear them, tighten the coupling, and probe "
            "again."
        )
        return _open(INERTIA, why, sd)
    late, doubt = fit.delay.mean, 2.0 * fit.delay.sd
    least, most = (lag_ticks - 2.0) * tick_s - doubt, (lag_ticks + 1.0) * tick_s + LATE_S + doubt
    if fit.strange or not least <= late <= most:
        what = ", ".join(fit.strange) or f"a delay of {1e3 * late:.3g} ms"
        why = (
            f"Not determined: the pushes fit only with {what}, which no such rig has. Check that "
            "nothing touches the blades and that the motor's supply stands, balance blades that "
            "creep by their weight, and probe again."
        )
        return _open(INERTIA, why, sd)
    if not sd <= INERTIA.threshold:
        steps = max(abs(one.went) for one in swung.pushes) / max(axis.seen / 3.0, 1e-12)
        why = (
            f"Not determined: the inertia is known to a factor of {spread:.2g} only. At "
            f"{1e3 * tick_s:.3g} ms ticks the largest swing within rig.probe is {steps:.2g} "
            "encoder steps. Use a finer encoder, a shorter tick, or larger limits in rig.probe."
        )
        return _open(INERTIA, why, sd)
    why = f"Inertia {inertia:.3g} kg mm^2, known to a factor of {spread:.3g} (90 %)."
    return Outcome((INERTIA.verdict("pass", sd, why),))


def _open(check: Check, why: str, value: float) -> Outcome:
    return Outcome((check.not_evaluated(why, value),), why)
