"""States of a rig with which no motor may run: why, as a sentence."""

import math

import numpy as np
from numpy.typing import NDArray

from scissorcal.device.faults import fault_sentence
from scissorcal.device.motion import STOP_MARGIN_RAD
from scissorcal.kernel import FaultCause, Identity, State, StateFlag, StopReason
from scissorcal.kernel.servo import LEAP_RATES, OPENING_RATE_LIMIT

STAMPS, STAMPS_WRONG = 20, 8
"""Wrong intervals of the last ones that stop a rig, as the core's watch counts them (sc_stamp.c has
the false-alarm rate)."""


def what_is_wrong(
    state: State, identity: Identity, heard: NDArray[np.void], restarted: bool
) -> str:
    """What no motor may run with, as a sentence; empty where nothing is.

    ``heard`` are the last STAMPS + 1 states, HEARD, this one among them; ``restarted`` says that
    the sequence fell since the start.
    """
    numbers = (state.opening, state.advance, state.motor_torque)
    if not all(math.isfinite(number) for number in numbers):
        return "it sent an opening, advance or torque that is no number; check its sensors."
    if state.flags & StateFlag.NOT_HOMED:
        return f"it no longer knows its zero. {StopReason.NOT_HOMED.sentence}"
    if state.flags & StateFlag.ENCODER_FAULT:
        return "it reports a fault of its encoder; check the encoder and its cable."
    if state.cause not in (FaultCause.NONE, FaultCause.WATCHDOG):
        return fault_sentence(state.cause)
    low, high = identity.opening_min, identity.opening_max
    if not low - STOP_MARGIN_RAD <= state.opening <= high + STOP_MARGIN_RAD:
        return (
            f"its opening is {state.opening:.3g} rad, beyond the stops that it states "
            f"({low:.3g} to {high:.3g}); home the encoder, or correct its scale."
        )
    recent = heard[-1 - STAMPS_WRONG :]
    if len(recent) > STAMPS_WRONG and recent["device_us"][0] == recent["device_us"][-1]:
        return f"its clock (device_us) stood still for {STAMPS_WRONG} frames; restart it."
    if restarted:
        return "its sequence began again: it restarted. Check its supply."
    wrong = contradictions(heard, identity.tick_us)
    if wrong >= STAMPS_WRONG:
        return (
            f"its clock (device_us) contradicted its sequence numbers in {wrong} of the last "
            f"{STAMPS} states, so one of them leaps; correct it in the firmware."
        )
    if len(recent) > 1:
        leap = abs(float(recent["opening"][-1] - recent["opening"][-2]))
        ticks = int(recent["sequence"][-1] - recent["sequence"][-2])
        if leap > LEAP_RATES * OPENING_RATE_LIMIT * ticks * identity.tick_us * 1e-6:
            return (
                f"the opening leapt by {leap:.2g} rad within a frame; check the encoder and its "
                "cable."
            )
    return ""


def contradictions(heard: NDArray[np.void], tick_us: float) -> int:
    """In how many intervals clock and sequence differ by more than a factor of two (sc_stamp.c)."""
    by_ticks = tick_us * np.diff(heard["sequence"])
    stated = np.diff(heard["device_us"])
    return int(np.count_nonzero((2 * stated < by_ticks) | (stated > 2 * by_ticks)))
