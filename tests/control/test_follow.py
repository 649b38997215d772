"""The tip on the virtual rig's plate, end to end in virtual time; the true force is the rig's."""

import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from scissorcal.control.control_result import control_figures
from scissorcal.device import VirtualRig
from scissorcal.errors import DeviceError, InputError
from scissorcal.kernel import CONTROL_DTYPE, ControlFlag, HybridFlag, Mode
from scissorcal.model import Cylinder, Plane, Sphere, Surface
from scissorcal.recording import CONTROL, Joint, RecordingWriter, read_recording, read_telemetry
from scissorcal.tracking import PlatePose
from scissorcal.verdicts import failed
from tests.control.virtual import go, points, posed, prepare, rms, seen, specimen


@pytest.mark.parametrize(
    ("plate", "surface", "x_mm"),
    [
        ({"pitch_deg": 5.0}, Plane(), (20.0, 50.0, 30.0)),
        pytest.param({}, Plane(), (20.0, 50.0), marks=pytest.mark.slow),
        ({"surface": "cylinder", "radius_mm": 40.0, "place_mm": (40.0, 14.0, 0.0)},
         Cylinder(0.04, math.pi / 2), (1.0, 14.0, 1.0)),
        ({"surface": "sphere", "radius_mm": 60.0, "place_mm": (40.0, 14.0, 6.0)},
         Sphere(0.06), (1.0, 14.0)),
    ],
)  # fmt: skip
def test_force_and_path_are_kept(
    plate: dict[str, Any],
    surface: Surface,
    x_mm: tuple[float, ...],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    # round the cylinder and back the tip leaves it for a moment in 3 of 48 seeds, 1 among them
    run = go(prepare(points(*x_mm), surface, seed=2, **plate), monkeypatch)
    assert run.result is not None
    figures = run.result.figures
    true, estimated = run.errors()
    assert len(true) > 1_000
    assert rms(true) < 0.12
    assert rms(estimated) < 0.12
    assert figures.force_rms_N < 0.12
    assert figures.path_rms_mm < 0.15
    assert figures.touches == 1
    assert figures.losses == figures.let_goes == 0
    assert figures.reached_share == 1.0
    assert failed(run.result.verdicts) == ()
    assert run.truth.normal_N[-1] == 0.0
    assert run.link.rig.plate is None


@pytest.mark.parametrize("force", [pytest.param(1.0, marks=pytest.mark.slow), 4.0])
def test_a_touch_peaks_near_what_mass_and_stiffness_give(
    force: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """v sqrt(k m) at the approach's speed, before the force rises to what is wanted."""
    run = go(prepare(points(20.0, 40.0, force=force)), monkeypatch)
    assert run.result is not None
    normal = np.array(run.truth.normal_N)
    touch = int(np.flatnonzero(normal)[0])
    peak = normal[touch : touch + 30].max()
    speed = min(run.result.gains.approach_speed, 0.01)
    expected = speed * math.sqrt(1e4 * run.result.masses_kg[1])
    assert peak < expected + 0.3  # the force at which a touch is noticed
    assert normal.max() < force + 0.6


def test_a_pose_that_is_wrong_costs_place_and_no_force(monkeypatch: pytest.MonkeyPatch) -> None:
    truth = specimen(pitch_deg=4.0)
    source = posed(truth, lower_mm=0.5, turned_deg=1.0)
    run = go(prepare(points(20.0, 50.0), source=source, pitch_deg=4.0), monkeypatch)
    true, _ = run.errors()
    assert rms(true) < 0.12


def test_a_plate_that_drifts_is_followed(monkeypatch: pytest.MonkeyPatch) -> None:
    run = prepare(points(20.0, 50.0), drift_mm_per_s=(1.0, 1.0, 0.0))
    run.job = replace(run.job, source=seen(run.link))
    run = go(run, monkeypatch)
    assert run.result is not None
    true, _ = run.errors()
    assert rms(true) < 0.2
    assert run.result.figures.losses == 0
    assert run.result.figures.reached_share == 1.0


def test_a_plate_that_jumps_up_is_pressed_as_before(monkeypatch: pytest.MonkeyPatch) -> None:
    run = go(prepare(points(20.0, 60.0), step_mm=(0.0, 0.8, 0.0), step_at_s=3.0), monkeypatch)
    assert run.result is not None
    true, _ = run.errors()
    assert rms(true[-1_000:]) < 0.12
    assert run.result.figures.reached_share == 1.0
    assert max(run.truth.normal_N) < 6.0


def test_a_plate_that_drops_loses_contact_and_is_said_to(monkeypatch: pytest.MonkeyPatch) -> None:
    run = go(prepare(points(20.0, 60.0), step_mm=(0.0, -1.7, 0.0), step_at_s=3.0), monkeypatch)
    assert run.result is not None
    assert run.result.figures.losses == 1
    assert run.result.figures.touches == 2
    assert [one.check for one in failed(run.result.verdicts)] == ["contact"]


def test_a_hard_touch_is_told_from_the_force_that_was_wanted() -> None:
    """2.9 N at a touch where 0.3 N are wanted; the ramp to 4 N is no peak."""
    samples = np.zeros(1_000, dtype=CONTROL_DTYPE)
    samples["flags"] = int(HybridFlag.CONTACT)
    samples["flags"][100] |= int(HybridFlag.TOUCHED)
    ramp = np.minimum(0.3 + 0.01 * np.arange(900), 4.0)
    samples["force_aim"][100:] = samples["force"][100:] = ramp
    samples["force_wanted"] = 4.0
    samples["force"][101] = 2.9
    (peak,) = control_figures(samples, 1e-3, 1.0, 2, 0.01).peaks_N
    assert peak == pytest.approx(2.9 - 0.31, abs=1e-6)


def test_a_small_force_anywhere_on_the_path_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    path = points(20.0, 40.0)
    path.force[-1] = 0.1
    with pytest.raises(InputError, match=r"0\.1 N is less than 0\.3 N"):
        go(prepare(path), monkeypatch)


def test_without_a_pose_the_tip_is_lifted_and_goes_on_with_the_next(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    truth = specimen()
    known = posed(truth)

    def source(now_s: float, samples: Any) -> PlatePose | None:
        pose = known(now_s, samples)
        assert pose is not None
        gone = 4.0 < now_s < 4.8
        return PlatePose(
            pose.time, pose.rotation, pose.translation, pose.covariance,
            tracked=not gone, why="hidden by a hand" if gone else "",
        )  # fmt: skip

    run = go(prepare(points(20.0, 50.0), source=source), monkeypatch)
    assert run.result is not None
    figures = run.result.figures
    assert figures.let_goes == 1
    assert figures.touches == 2
    assert figures.reached_share == 1.0
    assert "hidden by a hand" in run.result.warnings[0]
    lifted = run.samples["flags"].astype(int) & int(ControlFlag.LIFTED) != 0
    at = np.flatnonzero(lifted)[0]
    assert run.truth.normal_N[int(run.samples["sequence"][at]) - 1] == 0.0
    true, _ = run.errors()
    assert rms(true[-500:]) < 0.12
    assert [v.check for v in failed(run.result.verdicts)] == ["contact"]


def released(run: Any) -> None:
    """The motors are off: the rig, left alone, is pushed by nothing."""
    assert abs(run.truth.torque[-1]) < 0.01
    protocol = run.link._device
    assert not protocol._command.flags


def stops(run: Any, monkeypatch: pytest.MonkeyPatch) -> DeviceError:
    with pytest.raises(DeviceError) as caught:
        go(run, monkeypatch)
    released(run)
    return caught.value


def test_a_plate_taken_away_ends_the_run(monkeypatch: pytest.MonkeyPatch) -> None:
    def take(rig: VirtualRig) -> None:
        if rig.time_s > 5.0 and rig.plate is not None:
            rig.remove_material()

    run = prepare(points(20.0, 60.0), each=take)
    assert stops(run, monkeypatch).stop == "NO_SURFACE"
    gone = run.truth.normal_N.index(0.0, 4_900)
    assert min(np.diff(run.truth.opening[gone:])) > -4e-3  # 4 rad/s: the tip is held back


def test_a_plate_that_is_not_there_ends_the_run(monkeypatch: pytest.MonkeyPatch) -> None:
    run = prepare(points(20.0, 60.0), source=posed(specimen(), lower_mm=-4.0))
    assert stops(run, monkeypatch).stop == "NO_SURFACE"


def test_something_in_the_way_ends_the_run(monkeypatch: pytest.MonkeyPatch) -> None:
    run = prepare(points(20.0, 60.0), source=posed(specimen(), lower_mm=2.8))
    assert stops(run, monkeypatch).stop == "PRESSED_AWAY"


def test_a_hand_at_the_handles_ends_the_run(monkeypatch: pytest.MonkeyPatch) -> None:
    def hold(rig: VirtualRig) -> None:
        if abs(rig.time_s - 5.0) < 5e-4:
            rig.hand.start(0.3, rig.opening, rig.advance)

    assert stops(prepare(points(20.0, 60.0), each=hold), monkeypatch).stop == "HANDLE_HELD"


def test_a_hand_that_is_there_before_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    run = prepare(points(20.0, 60.0))
    run.rig = replace(run.rig, handle_zero_N=3.0)
    with pytest.raises(DeviceError, match="acts on the handles"):
        go(run, monkeypatch)
    released(run)


def test_a_motor_that_turns_the_wrong_way_ends_the_run(monkeypatch: pytest.MonkeyPatch) -> None:
    run = prepare(points(20.0, 60.0))
    tick = run.link.rig.tick

    def reversed_tick(torque: float, *rest: Any) -> Any:
        return tick(-torque, *rest)

    run.link.rig.tick = reversed_tick  # type: ignore[method-assign]
    assert stops(run, monkeypatch).stop in ("MEASURED_REVERSED", "RUNAWAY", "TRACKING_LOST")


def test_a_supervisor_that_falls_silent_leaves_damping(monkeypatch: pytest.MonkeyPatch) -> None:
    """In lockstep the heartbeat is the servo's own call: it is left out while the path goes on."""
    from scissorcal.kernel import Servo

    run = prepare(points(20.0, 60.0))
    answer = Servo.answer
    modes: list[Mode] = []

    def silent(self: Servo, payload: bytes, **how: Any) -> bytes:
        modes.append(self.mode)
        return answer(self, payload, heartbeat=run.link.virtual_time < 5.0, **how)

    monkeypatch.setattr(Servo, "answer", silent)
    error = stops(run, monkeypatch)
    assert "fell back to damping" in str(error)
    assert modes[-1] is not Mode.CONTROL


def test_a_run_is_recorded_with_its_telemetry(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    run = prepare(points(20.0, 35.0))
    path = tmp_path / "control-1.mcap"
    with RecordingWriter(path, "control", Joint("rotary")) as writer:
        run = go(run, monkeypatch, writer=writer)
    recording = read_recording(path)
    rows = read_telemetry(path, CONTROL)
    for name in CONTROL.dtype.names or ():
        assert np.array_equal(rows[name], run.samples[name]), name
    both, ours, theirs = np.intersect1d(
        rows["sequence"], recording.samples["sequence"], return_indices=True
    )
    assert len(both) == len(rows)
    assert np.array_equal(rows["host_time_ns"][ours], recording.samples["host_time_ns"][theirs])
    pressing = rows["flags"].astype(int) & int(HybridFlag.CONTACT) != 0
    assert pressing.sum() > 1_000


def test_equal_seeds_give_equal_runs(monkeypatch: pytest.MonkeyPatch) -> None:
    one, other = (
        go(prepare(points(20.0, 30.0), seed=5), monkeypatch).samples.tobytes() for _ in range(2)
    )
    assert one == other


@pytest.mark.parametrize(
    ("path", "plate", "words"),
    [
        (points(20.0, 160.0), {}, "beyond the plate"),
        (points(20.0, 60.0, force=30.0), {}, "more than the motors may press with"),
        (points(20.0, 60.0, force=0.2), {}, "told from the friction"),
        (points(20.0, 60.0, speed=150.0), {}, "faster than"),
        (points(20.0, 120.0), {"pitch_deg": 25.0}, "degrees of the blades"),
        (points(20.0, 60.0), {"stiffness_N_per_mm": 190.0}, "No gains hold a force"),
    ],
)
def test_what_cannot_be_done_is_refused_before_anything_moves(
    path: Any, plate: dict[str, Any], words: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    run = prepare(path, **plate)
    ticks = len(run.truth.torque)
    with pytest.raises(InputError, match=words):
        go(run, monkeypatch)
    assert len(run.truth.torque) == ticks


def test_no_pose_is_a_sentence_before_anything_moves(monkeypatch: pytest.MonkeyPatch) -> None:
    run = prepare(points(20.0, 60.0), source=lambda now_s, samples: None)
    ticks = len(run.truth.torque)
    with pytest.raises(DeviceError, match="no pose of the plate"):
        go(run, monkeypatch)
    assert len(run.truth.torque) == ticks
