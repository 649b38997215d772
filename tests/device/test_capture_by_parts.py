"""Captures whose strokes are chosen while they run: parts of plans, pieces, what is kept."""

import threading
import time
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from scissorcal.device.capture import CHOOSING_S, capture_by_parts, open_writer
from scissorcal.device.cut_trajectory import cut_plan
from scissorcal.device.drive import IDLE_S
from scissorcal.device.link import open_link
from scissorcal.device.lockstep import LockstepLink
from scissorcal.device.parts import ChosenStroke, Part, stroke_part, sweep_part
from scissorcal.device.recorder import Recorder
from scissorcal.device.session import Operator, RigSession
from scissorcal.device.sim.process import SimProcess
from scissorcal.device.trajectory import friction_plan
from scissorcal.errors import InputError
from scissorcal.recording import Recording, read_header, read_recording
from tests.device.conftest import IDENTITY
from tests.device.recipes import changed, short
from tests.guard import GUARD_S

RECIPE = short("paper-80gsm")
PLACES = 3


def strokes_of(*wanted: tuple[float, int, int]) -> list[Part]:
    """Parts for (speed, place, sheet), numbered one after the other."""
    return [
        stroke_part(
            RECIPE, IDENTITY, ChosenStroke(speed, place, sheet, 2 * number, place == 0), PLACES
        )
        for number, (speed, place, sheet) in enumerate(wanted)
    ]


def test_parts_of_a_sheet_move_as_its_plan_does() -> None:
    whole = cut_plan(
        changed(
            "paper-80gsm",
            capture__cut={
                "speeds_rad_per_s": (0.8,),
                "strokes_per_sheet": PLACES,
                "sheets": 1,
            },
        ),
        IDENTITY,
    ).segments[0]
    parts = strokes_of(*((0.8, place, 0) for place in range(PLACES)))
    for axis in ("opening", "opening_rate", "advance", "stroke"):
        found = np.concatenate(
            [
                getattr(part.segment.reference, axis)[part.segment.reference.stroke >= 0]
                for part in parts
            ]
        )
        planned = getattr(whole.reference, axis)[whole.reference.stroke >= 0]
        np.testing.assert_array_equal(found, planned)
    for before, after in pairwise(parts):
        ends, begins = before.segment.reference, after.segment.reference
        assert abs(ends.opening[-1] - begins.opening[0]) < 1e-3
        assert abs(ends.advance[-1] - begins.advance[0]) < 1e-4


def test_strokes_are_numbered_on_and_only_the_first_of_a_piece_asks_for_it() -> None:
    parts = strokes_of((0.8, 0, 0), (0.4, 1, 0), (0.4, 0, 1))
    assert [stroke.index for part in parts for stroke in part.strokes] == [0, 1, 2, 3, 4, 5]
    assert [stroke.sheet for part in parts for stroke in part.strokes] == [0, 0, 0, 0, 1, 1]
    assert [part.strokes[0].speed for part in parts] == [0.8, 0.4, 0.4]
    assert [part.fresh for part in parts] == [True, False, True]
    assert "piece 2" in parts[2].segment.request
    assert parts[1].segment.request == ""


def test_sweeps_have_an_excitation_only_where_it_is_asked_for() -> None:
    with_it = sweep_part(RECIPE, IDENTITY, (0.7, 1.5), first=0, excitation_s=1.0)
    kinds = ["closing", "opening", "closing", "opening", "closing"]
    assert [stroke.kind for stroke in with_it.strokes] == [*kinds, "excitation"]
    alone = sweep_part(RECIPE, IDENTITY, (1.5,), first=5)
    assert [(stroke.index, stroke.kind) for stroke in alone.strokes] == [
        (5, "closing"),
        (6, "opening"),
    ]
    planned = friction_plan(RECIPE, IDENTITY)
    whole = sweep_part(RECIPE, IDENTITY, (1.5, 0.7), first=0)
    np.testing.assert_array_equal(
        alone.segment.reference.opening[alone.segment.reference.stroke == 5],
        whole.segment.reference.opening[whole.segment.reference.stroke == 0],
    )
    assert len(whole.strokes) == len(planned.strokes) - 1


class Chooser:
    """Gives prepared parts one after the other and keeps what it was told."""

    def __init__(self, parts: list[Part]) -> None:
        self.parts = parts
        self.heard: list[tuple[int, int]] = []
        self.after = 0

    def __call__(self, recorded: Recording, advance: float) -> Part | None:
        self.heard.append((len(recorded.samples), len(recorded.strokes)))
        number = len(self.heard) - 1
        return self.parts[number] if number < len(self.parts) else None

    def chosen(self) -> None:
        self.after += 1


def test_a_capture_goes_on_until_there_is_no_next_part(tmp_path: Path) -> None:
    link = LockstepLink("office-paper", np.random.default_rng(1))
    choose = Chooser(strokes_of((0.8, 0, 0), (0.8, 1, 0), (0.8, 0, 1)))
    path = tmp_path / "cut.mcap"
    done: list[float] = []

    def progress(share: float, sentence: str, recorder: Recorder) -> None:
        done.append(share)

    with open_writer(RigSession(link, RECIPE), "cut", path, by_parts=True) as writer:
        report = capture_by_parts(
            RigSession(link, RECIPE, Operator(progress=progress)),
            "cut",
            writer,
            choose,
            longest_s=60.0,
            chosen=choose.chosen,
        )
    recording = read_recording(path)
    assert [strokes for _, strokes in choose.heard] == [0, 2, 4, 6]
    assert choose.after == 4
    assert choose.heard[0][0] == pytest.approx(1000 * IDLE_S, abs=60)
    assert len(recording.samples) == report.sample_count > choose.heard[-1][0]
    assert [stroke.sheet for stroke in recording.strokes] == [0, 0, 0, 0, 1, 1]
    assert read_header(path).strokes == recording.strokes
    assert not report.empty
    assert max(done) == 1.0
    label = recording.samples["stroke"]
    assert set(range(6)) <= set(label.tolist())
    torque = recording.samples["motor_torque"]
    assert all(-torque[label == stroke].min() > 0.03 for stroke in (0, 2, 4))
    between = (label == -1) & (np.arange(len(label)) > np.flatnonzero(label == 1)[-1])
    between &= np.arange(len(label)) < np.flatnonzero(label == 2)[0]
    off = recording.samples["torque_command"][between] == 0.0
    assert np.count_nonzero(off) > 900 * CHOOSING_S


def test_what_was_recorded_stays_where_a_choice_fails(tmp_path: Path) -> None:
    link = LockstepLink("office-paper", np.random.default_rng(2))
    parts = strokes_of((0.8, 0, 0))

    def choose(recorded: Recording, advance: float) -> Part | None:
        if recorded.strokes:
            raise InputError("The strokes cannot be fitted.")
        return parts[0]

    path = tmp_path / "cut.mcap"
    with (
        pytest.raises(InputError, match="cannot be fitted"),
        open_writer(RigSession(link, RECIPE), "cut", path, by_parts=True) as writer,
    ):
        capture_by_parts(RigSession(link, RECIPE), "cut", writer, choose, longest_s=60.0)
    recording = read_recording(path)
    assert [stroke.kind for stroke in recording.strokes] == ["closing", "opening"]
    assert {0, 1} <= set(recording.samples["stroke"].tolist())
    assert any("ended early" in note for note in recording.notes)


def test_samples_are_recorded_while_the_choice_goes_on_in_its_own_thread(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As on a port: a link that is not known to be in virtual time."""
    monkeypatch.setattr("scissorcal.device.capture.Exchanging", type("Never", (), {}))
    link = LockstepLink("office-paper", np.random.default_rng(3))
    parts = strokes_of((0.8, 0, 0))
    threads = set()
    waits: list[tuple[int, threading.Event]] = []

    def choose(recorded: Recording, advance: float) -> Part | None:
        threads.add(threading.current_thread())
        idled = threading.Event()
        waits.append((len(recorded.samples), idled))
        assert idled.wait(GUARD_S)
        return None if recorded.strokes else parts[0]

    def progress(share: float, sentence: str, recorder: Recorder) -> None:
        if not waits:
            return
        begun, idled = waits[-1]
        if recorder.sample_count > begun + 1000 * (CHOOSING_S + 0.2):
            idled.set()

    path = tmp_path / "cut.mcap"
    with open_writer(RigSession(link, RECIPE), "cut", path, by_parts=True) as writer:
        capture_by_parts(
            RigSession(link, RECIPE, Operator(progress=progress)),
            "cut",
            writer,
            choose,
            longest_s=60.0,
        )
    assert threads
    assert threading.main_thread() not in threads
    recording = read_recording(path)
    label = recording.samples["stroke"]
    after = label[np.flatnonzero(label == 1)[-1] + 1 :]
    assert len(after) > 1000 * (CHOOSING_S + 0.2 + IDLE_S)
    assert np.all(after == -1)
    assert np.all(np.diff(recording.samples["sequence"].astype(np.int64)) == 1)


@pytest.mark.realtime
def test_a_rig_in_real_time_idles_while_the_next_part_is_chosen(tmp_path: Path) -> None:
    """The choice keeps a processor busy for two seconds in its own thread, twice."""
    parts = [sweep_part(RECIPE, IDENTITY, (1.5,), first=0)]

    def choose(recorded: Recording, advance: float) -> Part | None:
        until = time.monotonic() + 2.0
        while time.monotonic() < until:
            np.linalg.inv(np.eye(60))
        return None if recorded.strokes else parts[0]

    path = tmp_path / "friction.mcap"
    with (
        SimProcess("office-paper", 1) as sim,
        open_link(sim.port) as link,
        open_writer(RigSession(link, RECIPE), "friction", path, by_parts=True) as writer,
    ):
        report = capture_by_parts(
            RigSession(link, RECIPE), "friction", writer, choose, longest_s=60.0
        )
    recording = read_recording(path)
    assert {0, 1} <= set(recording.samples["stroke"].tolist())
    assert recording.duration_s > 2 * (2.0 + IDLE_S)
    assert report.motion.stop_reason.name == "NONE"


def test_a_press_is_reached_with_the_blades_clear_of_the_material() -> None:
    """Presses come in any order: the blades open wide, the carriage moves, then they close."""
    recipe = changed("press-only")
    whole = cut_plan(recipe, IDENTITY).segments[0].reference
    count = recipe.capture.cut.strokes_per_sheet
    for place in range(count):
        stroke = ChosenStroke(0.4, place, 0, 0, place == 0)
        part = stroke_part(recipe, IDENTITY, stroke, count)
        reference = part.segment.reference
        assert reference.opening[0] == pytest.approx(whole.opening.max(), abs=1e-9)
        assert np.ptp(reference.advance) == 0.0
        before = reference.opening[: np.flatnonzero(reference.stroke == 0)[0]]
        top = reference.opening[reference.stroke == 0][0]
        assert before.min() >= top - 1e-3
        assert [stroke.kind for stroke in part.strokes] == ["press", "opening"]
