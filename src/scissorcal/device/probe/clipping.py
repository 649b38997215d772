"""Does the device clip a torque above its stated limit? Only tried where one tick is harmless."""

from scissorcal.device.probe.result import Estimate
from scissorcal.device.probe.talk import RELEASE, Answer, Stage, Talk
from scissorcal.errors import DeviceError
from scissorcal.kernel import ConfigKey, StateFlag
from scissorcal.verdicts import Verdict, judge, not_evaluated

ABOVE = 1.02
"""Above the limit by so much: a device that does not clip gives no more than that either."""
SHORTEST_BRAKE_MS = 1.0
REST_S = 0.05
SDS = 2.0


def clipping(talk: Talk, inertia: Estimate | None, brake_after_ms: float) -> Verdict:
    """Command more than the limit for one tick, if the blades cannot get faster than the bounds.

    The watchdog is set to 1 ms for it, so that a computer that stalls there gives three ticks of
    torque at most: with these and the least inertia the rate is bounded before it is tried. Then
    it is set to ``brake_after_ms`` again.
    """
    limit, bounds = talk.identity.torque_limit, talk.bounds
    check = "clipping"
    if inertia is None or not inertia.mean > SDS * inertia.sd:
        why = "Clipping was not tried: the inertia is not known, so one tick might be too much."
        return not_evaluated("probe.motors", check, why)
    longest_s = SHORTEST_BRAKE_MS * 1e-3 + 3.0 * talk.tick_s
    fastest = ABOVE * limit * longest_s / (inertia.mean - SDS * inertia.sd)
    if fastest > bounds.rate_rad_per_s:
        why = (
            f"Clipping was not tried: a tick at the limit ({limit:.3g} N m) could bring the blades "
            f"to {fastest:.2g} rad/s, and rig.probe allows {bounds.rate_rad_per_s:.2g}."
        )
        return not_evaluated("probe.motors", check, why)
    try:
        talk.link.configure(ConfigKey.BRAKE_AFTER_MS, SHORTEST_BRAKE_MS)
    except DeviceError as error:
        return not_evaluated("probe.motors", check, f"Clipping was not tried: {error}")
    with talk.allowing(ABOVE * limit):
        flagged, largest = talk.play(_struck(talk, ABOVE * limit))
    talk.link.configure(ConfigKey.BRAKE_AFTER_MS, brake_after_ms)
    good = "A torque above the stated limit is clipped and flagged."
    bad = (
        f"A command of {ABOVE * limit:.3g} N m was not flagged TORQUE_SATURATED (largest measured "
        f"torque {largest:.3g} N m): the device must clip what exceeds its limit."
    )
    return judge("probe.motors", check, float(not flagged), 0.0, good, bad)


def _struck(talk: Talk, torque: float) -> Stage[tuple[bool, float]]:
    state = yield Answer()
    state = yield Answer(torque=torque)
    flagged, largest = False, 0.0
    for _ in range(talk.ticks(REST_S)):
        flagged = flagged or bool(state.flags & StateFlag.TORQUE_SATURATED)
        largest = max(largest, abs(state.motor_torque))
        state = yield RELEASE._replace(clear=bool(state.flags & StateFlag.FAULT_LATCHED))
    return flagged, largest
