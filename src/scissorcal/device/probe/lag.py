"""Do the motors answer, how late, do commands get lost, does silence brake? At zero torque."""

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from scissorcal.device.probe.idle import CLEARINGS
from scissorcal.device.probe.talk import LINE, MOTORS, RELEASE, Answer, Stage, Talk
from scissorcal.errors import DeviceError
from scissorcal.kernel import ConfigKey, StateFlag
from scissorcal.verdicts import Check, Verdict

TOGGLES, ASKED = 12, 200
LONGEST_TICKS_S = 0.1
PAUSES = (7, 11, 5, 13, 9, 6)
"""Ticks between toggles: of different lengths, so that nothing periodic in the host aligns."""
WITHHELD_TICKS = 3
"""After the longest lag: how long commands are withheld before the device may brake."""
NEVER_S = 0.05
"""A command that has not shown by then will not: a busy computer is away for 20 ms now and then."""
FEWEST_LOST = 4
"""Of ASKED: below it the interval of 95 % (Clopper and Pearson 1934, doi:10.1093/biomet/26.4.404)
reaches below the limit; of 5 % of commands lost fewer are seen in 1 of 100 probes."""
ENABLE = Check("probe.motors enable", f"{MOTORS}: whether they follow ENABLE")
LAG = Check(
    "probe.motors lag", f"{MOTORS}: from a state to the effect of its answer, ms", at_most=25.0
)
"""A loop that is so late holds a bandwidth of pi / 4 / 25 ms = 31 rad/s at a phase margin of 45
degrees: blades then stay behind by 30 mrad at 1 rad/s, and no sweep is steady."""
LOST_COMMANDS = Check("probe.line lost commands", f"{LINE}: share of commands", at_most=0.005)
"""Share of commands. One in 200 lost lets two in a row go missing once a minute at 1 kHz."""


class Lag(NamedTuple):
    """``ticks``: from the state that a command answers to the first that shows it; empty where
    ENABLE never showed. ``lost`` of ``asked`` single commands did not arrive."""

    ticks: tuple[int, ...]
    asked: int
    lost: int

    @property
    def median(self) -> float:
        return float(np.median(self.ticks)) if self.ticks else math.nan


def lag(talk: Talk) -> Lag:
    """Toggle ENABLE with repeated commands for the lag, then with single ones for losses."""
    toggled = talk.play(_toggled(talk))
    if not toggled:
        return Lag((), 0, 0)
    longest = max(toggled)
    talk.late_ticks = longest
    silence_ms = (longest + WITHHELD_TICKS + 2) * talk.tick_s * 1e3
    with talk.braking_after(max(silence_ms, 10.0)):
        asked, lost = talk.play(_singles(talk, longest))
    return Lag(tuple(toggled), asked, lost)


def judge_lag(found: Lag, tick_ms: float) -> list[Verdict]:
    """Verdicts on ENABLE, on the lag and on commands that do not arrive."""
    if not found.ticks:
        why = (
            "MOTOR_ENABLED did not show within 0.1 s of ENABLE: the device does not take commands. "
            "Check its receive line, its emergency stop and its firmware."
        )
        return [ENABLE.verdict("fail", None, why)]
    late = found.median * tick_ms
    said = f"Commands take effect after {late:.3g} ms (median)"
    bad = (
        f"{said}: no loop through it follows a sweep. Shorten the way (no hub or network adapter; "
        "'scissorcal device doctor' measures the port)."
    )
    verdicts = [LAG.judge(late, f"{said}.", bad)]
    share = found.lost / found.asked
    said = f"{found.lost} of {found.asked} single commands did not arrive"
    if found.lost >= FEWEST_LOST:
        why = (
            f"{said}: what the host sends is lost on its way. Check the host's transmit line, its "
            "ground and the device's receive buffer; 'scissorcal device doctor' measures the port."
        )
        verdicts.append(LOST_COMMANDS.verdict("fail", share, why))
    elif found.lost:
        why = f"{said}, too few to tell how many are lost in general."
        verdicts.append(LOST_COMMANDS.not_evaluated(why, share))
    else:
        verdicts.append(LOST_COMMANDS.verdict("pass", share, f"{said}."))
    return verdicts


def _toggled(talk: Talk) -> Stage[list[int]]:
    """Switch ENABLE on and off; return after how many ticks each showed, [] where one never did."""
    lags: list[int] = []
    on = False
    state = yield RELEASE
    for toggle in range(TOGGLES):
        answer = RELEASE if on else Answer()
        on = not on
        asked, begin = talk.sequence, talk.mark()
        disturbed = shown = False
        while talk.sequence - asked < talk.ticks(LONGEST_TICKS_S) and not shown:
            faulty = bool(state.flags & StateFlag.FAULT_LATCHED)
            disturbed = disturbed or faulty  # this computer was late, and the device braked
            state = yield answer._replace(clear=faulty)
            found = _first(talk, begin, on)
            shown = found is not None
            if found is not None and not disturbed:
                lags.append(found - asked)
        if not shown:
            return []
        for _ in range(PAUSES[toggle % len(PAUSES)]):
            state = yield answer._replace(clear=bool(state.flags & StateFlag.FAULT_LATCHED))
    return lags


def _singles(talk: Talk, longest: int) -> Stage[tuple[int, int]]:
    """ENABLE once, and nothing until it shows: it does if and only if that command arrived."""
    on = StateFlag.MOTOR_ENABLED | StateFlag.FAULT_LATCHED
    state = yield RELEASE
    asked = lost = 0
    for _ in range(ASKED):
        since = talk.sequence
        while state.flags & on or talk.sequence - since <= longest + 1:
            if talk.sequence - since > talk.ticks(LONGEST_TICKS_S) + 2 * longest:
                return asked, lost
            faulty = bool(state.flags & StateFlag.FAULT_LATCHED)
            state = yield RELEASE._replace(clear=faulty) if state.flags & on else None
        begin, since = talk.mark(), talk.sequence
        state = yield Answer()
        while not _shown(talk, begin) and talk.sequence - since < longest + talk.ticks(NEVER_S):
            state = yield None
        asked += 1
        lost += not _shown(talk, begin)
        state = yield RELEASE
    return asked, lost


def _shown(talk: Talk, begin: int) -> bool:
    """Whether ENABLE has arrived: the motors are on, or braked already for want of another."""
    heard = talk.heard(begin)["flags"]
    return bool(np.any(heard & int(StateFlag.MOTOR_ENABLED | StateFlag.FAULT_LATCHED)))


def _first(talk: Talk, begin: int, on: bool) -> int | None:
    """Sequence of the first state since ``begin`` in which the motors are on, or off."""
    heard = talk.heard(begin)
    showing = ((heard["flags"] & int(StateFlag.MOTOR_ENABLED)) != 0) == on
    return int(heard["sequence"][int(np.argmax(showing))]) if showing.any() else None


LATER_S = 0.05
LONGEST_BRAKE_MS = 1000.0
"""As in the protocol: no device has a longer BRAKE_AFTER_MS, whatever it refuses."""


@dataclass(frozen=True)
class Watchdog:
    """What silence does.

    ``brake_after_ms`` is the value in force, as asked for where the device refuses it; ``refused``
    is why, empty where it takes the value. Commands were withheld for at most ``withheld_ms``;
    ``braked_ms`` is the silence after which it braked, None where it did not.
    """

    brake_after_ms: float
    refused: str
    withheld_ms: float
    braked_ms: float | None
    latched: bool
    lost_shown: bool
    lost_cleared: bool
    fault_cleared: bool


def watchdog(talk: Talk, brake_after_ms: float) -> Watchdog:
    """Enable the motors at zero torque, then withhold commands.

    ``brake_after_ms`` is set as BRAKE_AFTER_MS, and stays. A device that refuses it keeps another
    value, so commands are withheld for longer than any that the protocol allows.
    """
    refused, in_force = "", brake_after_ms
    try:
        in_force = talk.link.configure(ConfigKey.BRAKE_AFTER_MS, brake_after_ms)
    except DeviceError as error:
        refused = str(error)
    withheld_s = 1e-3 * (LONGEST_BRAKE_MS if refused else in_force) + LATER_S
    braked, latched, shown = talk.play(_silenced(talk, withheld_s))
    lost_cleared, fault_cleared = talk.play(_recovered(talk))
    return Watchdog(
        in_force,
        refused,
        1e3 * withheld_s,
        braked,
        latched,
        shown,
        lost_cleared,
        fault_cleared,
    )


def _silenced(talk: Talk, longest_s: float) -> Stage[tuple[float | None, bool, bool]]:
    """Withhold commands; return the silence until the brake (ms), and which flags showed."""
    state = yield RELEASE
    for _ in range(talk.ticks(LATER_S) + CLEARINGS):
        state = yield Answer(clear=bool(state.flags & StateFlag.FAULT_LATCHED))
        if not state.flags & StateFlag.FAULT_LATCHED and state.flags & StateFlag.MOTOR_ENABLED:
            break
    last, begin = talk.sequence, talk.mark()
    while talk.sequence - last < talk.ticks(longest_s):
        state = yield None
        braked = StateFlag.FAULT_LATCHED | StateFlag.COMMANDS_LOST
        if state.flags & braked:
            heard = talk.heard(begin)  # of several states at once the first tells when
            first = int(np.argmax((heard["flags"] & int(braked)) != 0))
            silent = (int(heard["sequence"][first]) - last) * talk.tick_s
            state = yield None
            shown = bool(state.flags & StateFlag.COMMANDS_LOST)
            return 1e3 * silent, bool(state.flags & StateFlag.FAULT_LATCHED), shown
    return None, False, False


def _recovered(talk: Talk) -> Stage[tuple[bool, bool]]:
    """Send commands again; return whether COMMANDS_LOST clears by them, the fault when asked."""
    state = yield RELEASE
    for _ in range(talk.ticks(LATER_S)):
        state = yield RELEASE
    lost_cleared = not state.flags & StateFlag.COMMANDS_LOST
    for _ in range(CLEARINGS):
        if not state.flags & StateFlag.FAULT_LATCHED:
            break
        state = yield RELEASE._replace(clear=True)
    return lost_cleared, not state.flags & StateFlag.FAULT_LATCHED
