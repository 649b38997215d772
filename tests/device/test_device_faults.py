"""Faults of a device that was written from docs/protocol.md alone: each is named, with its stop.

The whole table, with what is said and the largest torque and rate: benchmarks/device_faults.py.
"""

from dataclasses import replace
from pathlib import Path

import pytest

from scissorcal.device.probe.probe import probe
from scissorcal.device.session import Operator, RigSession
from scissorcal.errors import DeviceError
from scissorcal.kernel import StopReason
from scissorcal.package import ModelPackage
from scissorcal.render import with_probe
from scissorcal.render.rig_facts import rig_facts
from tests.render.conftest import paper as paper
from tests.strange_device import FAULTS, Faults, Person, StrangeDevice, VirtualPort
from tests.strange_device.mechanics import Hand
from tests.strange_device.trials import Outcome, capture_trial, render_trial, short_recipe

STOPS = {
    "motor reversed": "RUNAWAY",
    "encoder reversed": "RUNAWAY",
    "encoder counted by half": "STOP_ELSEWHERE",
    "encoder counted double": "IMPLAUSIBLE",
    "encoder noisy": "OSCILLATION",
    "measured torque reversed": "MEASURED_REVERSED",
    "measured torque half": "MEASURED_DIFFERS",
    "measured torque frozen": "MEASURED_DIFFERS",
    "tick twice as long as stated": "CLOCK_RATE",
    "clock in milliseconds": "CLOCK_RATE",
    "clock 5 % fast": "CLOCK_RATE",
    "clock stands": "DEVICE_CLOCK",
    "clock counts down": "DEVICE_CLOCK",
    "clock random": "DEVICE_CLOCK",
    "every third stamp wrong": "DEVICE_CLOCK",
    "sequence leaps": "DEVICE_CLOCK",
    "3 ms late, light blades": "OSCILLATION",
    "silent": "SILENCE",
    "repeats one frame": "SILENCE",
    "measurements frozen": "OPENING_STANDS",
    "encoder stuck": "OPENING_STANDS",
    "opening NaN": "IMPLAUSIBLE",
    "every second opening NaN": "IMPLAUSIBLE",
    "motor torque NaN": "UNREADABLE",
    "opening beyond the stops": "IMPLAUSIBLE",
    "restarts": "RESTARTED",
    "encoder fault": "ENCODER_FAULT",
    "fault that stays": "DEVICE_FAULT",
    "blades jam": "STOP_ELSEWHERE",
}
"""What stops a capture of friction."""

STOPS_OF_A_CUT = {
    "carriage motor reversed": "RUNAWAY_ADVANCE",
    "carriage encoder reversed": "RUNAWAY_ADVANCE",
    "carriage encoder stuck": "ADVANCE_STANDS",
    "5 ms late": "OSCILLATION",
}

UNNOTICED = {
    "none",
    "motor and encoder reversed",
    "encoder zero off by 0.1 rad",
    "encoder step misstated",
    "motor torque half",
    "motor torque double",
    "measured torque zero off by 20 mN m",
    "force reversed",
    "force zero off by 0.05 N",
    "force zero off by 2 N",
    "force sensor dead",
    "handle radius misstated",
    "0.2 ms late",
    "1 ms late",
    "3 ms late",
    "500 Hz",
    "2 kHz",
    "4 kHz",
    "20 % of frames duplicated",
    "one leap of 0.25 rad",
    "watchdog deaf",
    "torque not clipped",
    "BRAKE_AFTER_MS refused",
    "watchdog deaf, BRAKE_AFTER_MS refused",
}
"""A capture ends well with them: they are harmless to it, or only 'scissorcal device probe' can
tell them, before anything is captured."""

ONE_OF_A_KIND = (
    *("none", "motor and encoder reversed", "encoder zero off by 0.1 rad", "motor torque half"),
    *("force sensor dead", "1 ms late", "500 Hz", "20 % of frames duplicated"),
    *("one leap of 0.25 rad", "watchdog deaf, BRAKE_AFTER_MS refused"),
)
"""One unnoticed fault of each kind; the others of its kind are slow."""

TOLD = {
    "stalls of 30 ms each second": "faults",
    "5 % of frames lost": "frames lost",
    "5 % of frames garbled": "frames lost",
    "one fault latched": "faults",
}
"""A capture goes on, and says how often they came."""

ELSEWHERE = {"unplugged", "no sheet"}


@pytest.mark.parametrize("name", STOPS)
def test_a_capture_of_friction_stops_by_name(name: str, tmp_path: Path) -> None:
    said = capture_trial(name, "friction", tmp_path)
    assert (said.stop, said.exit_code) == (STOPS[name], DeviceError.exit_code)
    assert said.said.startswith(StopReason[said.stop].sentence)
    assert said.torque < 0.55
    _is_kept(said)


@pytest.mark.parametrize("name", STOPS_OF_A_CUT)
def test_a_capture_of_a_cut_stops_by_name(name: str, tmp_path: Path) -> None:
    said = capture_trial(name, "cut", tmp_path)
    assert (said.stop, said.exit_code) == (STOPS_OF_A_CUT[name], DeviceError.exit_code)
    _is_kept(said)


@pytest.mark.parametrize(
    "name",
    [
        *ONE_OF_A_KIND,
        *(
            pytest.param(n, marks=pytest.mark.slow)
            for n in sorted(UNNOTICED.difference(ONE_OF_A_KIND))
        ),
    ],
)
def test_what_does_not_disturb_a_capture_raises_no_alarm(name: str, tmp_path: Path) -> None:
    assert capture_trial(name, "friction", tmp_path).said == "done"


@pytest.mark.parametrize("name", TOLD)
def test_what_comes_and_goes_is_counted(name: str, tmp_path: Path) -> None:
    said = capture_trial(name, "friction", tmp_path)
    assert said.exit_code == 0
    assert TOLD[name] in said.said


def test_a_cable_that_is_pulled_is_an_error_of_the_device(tmp_path: Path) -> None:
    said = capture_trial("unplugged", "friction", tmp_path)
    assert said.exit_code == DeviceError.exit_code
    assert "unplugged" in said.said


def test_a_piece_that_is_missing_is_told_by_its_number(tmp_path: Path) -> None:
    said = capture_trial("no sheet", "cut", tmp_path)
    assert said.exit_code == 0
    assert "(piece 1) cut nothing" in said.said
    assert said.recording is not None
    assert said.recording.unloaded == {0, 2}
    assert any("put in a fresh one" in note for note in said.recording.notes)


@pytest.mark.parametrize("zero_N", [-2.0, pytest.param(0.5, marks=pytest.mark.slow), 3.0])
@pytest.mark.parametrize("missing", [False, True])
def test_a_zero_of_the_force_sensor_hides_no_missing_piece(
    zero_N: float, missing: bool, tmp_path: Path
) -> None:
    faults = Faults(force_zero_N=zero_N, measured_zero_Nm=0.02, no_sheet=missing)
    said = capture_trial("none", "cut", tmp_path, faults)
    assert said.exit_code == 0
    assert said.recording is not None
    assert said.recording.unloaded == ({0, 2} if missing else frozenset())


def test_the_probe_s_zero_of_the_force_sensor_is_taken_off_in_a_rendering(
    paper: ModelPackage, tmp_path: Path
) -> None:
    """A hand that rests on blades that rest, at a sensor that shows 3 N without it."""
    faults, hand = Faults(force_zero_N=3.0), Hand(strokes=0)
    device = StrangeDevice(faults)
    found = probe(RigSession(VirtualPort(device), short_recipe(), Operator(Person(device))))
    assert found.rest.handle_zero_N == pytest.approx(3.0, abs=0.05)
    rig = with_probe(rig_facts(paper), found)
    said = render_trial("none", paper, tmp_path, faults, hand=hand, rig=rig)
    assert said.stop == ""
    assert said.exit_code in (0, 3), said.said
    blind = replace(rig, rest=replace(rig.rest, handle_zero_N=0.0))
    (tmp_path / "blind").mkdir()
    unknown = render_trial("none", paper, tmp_path / "blind", faults, hand=hand, rig=blind)
    assert unknown.stop == "OPENING_STANDS"


@pytest.mark.parametrize(
    ("noise_rad", "period_s", "seconds"),
    [(0.0, 0.33, 1.0), (5e-5, 2.0, 0.3)],
    ids=["fast strokes, a known friction", "gentle strokes, an encoder that jitters"],
)
def test_an_encoder_that_sticks_in_a_rendering_stops_it(
    noise_rad: float, period_s: float, seconds: float, paper: ModelPackage, tmp_path: Path
) -> None:
    """Told from what the probe measured; without the fault nothing stops."""
    sound, hand = Faults(encoder_noise_rad=noise_rad), Hand(period_s=period_s, strokes=20)
    device = StrangeDevice(sound)
    found = probe(RigSession(VirtualPort(device), short_recipe(), Operator(Person(device))))
    assert found.rest.jitters == (noise_rad > 0.0)
    rig = with_probe(rig_facts(paper), found)
    stuck = replace(sound, encoder_stuck_at_s=2.0)
    said = render_trial("none", paper, tmp_path, stuck, hand=hand, rig=rig)
    assert said.stop == "OPENING_STANDS"
    assert 2.2 < said.time_s < 2.0 + seconds
    (tmp_path / "sound").mkdir()
    assert render_trial("none", paper, tmp_path / "sound", sound, hand=hand, rig=rig).stop == ""


def test_a_stuck_encoder_that_friction_may_hold_is_told_at_the_end(
    paper: ModelPackage, tmp_path: Path
) -> None:
    said = render_trial("encoder stuck", paper, tmp_path)
    assert said.exit_code == 0
    assert said.recording is not None
    assert "did not change by a single count" in said.said
    assert any("a single count" in note for note in said.recording.notes)


def test_every_fault_is_in_one_of_the_tables() -> None:
    tables = [set(STOPS), set(STOPS_OF_A_CUT), UNNOTICED, set(TOLD), ELSEWHERE]
    assert set(FAULTS) == set().union(*tables)
    assert sum(map(len, tables)) == len(FAULTS) >= 30


@pytest.mark.parametrize("kind", ["friction", "cut"])
def test_a_good_rig_raises_no_alarm(kind: str, tmp_path: Path) -> None:
    said = capture_trial("none", kind, tmp_path, Faults())
    assert said.said == "done"
    assert said.recording is not None
    assert said.recording.stop == ""
    assert said.recording.unloaded == frozenset()


def _is_kept(said: Outcome) -> None:
    """What was recorded until then has the stop's name, and its sentence among the notes."""
    if said.recording is not None:
        assert said.recording.stop == said.stop
        assert any(StopReason[said.stop].sentence in note for note in said.recording.notes)
