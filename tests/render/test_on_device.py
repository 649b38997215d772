"""A package that the device renders by itself: loaded, watched, recorded, and felt in a tick."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from scissorcal.device import (
    Faults,
    LockstepLink,
    Operator,
    RigSession,
    VirtualRig,
    in_force,
    load_image,
    open_motion,
)
from scissorcal.errors import DeviceError, InputError
from scissorcal.kernel import (
    ConfigKey,
    Drive,
    FirmwareCore,
    FirmwareInputs,
    FirmwareOutputs,
    Kernel,
    Mode,
    Servo,
    ServoConfig,
    StateFlag,
    estimated_rates,
)
from scissorcal.package import ModelPackage, image_of
from scissorcal.recording import Recording, read_recording
from scissorcal.render import Rendering, RenderResult, VirtualStrokes, open_writer, render
from tests.firmware.side import FirmwareSide, board_of

IMAGE_BYTES = 20 * 1024
TWO = VirtualStrokes(count=2, rate_rad_per_s=0.5)


@dataclass
class Drawn:
    """What a core measured and decided, tick by tick."""

    opening: list[float]
    advance: list[float]
    torque: list[float]
    drive: list[Drive]


class WatchedCore(FirmwareCore):
    """A core that renders and whose ticks are drawn."""

    drawn: Drawn

    def tick(self, inputs: FirmwareInputs, received: bytes = b"") -> FirmwareOutputs:
        out = super().tick(inputs, received)
        self.drawn.opening.append(inputs.opening)
        self.drawn.advance.append(inputs.advance)
        self.drawn.torque.append(out.torque)
        self.drawn.drive.append(out.drive)
        return out


class RenderingSide(FirmwareSide):
    """A device side with memory for an image."""

    def __init__(
        self, rig: VirtualRig, rng: np.random.Generator, faults: Faults | None, room: int
    ) -> None:
        super().__init__(rig, rng, None)
        self.drawn = Drawn([], [], [], [])
        self.room = room
        self.power_on()

    def power_on(self) -> None:
        """Start with nothing in memory, as after a loss of power."""
        core = WatchedCore(board_of(self.rig.specimen), self.room)
        core.drawn = self.drawn
        self.core = core


def device(
    room: int = IMAGE_BYTES, link: type[LockstepLink] = LockstepLink
) -> tuple[Any, RenderingSide]:
    """Paper between the blades of a virtual rig that the firmware drives."""
    sides: list[RenderingSide] = []

    def make(rig: VirtualRig, rng: np.random.Generator, faults: Faults | None) -> RenderingSide:
        sides.append(RenderingSide(rig, rng, faults, room))
        return sides[0]

    return link("office-paper", np.random.default_rng(1), device=make), sides[0]


def rendered(
    package: ModelPackage, path: Path, link: LockstepLink, **how: Any
) -> tuple[RenderResult, Recording]:
    told: list[str] = []
    operator = Operator(progress=lambda done, sentence, *_: told.append(sentence))
    session = RigSession(link, package.recipe, operator)
    with open_writer(session, package, path) as writer:
        result = render(
            session,
            package,
            Rendering(**({"strokes": TWO, "seconds": 20.0, "on_device": True} | how)),
            writer=writer,
        )
    assert "loading the package into the device" in told or not how.get("on_device", True)
    return result, read_recording(path)


def test_strokes_are_rendered_by_the_device_watched_and_recorded(
    paper: ModelPackage, tmp_path: Path
) -> None:
    link, side = device()
    result, recording = rendered(paper, tmp_path / "r.mcap", link)
    assert result.strokes == 2
    assert result.misses == result.garbled == result.faults == result.fallback_frames == 0
    assert {verdict.check: verdict.status for verdict in result.verdicts} == {
        "admission": "pass",
        "felt torque": "pass",
        "deadline": "not_evaluated",
        "misses": "pass",
        "faults": "pass",
        "supervision": "pass",
        "passivity": "not_evaluated",
        "motor sense": "pass",
    }
    samples = recording.samples
    by_itself = (samples["flags"] & int(StateFlag.RENDERING)) != 0
    assert by_itself.sum() > 2000
    assert not samples["torque_command"].any()
    assert result.largest_torque_Nm == pytest.approx(np.max(np.abs(samples["motor_torque"])))
    assert 0.02 < result.largest_torque_Nm < 0.3
    assert "1 tick of felt lag" in result.lag.sentence
    assert any("The device rendered by itself" in note for note in recording.notes)
    assert Drive.BRAKE not in side.drawn.drive


PLAIN = ServoConfig(torque_limit=10.0, torque_slew=1e6, force_limit=0.0, force_slew=0.0, ramp_s=0.0)
STOPPED_TICKS = 1000


class Strokes:
    """A hand on a rendering device, or on one that a host renders for; ticks are counted."""

    def __init__(self, package: ModelPackage, *, on_device: bool) -> None:
        self.link, self.side = device()
        self.tables, self.on_device = package.tables, on_device
        if on_device:
            load_image(self.link, image_of(package, PLAIN), lambda *_: None)
        self.link.configure(ConfigKey.MATERIAL, 0.0)
        self.link.configure(ConfigKey.HAND_SPEED_rad_per_s, 0.2)
        if on_device:
            self.link.configure(ConfigKey.RENDER, 1.0)
        self.servo = Servo(package.tables, PLAIN)
        self.servo.engage(Mode.WATCH if on_device else Mode.RENDER)
        self.link.configure(ConfigKey.STREAM, 1.0)
        self.frame: bytes | None = None
        self.began = len(self.side.drawn.torque)
        self.first_enabled: int | None = None

    def answered(self, ticks: int) -> None:
        """The host answers every state."""
        for _ in range(ticks):
            for payload in self.link.exchange(self.frame):
                self.frame = self.servo.answer(payload)

    def unanswered(self, ticks: int) -> None:
        """The host is stopped; what the device sends waits for it."""
        for _ in range(ticks):
            self.link.exchange(None)

    def lags(self) -> list[float]:
        """Ticks of lag at each driven tick, in which the torque is the model's; inf where braked.

        A torque that answers a tick's own measurement acts until the next one is made: 1 tick.
        """
        drawn = self.side.drawn
        on = [i for i, drive in enumerate(drawn.drive) if drive is not Drive.RELEASE]
        opening = np.array(drawn.opening, dtype=np.float32)
        rates = estimated_rates(opening, 1000, PLAIN.rate_cutoff_Hz)
        first = on[0] - (0 if self.on_device else 1)
        kernel = Kernel(self.tables)
        step = kernel.step_many(opening[first:], rates[first:], drawn.advance[first:])["torque"]
        found = []
        for tick in on:
            if drawn.drive[tick] is Drive.BRAKE:
                found.append(math.inf)
                continue
            same = [late for late in range(20) if drawn.torque[tick] == step[tick - first - late]]
            assert same, (tick, drawn.torque[tick])
            if len(same) == 1:  # a torque that stands still tells no lag
                found.append(same[0] + 1.0)
        return found


def test_a_host_that_is_stopped_for_a_second_is_not_felt(silent_paper: ModelPackage) -> None:
    """By the device, 1 tick of lag throughout; by the host 2, and the blades are braked."""
    figures = {}
    for on_device in (True, False):
        hand = Strokes(silent_paper, on_device=on_device)
        hand.answered(100)
        while (answered := len(hand.lags())) < 100:
            hand.answered(100)
        hand.unanswered(STOPPED_TICKS)
        lags = hand.lags()
        figures[on_device] = set(lags[:answered]), set(lags[answered:])
        print("device" if on_device else "host", figures[on_device], len(lags))
        assert len(lags) > answered
    assert figures[True] == ({1.0}, {1.0})
    assert figures[False][0] == {2.0}
    assert math.inf in figures[False][1]


def test_a_device_that_renders_nothing_is_refused_before_anything_moves(
    paper: ModelPackage, tmp_path: Path
) -> None:
    link = LockstepLink("office-paper", np.random.default_rng(1))
    with pytest.raises(DeviceError, match="does not render by itself"):
        rendered(paper, tmp_path / "r.mcap", link)
    assert link.rig.opening == pytest.approx(
        LockstepLink("office-paper", np.random.default_rng(1)).rig.opening, abs=0.01
    )


def test_a_package_that_is_too_large_is_refused_with_both_sizes(
    paper: ModelPackage, tmp_path: Path
) -> None:
    link, side = device(room=512)
    size = len(image_of(paper))
    with pytest.raises(DeviceError, match=f"room for 512 bytes, and the package needs {size}"):
        rendered(paper, tmp_path / "r.mcap", link)
    assert set(side.drawn.drive) == {Drive.RELEASE}


def test_a_package_that_is_held_already_is_not_sent_again(paper: ModelPackage) -> None:
    link, _ = device()
    image, told = image_of(paper), []
    for _ in range(2):
        checksum = load_image(link, image, lambda done, sentence: told.append(done))
        assert in_force(link) == checksum
    assert told == sorted(set(told))
    assert told[-1] == 1.0
    other = image_of(paper, PLAIN)
    assert load_image(link, other, lambda *_: None) != checksum


def end_by(
    disturb: Callable[[RenderingSide], None], package: ModelPackage, sentence: str
) -> LockstepLink:
    """Disturb the device in the fourth block of a rendering; it must end with the sentence."""
    link, side = device()
    blocks = 0

    def progress(done: float, told: str, *_: object) -> None:
        nonlocal blocks
        blocks += "rendering" in told
        if blocks == 4:
            disturb(side)

    session = RigSession(link, package.recipe, Operator(progress=progress))
    with pytest.raises(DeviceError, match=sentence):
        render(session, package, Rendering(20.0, TWO, on_device=True))
    assert side.drawn.torque[-1] == 0.0
    return link


def test_a_loss_of_power_while_rendering_ends_it_and_is_named(paper: ModelPackage) -> None:
    link = end_by(RenderingSide.power_on, paper, "check the device's power")
    assert in_force(link) == 0


def test_a_fault_that_the_host_clears_ends_the_rendering_and_is_named(paper: ModelPackage) -> None:
    """The loop clears the watchdog's fault; the package's torque does not come back by itself."""

    def without_commands(side: RenderingSide) -> None:
        for _ in range(2100):
            side.tick()

    end_by(without_commands, paper, "ended its rendering")


def test_a_rendering_that_was_cut_off_adds_nothing_to_what_runs_next(
    silent_paper: ModelPackage,
) -> None:
    link, _ = device()
    load_image(link, image_of(silent_paper, PLAIN), lambda *_: None)
    link.configure(ConfigKey.RENDER, 1.0)
    with open_motion(link, PLAIN) as motion:
        samples = np.concatenate(list(motion.watch(0.1)))
    driven = (samples["flags"] & int(StateFlag.MOTOR_ENABLED)) != 0
    assert driven.any()
    assert not (samples["flags"] & int(StateFlag.RENDERING)).any()


def test_packages_that_no_device_renders_are_refused_by_name(upper_paper: ModelPackage) -> None:
    with pytest.raises(InputError, match="whose pose is estimated"):
        image_of(upper_paper)
