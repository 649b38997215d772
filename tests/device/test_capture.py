"""Captures in virtual time: driven, by hand, by a person who is asked, and with a bad line."""

import math
from pathlib import Path

import numpy as np
import pytest

from scissorcal.device import hand
from scissorcal.device.capture import (
    CaptureReport,
    capture,
    open_writer,
    servo_config,
)
from scissorcal.device.cut_trajectory import cut_plan
from scissorcal.device.lockstep import LockstepLink
from scissorcal.device.paths import PathBuilder
from scissorcal.device.port_motion import open_motion
from scissorcal.device.recorder import Recorder
from scissorcal.device.session import Operator, RigSession, identity_facts
from scissorcal.device.sim.sensors import Faults
from scissorcal.device.trajectory import friction_plan
from scissorcal.errors import DeviceError, InputError
from scissorcal.kernel import (
    Capability,
    ConfigKey,
    FrameDecoder,
    Mode,
    State,
    StateFlag,
    decode,
    encode,
)
from scissorcal.recipe import Recipe
from scissorcal.recording import Recording, read_recording
from tests.device.conftest import IDENTITY
from tests.device.recipes import changed, short

TOML = 'format = "scissorcal-recipe/1"\n'


def link_for(recipe: Recipe, seed: int = 1, faults: Faults | None = None) -> LockstepLink:
    assert recipe.specimen is not None
    return LockstepLink(recipe.specimen, np.random.default_rng(seed), faults)


def captured(
    folder: Path,
    link: LockstepLink,
    recipe: Recipe,
    kind: str,
    **options: object,
) -> tuple[Recording, CaptureReport]:
    path = folder / "capture.mcap"
    hand = bool(options.pop("hand", False))
    session = RigSession(link, recipe, Operator(**options), recipe_toml=TOML)  # type: ignore[arg-type]
    with open_writer(session, kind, path, hand=hand) as writer:  # type: ignore[arg-type]
        report = capture(session, kind, writer, hand=hand)  # type: ignore[arg-type]
    return read_recording(path), report


def test_friction_is_swept_as_planned_and_recorded_whole(tmp_path: Path) -> None:
    recipe = short("paper-80gsm")
    link = link_for(recipe)
    told: list[tuple[float, str, float]] = []

    def progress(done: float, sentence: str, recorder: Recorder) -> None:
        told.append((done, sentence, recorder.coverage.share))

    recording, report = captured(tmp_path, link, recipe, "friction", progress=progress)
    plan = friction_plan(recipe, link.identity, advance=link.rig.advance)
    samples = recording.samples
    assert report.sample_count == len(samples)
    assert [s.kind for s in recording.strokes] == [s.kind for s in plan.strokes]
    reference = plan.segments[0].reference
    for stroke in recording.strokes:
        ran, meant = samples["stroke"] == stroke.index, reference.stroke == stroke.index
        assert ran.sum() == meant.sum()
        error = np.abs(samples["opening"][ran] - reference.opening[meant]).max()
        assert error < 0.02, f"{stroke} strays by {error} rad"
    assert np.all(np.diff(samples["device_time_us"]) > 0)
    assert np.all(np.diff(samples["host_time_ns"]) == 1_000_000)
    assert np.ptp(samples["advance"]) < 1e-3
    assert np.abs(samples["torque_command"]).max() <= recipe.limits.torque_Nm
    assert recording.device == identity_facts(link.identity)
    assert recording.recipe_toml == TOML
    assert recording.handle_radius_m == pytest.approx(0.06)
    assert report.coverage.share == told[-1][2] == 1.0
    dones = [done for done, _, _ in told]
    assert dones == sorted(dones)
    assert dones[-1] == pytest.approx(1.0, abs=0.02)
    assert any("closing at 1.5 rad/s (stroke 3 of 6)" in sentence for _, sentence, _ in told)


@pytest.mark.parametrize("name", ["paper-80gsm", "cotton-cloth"])
def test_cuts_run_through_fresh_sheets(tmp_path: Path, name: str) -> None:
    recipe = short(name, sheets=2)
    link = link_for(recipe)
    recording, report = captured(tmp_path, link, recipe, "cut")
    assert report.tally.lost == report.tally.faults == 0
    assert [stroke.sheet for stroke in recording.strokes] == [0] * 4 + [1] * 4
    closings = [stroke for stroke in recording.strokes if stroke.kind == "closing"]
    assert [stroke.speed for stroke in closings] == [0.4, 0.8, 0.4, 0.8]
    samples = recording.samples
    for stroke in closings:
        of = samples[samples["stroke"] == stroke.index]
        cutting = of["motor_torque"][len(of) // 2 : -len(of) // 5].mean()
        assert cutting < -0.03, "a stroke met no material"
    planned = cut_plan(recipe, link.identity).segments[-1].reference
    assert 0.05 < link.rig.crack < planned.advance.max() + 0.06
    assert not np.any(samples["flags"] & int(StateFlag.FAULT_LATCHED))
    assert samples["opening"][-1] == pytest.approx(planned.opening[-1], abs=0.01)
    assert samples["advance"][-1] == pytest.approx(planned.advance[-1], abs=1e-3)


def test_presses_load_the_pad_at_several_contacts_and_cut_nothing(tmp_path: Path) -> None:
    recipe = short("press-only", sheets=2)
    link = link_for(recipe)
    recording, report = captured(tmp_path, link, recipe, "cut")
    presses = [stroke for stroke in recording.strokes if stroke.kind == "press"]
    assert len(presses) == 4
    assert link.rig.crack == 0.0
    assert report.coverage.share == 1.0
    contacts = set()
    for stroke in presses:
        of = recording.samples[recording.samples["stroke"] == stroke.index]
        contacts.add(round(float(of["advance"].mean()), 3))
        assert of["motor_torque"].min() < -0.03
    assert len(contacts) == 2


def test_the_virtual_hand_cuts_while_the_motors_are_off(tmp_path: Path) -> None:
    recipe = short("paper-80gsm", sheets=2)
    link = link_for(recipe)
    recording, report = captured(tmp_path, link, recipe, "cut", hand=True)
    samples = recording.samples
    closings = [s for s in recording.strokes if s.kind == "closing" and s.sheet >= 0]
    assert [stroke.sheet for stroke in closings] == [0, 0, 1, 1]
    assert closings[1].speed > 1.4 * closings[0].speed
    for stroke in closings:
        of = samples[samples["stroke"] == stroke.index]
        assert not of["torque_command"].any()
        assert not np.any(of["flags"] & int(StateFlag.MOTOR_ENABLED))
        assert of["handle_force"].mean() > 0.3
    assert 0.05 < link.rig.crack < 0.12
    assert report.coverage.share > 0.8


def test_the_virtual_hand_presses(tmp_path: Path) -> None:
    recipe = short("press-only")
    link = link_for(recipe)
    recording, _ = captured(tmp_path, link, recipe, "cut", hand=True)
    pressed = [s for s in recording.strokes if s.kind == "closing" and s.sheet == 0]
    assert len(pressed) == 2
    assert link.rig.crack == 0.0


def like_a_real_rig(recipe: Recipe, capabilities: int = 3) -> LockstepLink:
    """Return a virtual rig that does not say it is one, so that a person is asked."""
    link = link_for(recipe)
    link.identity = link.identity._replace(capabilities=capabilities)
    return link


def test_a_person_is_asked_with_the_motors_off(tmp_path: Path) -> None:
    recipe = short("paper-80gsm", sheets=2)
    link = like_a_real_rig(recipe)
    asked: list[str] = []

    def confirm(request: str) -> None:
        state = link.exchange(None)
        assert state
        asked.append(request)
        link.configure(ConfigKey.MATERIAL, 1.0 if "Put in" in request else 0.0)

    recording, report = captured(tmp_path, link, recipe, "cut", confirm=confirm)
    wanted = ("Take everything out", "piece 1 of 2", "piece 2 of 2")
    assert all(words in request for words, request in zip(wanted, asked, strict=True))
    assert report.tally.faults == 0
    assert link.rig.crack > 0.05
    assert sum("Paused" in note for note in recording.notes) == 2


def test_a_person_cuts_by_hand_on_a_rig_without_motors_for_the_carriage(tmp_path: Path) -> None:
    recipe = short("paper-80gsm")
    link = like_a_real_rig(recipe, capabilities=int(Capability.HANDLE_FORCE_SENSOR))

    def confirm(request: str) -> None:
        assert "2 times by hand" in request
        link.configure(ConfigKey.MATERIAL, 1.0)
        link.configure(ConfigKey.HAND_STROKES, 2.0)
        link.configure(ConfigKey.HAND_SPEED_rad_per_s, 0.5)

    recording, _ = captured(tmp_path, link, recipe, "cut", hand=True, confirm=confirm)
    assert [s.kind for s in recording.strokes if s.sheet == 0].count("closing") == 2
    assert not recording.samples["torque_command"].any()


def test_a_hand_that_is_not_measured_is_refused(tmp_path: Path) -> None:
    recipe = short("paper-80gsm")
    link = like_a_real_rig(recipe, capabilities=int(Capability.ADVANCE_MOTOR))
    with pytest.raises(DeviceError, match="does not measure the force"):
        captured(tmp_path, link, recipe, "cut", hand=True, confirm=lambda request: None)


def test_waiting_for_a_person_without_motion_times_out(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(hand, "GIVE_UP_S", 0.5)
    recipe = short("paper-80gsm")
    recording, _ = captured(
        tmp_path, like_a_real_rig(recipe), recipe, "cut", hand=True, confirm=lambda request: None
    )
    assert any("left after 0 of 2 strokes" in note for note in recording.notes)


def test_without_a_confirm_callback_a_real_rig_does_not_move(tmp_path: Path) -> None:
    recipe = short("paper-80gsm")
    link = like_a_real_rig(recipe)
    before = link.rig.opening
    with pytest.raises(InputError, match="confirm callback"):
        captured(tmp_path, link, recipe, "friction")
    assert link.rig.opening == before
    assert not list(tmp_path.iterdir())


def test_a_line_with_losses_is_tolerated_and_noted(tmp_path: Path) -> None:
    recipe = short("paper-80gsm")
    link = link_for(recipe, faults=Faults(drop_share=0.01, garble_share=0.01))
    recording, report = captured(tmp_path, link, recipe, "friction")
    planned = friction_plan(recipe, link.identity).segments[0].reference
    assert report.tally.lost > 50
    assert report.tally.garbled > 20
    before_recording = report.motion.counters.misses - report.tally.lost
    assert 0 <= before_recording < 10
    for stroke in recording.strokes:
        lost = 1 - np.sum(recording.samples["stroke"] == stroke.index) / np.sum(
            planned.stroke == stroke.index
        )
        assert abs(lost) < 0.3
    notes = " ".join(recording.notes)
    assert "frame missing before frame" in notes
    assert "garbled in total" in notes
    assert f"{report.tally.lost} frames lost in {report.tally.gaps} gaps in total." in notes


def test_unplugging_keeps_what_was_recorded(tmp_path: Path) -> None:
    recipe = short("paper-80gsm")
    link = link_for(recipe, faults=Faults(unplug_s=2.5))
    with pytest.raises(DeviceError, match="unplugged"):
        captured(tmp_path, link, recipe, "friction")
    recording = read_recording(tmp_path / "capture.mcap")
    assert 2.3 < recording.duration_s < 2.5
    assert "ended early" in recording.notes[-1]


def test_a_stuck_encoder_stops_the_motion(tmp_path: Path) -> None:
    recipe = short("paper-80gsm")
    link = link_for(recipe, faults=Faults(stuck_encoder_s=2.0))
    with pytest.raises(DeviceError, match="encoder"):
        captured(tmp_path, link, recipe, "friction")
    last = read_recording(tmp_path / "capture.mcap").samples[-1]
    assert last["torque_command"] == 0.0


def test_a_slow_port_fails_its_checks(tmp_path: Path) -> None:
    recipe = changed(
        "paper-80gsm",
        rig__control={"opening_kp_Nm_per_rad": 6.0, "opening_kd_Nm_s_per_rad": 0.06},
    )
    link = link_for(recipe, faults=Faults(delay_ms=5.0))
    with pytest.raises(DeviceError, match="lower the gains"):
        captured(tmp_path, link, recipe, "friction")


def test_a_fault_before_the_start_is_cleared_and_a_new_one_noted(tmp_path: Path) -> None:
    recipe = short("paper-80gsm")
    link = link_for(recipe)
    with open_motion(link, servo_config(recipe, link.identity)) as motion:
        path = PathBuilder(*motion.position, motion.tick_s)
        path.rest(1.0)
        blocks = motion.track(path.reference())
        for _ in range(12):
            next(blocks)
        assert motion.mode is Mode.TRACK
        for _ in range(15):
            link.exchange(None)  # a host that hesitates: the device brakes
        kept = np.concatenate(list(blocks))
    assert motion.report().counters.faults == 1
    faulty = (kept["flags"] & int(StateFlag.FAULT_LATCHED)) != 0
    assert faulty[0]
    assert not faulty[len(faulty) // 2 :].any()
    _, report = captured(tmp_path, link, recipe, "friction")
    assert report.tally.faults == 0
    assert report.coverage.share == 1.0


def test_limits_are_the_tighter_of_recipe_and_device() -> None:
    recipe = changed("paper-80gsm", limits={"torque_Nm": 0.4, "force_N": 500.0})
    config = servo_config(recipe, IDENTITY)
    assert config.torque_limit == 0.4
    assert config.force_limit == IDENTITY.force_limit
    assert config.tick_us == IDENTITY.tick_us


def test_a_low_limit_is_never_exceeded() -> None:
    weak = changed("paper-80gsm", limits={"torque_Nm": 0.02})
    link = link_for(weak)
    with open_motion(link, servo_config(weak, link.identity)) as motion:
        path = PathBuilder(*motion.position, motion.tick_s)
        path.open_to(0.8, 1.0, 20.0)
        samples = np.concatenate(list(motion.track(path.reference())))
    assert np.abs(samples["torque_command"]).max() == pytest.approx(0.02)


def test_the_same_seed_gives_the_same_recording(tmp_path: Path) -> None:
    recipe = short("paper-80gsm")
    samples = []
    for name in ("first", "second"):
        (tmp_path / name).mkdir()
        link = link_for(recipe, seed=5)
        samples.append(captured(tmp_path / name, link, recipe, "friction")[0].samples)
    assert np.array_equal(*samples)


def test_a_rig_that_stops_sending_ends_the_capture() -> None:
    recipe = short("paper-80gsm")
    link = link_for(recipe)
    with open_motion(link, servo_config(recipe, link.identity)) as motion:
        link.configure(ConfigKey.STREAM, 0.0)
        with pytest.raises(DeviceError, match="No STATE frame arrived for 1 s"):
            for _ in motion.idle(5.0):
                pass


def test_a_position_that_is_not_finite_moves_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    recipe = short("paper-80gsm")
    link = link_for(recipe)
    exchange = link.exchange

    def broken(frame: bytes | None) -> list[bytes]:
        states = [decode(payload) for payload in exchange(frame)]
        frames = [encode(s._replace(opening=math.nan)) for s in states if isinstance(s, State)]
        return FrameDecoder().feed(b"".join(frames))

    monkeypatch.setattr(link, "exchange", broken)
    with open_motion(link, servo_config(recipe, link.identity)) as motion:
        path = PathBuilder(0.5, -0.06, motion.tick_s)
        path.rest(0.1)
        with pytest.raises(DeviceError, match="check its encoders"):
            next(motion.track(path.reference()))
    assert abs(link.rig.rate) < 1e-6
