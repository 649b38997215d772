"""Does the device clip a torque above its stated limit, and does its measured torque follow?

A torque above the limit is only tried where one tick of it is harmless.
"""

import math
from contextlib import suppress
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from scissorcal.aliases import Array
from scissorcal.device.probe.idle import correlation_time
from scissorcal.device.probe.talk import MOTORS, RELEASE, Answer, Stage, StalledError, Talk
from scissorcal.errors import DeviceError
from scissorcal.kernel import ConfigKey, StateFlag
from scissorcal.recording.probe import Estimate
from scissorcal.verdicts import Check, Verdict

ATTEMPTS = 3
ABOVE = 1.02
"""Above the limit by so much: a device that does not clip gives no more than that either."""
SHORTEST_BRAKE_MS = 1.0
ARRIVED_SHARE = 0.3
"""Of the limit: a motor of 2 ms reaches 0.39 of its command within a tick of 1 ms."""
REST_S = 0.05
"""A strike is heard for so long; the next one waits until the blades rested for so long."""
LONGEST_REST_S = 1.0
STILL_RAD, STILL_STEPS = 0.002, 5.0
"""Blades that stay within the larger of both are at rest, an encoder that jitters included."""
SDS = 2.0
CLIPPING = Check(
    "probe.motors clipping", f"{MOTORS}: 1 if a torque above the limit is not clipped", at_most=0.0
)


class Strike(NamedTuple):
    """What one strike showed; ``determined`` is False where it was braked or never arrived."""

    flagged: bool
    largest_Nm: float
    determined: bool


def clipping(talk: Talk, inertia: Estimate | None, brake_after_ms: float) -> Verdict:
    """Command more than the limit for one tick, if the blades cannot get faster than the bounds.

    The watchdog is set to 1 ms for it, so that a computer that stalls there gives three ticks of
    torque at most, and a device of version 2 is told to hold it for one: with these and the least
    inertia the rate is bounded before it is tried. Then it is set to ``brake_after_ms`` again,
    whatever happened. A strike that was braked or lost is repeated from rest, each way by turns; if
    none arrives, nothing is determined.
    """
    limit, bounds = talk.identity.torque_limit, talk.bounds
    if inertia is None or not inertia.mean > SDS * inertia.sd:
        why = "Clipping was not tried: the inertia is not known, so one tick might be too much."
        return CLIPPING.not_evaluated(why)
    longest_s = SHORTEST_BRAKE_MS * 1e-3 + 3.0 * talk.tick_s
    fastest = ABOVE * limit * longest_s / (inertia.mean - SDS * inertia.sd)
    if fastest > bounds.rate_rad_per_s:
        why = (
            f"Clipping was not tried: a tick at the limit ({limit:.3g} N m) could bring the blades "
            f"to {fastest:.2g} rad/s, and rig.probe allows {bounds.rate_rad_per_s:.2g}."
        )
        return CLIPPING.not_evaluated(why)
    try:
        talk.link.configure(ConfigKey.BRAKE_AFTER_MS, SHORTEST_BRAKE_MS)
    except DeviceError as error:
        with suppress(DeviceError):  # it may have been set, and only its confirmation lost
            talk.link.configure(ConfigKey.BRAKE_AFTER_MS, brake_after_ms)
        return CLIPPING.not_evaluated(f"Clipping was not tried: {error}")
    try:
        with talk.allowing(ABOVE * limit):
            found = _strikes(talk, ABOVE * limit)
    finally:
        talk.link.configure(ConfigKey.BRAKE_AFTER_MS, brake_after_ms)
    return _judged(found, limit)


def _judged(found: Strike, limit: float) -> Verdict:
    if not found.determined:
        why = (
            f"Clipping could not be determined: in {ATTEMPTS} attempts the command of "
            f"{ABOVE * limit:.3g} N m was lost, the watchdog (1 ms for this check) braked first, "
            "or the blades did not rest. Close other programs on this computer, let go of the "
            "handles, and probe again."
        )
        return CLIPPING.not_evaluated(why)
    good = "A torque above the stated limit is clipped and flagged."
    bad = (
        f"A command of {ABOVE * limit:.3g} N m was not flagged TORQUE_SATURATED (largest measured "
        f"torque {found.largest_Nm:.3g} N m): the device must clip what exceeds its limit."
    )
    return CLIPPING.judge(float(not found.flagged), good, bad)


def _strikes(talk: Talk, torque: float) -> Strike:
    """Strike until one is determined, each way by turns, a few times at most."""
    found = Strike(flagged=False, largest_Nm=0.0, determined=False)
    for attempt in range(ATTEMPTS):
        try:
            found = _strike(talk, -torque if attempt % 2 else torque)
        except StalledError:
            if attempt == ATTEMPTS - 1:
                raise
            continue
        if found.determined:
            break
    return found


def _strike(talk: Talk, torque: float) -> Strike:
    """One strike and what was heard of it, frames that came several at once among them."""
    begin = talk.play(_struck(talk, torque))
    if begin is None:
        return Strike(flagged=False, largest_Nm=0.0, determined=False)
    heard = talk.heard(begin)
    flagged = bool(np.any(heard["flags"] & int(StateFlag.TORQUE_SATURATED)))
    braked = bool(np.any(heard["flags"] & int(StateFlag.FAULT_LATCHED)))
    largest = float(np.abs(heard["motor_torque"]).max())
    arrived = largest >= ARRIVED_SHARE * talk.identity.torque_limit
    return Strike(flagged, largest, determined=flagged or (arrived and not braked))


def _struck(talk: Talk, torque: float) -> Stage[int | None]:
    """Wait for rest, strike for one tick, listen; where it was heard, None if rest never came."""
    state = yield RELEASE
    place, still = state.opening, 0
    most = max(STILL_RAD, STILL_STEPS * talk.identity.opening_resolution)
    for _ in range(talk.ticks(LONGEST_REST_S)):
        faulty = bool(state.flags & StateFlag.FAULT_LATCHED)
        state = yield RELEASE._replace(clear=faulty)
        moved = abs(state.opening - place) > most
        still = 0 if moved or faulty else still + 1
        place = state.opening if moved else place
        if still > talk.ticks(REST_S):
            break
    else:
        return None
    begin = talk.mark()
    yield Answer()
    state = yield Answer(torque=torque, hold_ticks=1)
    for _ in range(talk.ticks(REST_S)):
        state = yield RELEASE._replace(clear=bool(state.flags & StateFlag.FAULT_LATCHED))
    return begin


LAGS = np.linspace(0.0, 20e-3, 101)
HELD_S = 0.01
"""After the delay: five time constants of a motor of 2 ms."""
LEAST_HELD = 40


class Follow(NamedTuple):
    """How the measured torque follows the commanded one: gain and lag (s), the answer's tick in."""

    gain: Estimate
    lag_s: float
    constant: bool


def follow(parts: list[NDArray[np.void]], zero: float, late_s: float) -> Follow:
    """Compare the measured torque with the commanded one: gain where it is held, lag everywhere.

    The gain takes only states before which the command stood for HELD_S and the delay ``late_s``,
    so that no lag of the motor bends it.
    """
    measured = np.concatenate([part["motor_torque"] for part in parts]) - zero
    usable = np.isfinite(measured)
    constant = not usable.any() or float(np.ptp(measured[usable])) == 0.0
    costs = []
    for lag in LAGS:
        command = np.concatenate([_commanded(part, lag) for part in parts])[usable]
        power = max(float(command @ command), 1e-30)
        gain = float(command @ measured[usable]) / power
        costs.append(float(np.sum((measured[usable] - gain * command) ** 2)))
    held = np.concatenate([_held(part, HELD_S + late_s) for part in parts])
    command = np.concatenate([_commanded(part, 0.0) for part in parts])
    inside = usable & held & (command != 0.0)
    if np.count_nonzero(inside) < LEAST_HELD:
        return Follow(Estimate(math.nan, math.nan), float(LAGS[int(np.argmin(costs))]), constant)
    x, y = command[inside], measured[inside]
    gain = float(x @ y / (x @ x))
    rest = y - gain * x
    independent = max(4.0, len(rest) / (2.0 * correlation_time(rest)))
    sd = math.sqrt(float(rest @ rest) / independent / float(x @ x))
    return Follow(Estimate(gain, sd), float(LAGS[int(np.argmin(costs))]), constant)


def _commanded(part: NDArray[np.void], lag: float) -> Array:
    """The commanded torque ``lag`` (s) before each state, a line between the answers."""
    answered = part["answer_flags"] >= 0
    t = part["device_us"] * 1e-6
    command = np.interp(t - lag, t[answered], part["torque"][answered])
    return np.asarray(command, dtype=np.float64)


def _held(part: NDArray[np.void], held_s: float) -> NDArray[np.bool_]:
    """Where the motors were on and the command had stood for ``held_s``."""
    on = (part["flags"] & int(StateFlag.MOTOR_ENABLED)) != 0
    t = part["device_us"] * 1e-6
    answered = np.flatnonzero(part["answer_flags"] >= 0)  # of several at once only the newest is
    if len(answered) == 0:
        return np.zeros(len(t), dtype=bool)
    changes = answered[np.flatnonzero(np.diff(part["torque"][answered]) != 0.0) + 1]
    if len(changes) == 0:
        return np.asarray(on)
    before = np.searchsorted(changes, np.arange(len(t)), side="right") - 1
    since = np.where(before >= 0, t - t[changes[np.maximum(before, 0)]], np.inf)
    return np.asarray(on & (since > held_s))
