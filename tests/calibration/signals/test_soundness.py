"""Values that are no measurement, and copies of strokes, are refused by name."""

from dataclasses import replace

import numpy as np
import pytest

from scissorcal.calibration.signals.soundness import refuse_unsound
from scissorcal.errors import InputError
from scissorcal.kernel import Capability, StateFlag
from scissorcal.recording import Recording
from tests.calibration.truth import Truth, friction_recording


@pytest.fixture(scope="module")
def recording():
    return friction_recording(Truth(), np.random.default_rng(1))


def stated(recording: Recording, version: int, capabilities: int) -> Recording:
    """The recording, of a device that states so; the motors run in its strokes."""
    samples = recording.samples.copy()
    samples["flags"] |= int(StateFlag.MOTOR_ENABLED)
    device = {**recording.device, "protocol_version": version, "capabilities": capabilities}
    return replace(recording, samples=samples, device=device)


@pytest.mark.parametrize(
    ("version", "capabilities", "refused"),
    [
        (2, Capability.HANDLE_FORCE_SENSOR, True),
        (2, Capability.HANDLE_FORCE_SENSOR | Capability.TORQUE_MEASURED, False),
        (1, Capability.HANDLE_FORCE_SENSOR, False),
    ],
)
def test_a_device_that_does_not_measure_its_torque_gives_nothing_to_fit(
    version: int, capabilities: int, refused: bool
) -> None:
    recording = friction_recording(Truth(), np.random.default_rng(1))
    device = stated(recording, version, int(capabilities))
    if refused:
        with pytest.raises(InputError, match=r"TORQUE_MEASURED.*capture cut --hand"):
            refuse_unsound((device,))
        off = device.samples.copy()
        off["flags"] &= ~int(StateFlag.MOTOR_ENABLED) & 0xFFFFFFFF
        device = replace(device, samples=off)  # by hand, motors off
    refuse_unsound((device,))


def test_a_sound_recording_passes(recording):
    refuse_unsound((recording, friction_recording(Truth(), np.random.default_rng(2))))


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf, 1e300])
@pytest.mark.parametrize("channel", ["opening", "motor_torque", "handle_force", "advance"])
def test_what_is_no_measurement_is_named(recording, channel, value):
    samples = recording.samples.copy()
    samples[channel][[700, 900]] = value
    with pytest.raises(InputError, match=rf"sample 700: {channel} is .*2 such samples"):
        refuse_unsound((replace(recording, samples=samples),))


def test_an_empty_recording_is_named(recording):
    with pytest.raises(InputError, match="holds 0 samples"):
        refuse_unsound((replace(recording, samples=recording.samples[:0]),))


def test_a_recording_twice_is_named(recording):
    with pytest.raises(
        InputError, match=r"friction\.mcap and friction\.mcap are the same recording"
    ):
        refuse_unsound((recording, recording))


def test_a_log_without_strokes_twice_is_named(recording):
    samples = recording.samples.copy()
    samples["stroke"] = -1
    log = replace(recording, samples=samples, strokes=(), source="log.csv")
    refuse_unsound((log,))
    with pytest.raises(InputError, match=r"again\.csv and log\.csv are the same recording"):
        refuse_unsound((log, replace(log, source="again.csv")))


def test_recordings_of_two_rigs_are_named(recording):
    shifted = recording.samples.copy()
    shifted["motor_torque"] += 1e-4
    rigs = [{"name": "bench", "serial": serial} for serial in ("A1", "B2")]
    first = replace(recording, device=rigs[0])
    other = replace(recording, samples=shifted, device=rigs[1], source="other.mcap")
    with pytest.raises(InputError) as told:
        refuse_unsound((first, other))
    assert "friction.mcap (bench, serial number A1) and other.mcap" in str(told.value)
    assert "two rigs" in str(told.value)
    refuse_unsound((first, replace(other, device=rigs[0])))
    refuse_unsound((first, replace(other, device={})))


def test_a_stroke_twice_is_a_copy(recording):
    samples = recording.samples
    first = samples[samples["stroke"] == 3].copy()
    first["stroke"] = len(recording.strokes)
    twice = replace(recording, samples=np.concatenate([samples, first]))
    with pytest.raises(InputError, match=rf"stroke {len(recording.strokes)} .* copy of stroke 3"):
        refuse_unsound((twice,))


def test_coarse_or_still_strokes_may_repeat(recording):
    samples = recording.samples.copy()
    samples["motor_torque"] = np.round(samples["motor_torque"], 2)
    coarse = replace(recording, samples=samples)
    refuse_unsound((coarse, coarse))
