"""What the probe says of a device that something is wrong with, and how far it moves it."""

from dataclasses import replace

import pytest

from scissorcal.device.probe.probe import ProbeRefusedError, probe
from scissorcal.device.session import Operator, RigSession
from scissorcal.errors import DeviceError, InputError
from scissorcal.recipe import Recipe, builtin_recipe
from scissorcal.recording import ProbeResult
from tests.strange_device import FAULTS, Faults, Person, StrangeDevice, VirtualPort

RECIPE = builtin_recipe("paper-80gsm")
LARGEST_TORQUE = RECIPE.rig.probe.largest_torque_Nm * (1.0 + 1e-6)  # travels in 32 bits
LARGEST_RATE = RECIPE.rig.probe.largest_rate_rad_per_s

STILL = {
    "encoder counted double": "are wrong by a factor 2",
    "encoder counted by half": "are wrong by a factor 0.5",
    "encoder reversed": "the encoder is reversed",
    "motor and encoder reversed": "the encoder is reversed",
    "encoder zero off by 0.1 rad": "the zero of the encoder is wrong",
    "encoder noisy": "The opening jitters by",
    "force sensor dead": "handle_force never changed",
    "tick twice as long as stated": "so tick_us is wrong",
    "clock in milliseconds": "it counts milliseconds",
    "clock 5 % fast": "correct one of them in its firmware",
    "handle radius misstated": "handle_radius is in metres",
    "5 % of frames lost": "of the frames were lost",
    "5 % of frames garbled": "garbled",
    "watchdog deaf": "its watchdog is deaf",
    "watchdog deaf, BRAKE_AFTER_MS refused": "withheld for 1050 ms with ENABLE in force",
}
"""Refused before a torque was commanded."""

MOVED = {
    "motor reversed": "the motor is reversed (the encoder counts rightly",
    "encoder step misstated": "correct opening_resolution",
    "measured torque reversed": "motor_torque has the opposite sign of the command",
    "measured torque half": "its scale or the motor's torque constant is wrong",
    "measured torque frozen": "motor_torque does not follow the command",
    "carriage motor reversed": "Positive force retracts the carriage",
    "carriage encoder reversed": "Positive force retracts the carriage",
}

PUSHING_S = 4.5
"""By then the blades are pushed: pass by hand, idle second, lag and watchdog are over."""

LATER = {
    "clock stands": "its clock (device_us) stood still",
    "encoder stuck": "The blades did not move either way",
    "measurements frozen": "The blades did not move either way",
    "opening NaN": "no number",
    "motor torque NaN": "no number",
    "opening beyond the stops": "beyond the stops that it states",
    "one leap of 0.25 rad": "the opening leapt by 0.25 rad",
    "restarts": "it restarted",
    "encoder fault": "it reports a fault of its encoder",
    "fault that stays": "latched a fault that does not clear",
}
"""Faults that begin while the probe moves the blades."""

DIES_UNSEEN = ("encoder stuck", "measurements frozen")
"""An encoder that dies after the pass by hand showed it alive: the pushes go on growing."""

WARNED = {
    "measured torque zero off by 20 mN m": "motor_torque shows 20",
    "force zero off by 2 N": "handle_force shows 2",
    "BRAKE_AFTER_MS refused": "refused BRAKE_AFTER_MS",
}
"""One device has them all."""


def probed(faults: Faults, recipe: Recipe = RECIPE) -> tuple[ProbeResult, StrangeDevice]:
    device = StrangeDevice(faults, seed=1)
    return probe(RigSession(VirtualPort(device), recipe, Operator(Person(device)))), device


def refused(faults: Faults, recipe: Recipe = RECIPE) -> tuple[ProbeRefusedError, StrangeDevice]:
    device = StrangeDevice(faults, seed=1)
    with pytest.raises(ProbeRefusedError) as caught:
        probe(RigSession(VirtualPort(device), recipe, Operator(Person(device))))
    return caught.value, device


@pytest.mark.parametrize("fault", STILL)
def test_what_can_be_seen_at_rest_moves_nothing(fault: str) -> None:
    error, device = refused(FAULTS[fault])
    assert STILL[fault] in str(error)
    assert device.largest_torque == 0.0
    assert device.largest_rate == 0.0
    assert any(verdict.status == "fail" for verdict in error.result.verdicts)


def test_a_sequence_that_leaps_is_no_deaf_watchdog() -> None:
    """It leaps while commands are withheld, which is no time in which the device should brake."""
    error, device = refused(FAULTS["sequence leaps"])
    assert "contradicted its sequence numbers in 8 of the last 20 states" in str(error)
    assert "brake" not in str(error)
    assert device.largest_torque == 0.0


OF_ONE_PATH = {"measured torque half", "measured torque frozen", "carriage encoder reversed"}
"""Faults that the same stage finds as another one of the list."""


@pytest.mark.parametrize(
    "fault",
    [pytest.param(one, marks=[pytest.mark.slow] * (one in OF_ONE_PATH)) for one in MOVED],
)
def test_signs_and_scales_are_refused_by_small_motions(fault: str) -> None:
    error, device = refused(FAULTS[fault])
    assert MOVED[fault] in str(error)
    assert device.largest_torque <= LARGEST_TORQUE
    assert device.largest_rate < LARGEST_RATE
    if fault == "motor reversed":
        assert device.largest_torque < 2.0 * device.faults.dry_Nm
        assert device.largest_rate < 0.5


@pytest.mark.parametrize("fault", LATER)
def test_what_goes_wrong_during_the_probe_is_named(fault: str) -> None:
    later = {
        name: PUSHING_S
        for name, value in vars(FAULTS[fault]).items()
        if name.endswith("_at_s") and value == 2.0
    }
    error, device = refused(replace(FAULTS[fault], **later))
    assert LATER[fault] in str(error)
    assert device.largest_torque <= LARGEST_TORQUE
    if fault not in DIES_UNSEEN:
        assert device.largest_rate < LARGEST_RATE


def test_what_can_be_subtracted_or_only_worries_is_a_warning() -> None:
    """Such a probe ends well, with motors and stream off."""
    plain, together = vars(Faults()), dict(vars(Faults()))
    for fault in WARNED:
        together |= {k: v for k, v in vars(FAULTS[fault]).items() if v != plain[k]}
    result, device = probed(Faults(**together))
    said = [verdict.why for verdict in result.verdicts if verdict.status == "not_evaluated"]
    for sentence in WARNED.values():
        assert any(sentence in why for why in said)
    found = {verdict.check: verdict.status for verdict in result.verdicts}
    assert (found["watchdog"], found["watchdog value"]) == ("pass", "not_evaluated")
    assert not device._enabled
    assert not device._streaming


@pytest.mark.parametrize("fault", ["unplugged", "silent", "repeats one frame"])
def test_a_device_that_is_gone_is_a_device_error(fault: str) -> None:
    device = StrangeDevice(FAULTS[fault], seed=1)
    with pytest.raises(DeviceError):
        probe(RigSession(VirtualPort(device), RECIPE, Operator(Person(device))))


def test_motor_sign_cures_a_reversed_motor_whose_torque_is_measured_as_it_acts() -> None:
    rig = RECIPE.rig.model_copy(update={"motor_sign": -1})
    recipe = RECIPE.model_copy(update={"rig": rig})
    result, _ = probed(FAULTS["motor reversed"], recipe)
    assert result.motor_sign == -1
    assert result.torque_gain is not None
    assert result.torque_gain.mean == pytest.approx(1.0, abs=0.05)
    error, _ = refused(FAULTS["none"], recipe)
    assert "Set rig.motor_sign = 1" in str(error)


def test_nobody_who_moves_the_blades_leaves_the_encoder_unchecked() -> None:
    """Pushes then stay so small that light blades behind a dead encoder keep within the bound."""
    device = StrangeDevice(Faults(dry_Nm=0.003, inertia=1e-4), seed=1)
    result = probe(RigSession(VirtualPort(device), RECIPE, Operator(lambda request: None)))
    verdict = next(item for item in result.verdicts if item.check == "count scale")
    assert (verdict.status, verdict.value) == ("not_evaluated", None)
    assert "either nobody moved them or the encoder is stuck" in verdict.why
    dead = StrangeDevice(Faults(dry_Nm=0.003, inertia=1e-4, encoder_stuck_at_s=0.0), seed=1)
    with pytest.raises(ProbeRefusedError, match="Not determined: no push up to"):
        probe(RigSession(VirtualPort(dead), RECIPE, Operator(lambda request: None)))
    assert dead.largest_rate < LARGEST_RATE


def test_nobody_to_ask_is_refused_before_anything_is_sent() -> None:
    device = StrangeDevice(seed=1)
    with pytest.raises(InputError, match="must ask a person to clear the blades"):
        probe(RigSession(VirtualPort(device), RECIPE))
    assert device.time_s < 0.1
