"""Planned swings: each is aimed by what the last ones taught, until the inertia is known."""

import math
from typing import NamedTuple

import numpy as np

from scissorcal.aliases import Array
from scissorcal.device.probe.joint_problem import fit_joint, swings_of, travel_of
from scissorcal.device.probe.joint_values import NAMES, JointFit, Prior, Push
from scissorcal.device.probe.pushes import MOVED_STEPS, Axis, Pushed, push
from scissorcal.device.probe.talk import Talk
from scissorcal.kernel import CommandFlag
from scissorcal.recording.probe import Swing

AIM_RAD, AIM_STEPS = 20e-3, 15.0
"""A swing shall go so far: beyond what most joints yield, and 15 steps are known to 2 %."""
MOST_WAY_RAD, MOST_RATE = 60e-3, 1.0
FACTORS = (1.1, 1.25, 1.4, 1.6, 1.8, 2.0, 2.2)
LONGEST_S = 0.12
ENOUGH_SD = 0.11
"""Of ln inertia: an interval of 90 % within +- 20 %, which a gain margin of 2 bears five times."""
BEYOND = 1.5
"""The strongest push over the fitted friction: below it, all of the motion may be presliding."""
LEAST_PAIRS, MOST_PAIRS = 3, 10
"""Pushes that end after 3 mrad last a few lags of a motor and confuse lag and inertia; three pairs
that go to the aim tell them apart."""
TELLING = 0.3
"""Pushes below this share of breakaway move within the encoder's error: they only cost time. On 60
random rigs 0.6 took two thirds of the time, and 8 intervals of 45 missed the inertia in place of
3."""
EXPLAINED = 1.0
"""Misfit up to which residuals are what the law is known to leave out."""
SHOWN = 6
"""Pushes that a result keeps for people to look at: the strongest."""
LIGHT_SDS = 2.0
AIM_SHARE, WAY_SHARE, RATE_SHARE = 0.6, 0.8, 0.7
"""Of the bounds: what the model aims at, and what it may reach with the lightest blades."""


class Swung(NamedTuple):
    """All pushes of the blades, what the model says of them, and the strongest beside it."""

    pushes: tuple[Pushed, ...]
    fit: JointFit
    strongest_Nm: float
    shown: tuple[Swing, ...] = ()


def swings(
    talk: Talk,
    axis: Axis,
    before: tuple[Pushed, ...],
    prior: Prior,
    noise_rad: float,
    hold: float,
) -> Swung:
    """Swing both ways by turns, planned by the fit to all pushes so far, until ENOUGH_SD."""
    pushes = list(before)
    least = TELLING * prior.breakaway_Nm
    strongest = max(abs(one.effort) for one in pushes)
    wide = axis.until(_most_way(axis), MOST_RATE)

    def telling() -> list[Push]:
        return _pushes_of(talk, pushes, least, prior.stop, axis.seen)

    fit = _fitted(talk, telling(), prior, noise_rad)
    for pairs in range(MOST_PAIRS + 1):
        if pairs == MOST_PAIRS or (pairs >= LEAST_PAIRS and known(fit, strongest)):
            fit = _fitted(talk, telling(), prior, noise_rad, fit.values, modes=True)
            if pairs == MOST_PAIRS or known(fit, strongest):
                break
        for sign in (prior.stop, prior.stop) if prior.stop else (1, -1):
            effort, seconds = _planned(talk, axis, fit, sign * prior.breakaway_Nm, strongest, hold)
            one = push(talk, wide, effort, seconds, hold)
            pushes.append(one)
            if not one.disturbed:
                strongest = max(strongest, abs(effort))
        fit = _fitted(talk, telling(), prior, noise_rad, fit.values)
    shown = swings_of(telling(), prior, noise_rad, fit.values, SHOWN)
    return Swung(tuple(pushes), fit, strongest, shown)


def _fitted(
    talk: Talk,
    pushes: list[Push],
    prior: Prior,
    noise_rad: float,
    start: Array | None = None,
    *,
    modes: bool = False,
) -> JointFit:
    """Fit with motors and stream off: a device ends a stream after 5 s without a frame.

    Where the mode that was followed so far does not explain the pushes, it is sought anew; with
    ``modes`` others are sought in any case.
    """
    with talk.paused():
        fit = fit_joint(pushes, prior, noise_rad, start, modes)
        if modes or (fit.misfit <= EXPLAINED and not fit.strange):
            return fit
        anew = fit_joint(pushes, prior, noise_rad, modes=False)
        return min(fit, anew, key=lambda one: (bool(one.strange), one.misfit))


def known(fit: JointFit, strongest: float) -> bool:
    """Whether the inertia is known well enough, from more than presliding."""
    return fit.sd("log_inertia") <= ENOUGH_SD and strongest >= BEYOND * math.exp(
        fit.value("log_coulomb")
    )


def _pushes_of(
    talk: Talk, pushed: list[Pushed] | tuple[Pushed, ...], least: float, stop: int, seen: float
) -> list[Push]:
    """What was heard of each push of ``least`` and more that nothing disturbed, for the fit.

    Of blades on a stop, what they do off it: pushes that press them on it, and how they rebound
    from it, tell of the stop alone.
    """
    whole = talk.heard()
    kept = [
        not one.disturbed and abs(one.effort) >= least and stop * one.effort >= 0.0
        for one in pushed
    ]
    stood = [True, *(one.rested or not known for one, known in zip(pushed, kept, strict=True))]
    return [
        _push_of(_off_stop(whole[one.begin : one.end], stop, seen), talk.tick_s, rested)
        for one, rested, known in zip(pushed, stood[:-1], kept, strict=True)
        if known
    ]


def _off_stop(heard: np.ndarray, stop: int, seen: float) -> np.ndarray:
    """What was heard until the blades were back on the stop where they began; all where they did
    not leave it by ``seen``, which tells what does not take them off it."""
    off = stop * (heard["opening"] - heard["opening"][0])
    if off.max() < seen:
        return heard
    back = off <= 0.0
    back[: int(np.argmax(off)) + 1] = False
    return heard[: int(np.argmax(back)) + 1] if back.any() else heard


def _push_of(heard: np.ndarray, tick_s: float, rested: bool) -> Push:
    times = heard["sequence"] * tick_s
    answered = heard["answer_flags"] >= 0
    on = (heard["answer_flags"][answered] & int(CommandFlag.ENABLE)) != 0
    torque = np.where(on, heard["torque"][answered], 0.0)
    at = times[answered]
    changes = np.flatnonzero(np.diff(torque, prepend=np.nan) != 0.0)
    return Push(times, heard["opening"].copy(), at[changes], torque[changes], rested)


def _most_way(axis: Axis) -> float:
    return min(MOST_WAY_RAD, axis.way)


def _planned(
    talk: Talk,
    axis: Axis,
    fit: JointFit,
    breakaway_Nm: float,
    strongest: float,
    hold: float,
) -> tuple[float, float]:
    """Torque and time of the next swing: the safe one that goes farthest towards the aim.

    It has the sign of ``breakaway_Nm``, the effort that moved the blades at first.
    While nothing stronger than BEYOND times the friction was tried, such torques go first. Light
    blades (LIGHT_SDS below the mean of ln inertia) bound way and rate.
    """
    aim = min(max(AIM_RAD, AIM_STEPS * axis.seen / MOVED_STEPS), AIM_SHARE * _most_way(axis))
    sign, breakaway = math.copysign(1.0, breakaway_Nm), abs(breakaway_Nm)
    needed = BEYOND * math.exp(fit.value("log_coulomb"))
    lightest = fit.values.copy()
    lightest[NAMES.index("log_inertia")] -= LIGHT_SDS * min(fit.sd("log_inertia"), 0.7)
    rate_limit, way_limit = RATE_SHARE * min(MOST_RATE, axis.rate), WAY_SHARE * _most_way(axis)
    safe: list[tuple[bool, float, float, float]] = []
    for factor in FACTORS:
        effort = factor * max(breakaway, needed / BEYOND)
        seconds = LONGEST_S
        while effort <= axis.effort and seconds > 0.5 * talk.tick_s:
            way, rate = travel_of(lightest, sign * effort, seconds, hold, fit.stop)
            if rate <= rate_limit and way <= way_limit:
                way, _ = travel_of(fit.values, sign * effort, seconds, hold, fit.stop)
                reached = min(way / aim, 1.0)
                safe.append((effort >= needed and strongest < needed, reached, effort, seconds))
                break
            seconds *= 0.6
    if not safe:
        return sign * min(FACTORS[0] * breakaway, axis.effort), talk.tick_s
    _, _, effort, seconds = max(safe)
    return sign * effort, seconds
