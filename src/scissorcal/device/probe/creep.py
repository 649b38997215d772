"""A slow creep to both stops: does the encoder count the range that the identity states?"""

from collections.abc import Callable

from scissorcal.device.probe.talk import RELEASE, Answer, Stage, Talk
from scissorcal.errors import DeviceError
from scissorcal.kernel import StateFlag
from scissorcal.verdicts import Verdict, judge, not_evaluated

RATE_RAD_PER_S = 0.15
TORQUE_SHARE = 1.5
"""The largest torque of the creep, as a multiple of the breakaway torque; within the bounds."""
GAIN_S = 0.15
"""Seconds of the stated rate within which the torque grows from 0 to its largest."""
COUNT_SCALE = "count scale"
STILL_S = 0.4
STILL_STEPS = 5.0
RATIO_LIMIT = 0.05
"""Of the range: stops of rubber give by a degree or two of 50; a wrong count is 50 % and more."""


def creep(
    talk: Talk, breakaway: float, tell: Callable[[float, str], None]
) -> tuple[list[Verdict], dict[str, float]]:
    """Creep to one stop and to the other; verdict and the fact on the range between them."""
    identity = talk.identity
    most = min(TORQUE_SHARE * breakaway, talk.bounds.torque_Nm)
    ends = []
    for done, way in ((0.92, -1), (0.96, 1)):
        tell(done, f"creeping to the {'closed' if way < 0 else 'open'} stop")
        ends.append(talk.play(_to_stop(talk, way, most), free=True))
    stated = identity.opening_max - identity.opening_min
    ratio = (ends[1] - ends[0]) / stated
    good = f"From stop to stop the encoder counts {ends[1] - ends[0]:.3g} rad, {stated:.3g} stated."
    bad = (
        f"From stop to stop the encoder counts {ends[1] - ends[0]:.3g} rad and the device states "
        f"{stated:.3g}: its counts per turn or its gear are wrong by a factor {ratio:.2g}, or "
        "something blocks the blades. Correct the firmware, or clear them."
    )
    verdict = judge("probe.sensors", COUNT_SCALE, abs(ratio - 1.0), RATIO_LIMIT, good, bad)
    return [verdict], {"range_ratio": ratio}


def count_scale_not_checked() -> Verdict:
    """State that nobody looked at the count scale: only both stops show it."""
    why = (
        "Not checked: whether the encoder counts the way between the stops rightly, or half or "
        "twice of it. rig.probe.creep = true checks it: the blades then move slowly to both stops."
    )
    return not_evaluated("probe.sensors", COUNT_SCALE, why, RATIO_LIMIT)


def _to_stop(talk: Talk, way: int, most: float) -> Stage[float]:
    """Move at a slow rate until the blades stand although the torque is at its largest."""
    identity = talk.identity
    state = yield RELEASE
    still = 0
    place = wanted = state.opening
    torque = 0.0
    longest = 4.0 * (identity.opening_max - identity.opening_min) / RATE_RAD_PER_S
    for _ in range(talk.ticks(longest)):
        ahead = RATE_RAD_PER_S * GAIN_S
        wanted += way * RATE_RAD_PER_S * talk.tick_s
        if way * (wanted - state.opening) > ahead:
            wanted = state.opening + way * ahead
        torque = most * (wanted - state.opening) / ahead
        state = yield Answer(torque=torque, clear=bool(state.flags & StateFlag.FAULT_LATCHED))
        moved = abs(state.opening - place) > STILL_STEPS * identity.opening_resolution
        still = 0 if moved else still + 1
        place = state.opening if moved else place
        if still > talk.ticks(STILL_S):
            yield RELEASE
            return float(state.opening)
    yield RELEASE
    raise DeviceError(
        f"{talk.name}: no stop was found within {longest:.0f} s of creeping. Check the encoder's "
        "coupling."
    )
