"""Captures of the carriage in virtual time: as planned, recorded whole, counted, and stopped."""

from pathlib import Path

import numpy as np
import pytest

from scissorcal.device.capture import CaptureReport, capture, open_writer
from scissorcal.device.completeness import completeness
from scissorcal.device.counting import count_recorded, count_used
from scissorcal.device.lockstep import LockstepLink
from scissorcal.device.session import RigSession
from scissorcal.device.sim.specimen import Specimen, load_specimen
from scissorcal.device.trajectory import advance_plan
from scissorcal.errors import DeviceError, InputError
from scissorcal.kernel import Capability
from scissorcal.recipe import Recipe
from scissorcal.recording import Recording, read_header, read_recording
from tests.device.recipes import changed

RECIPE = changed(
    "paper-80gsm",
    capture__friction_advance={
        "speeds_mm_per_s": (30.0, 80.0),
        "repeats": 1,
        "excitation_s": 2.0,
    },
)


def specimen(**advance: object) -> Specimen:
    plain = load_specimen("office-paper")
    axis = plain.mechanism.advance.model_copy(update=advance)
    mechanism = plain.mechanism.model_copy(update={"advance": axis})
    return plain.model_copy(update={"mechanism": mechanism})


def link_of(rig: Specimen) -> LockstepLink:
    return LockstepLink(rig, np.random.default_rng(1))


def captured(path: Path, link: LockstepLink, recipe: Recipe = RECIPE) -> CaptureReport:
    with open_writer(RigSession(link, recipe), "friction-advance", path) as writer:
        return capture(RigSession(link, recipe), "friction-advance", writer)


@pytest.fixture(scope="module")
def taken(tmp_path_factory: pytest.TempPathFactory) -> tuple[Recording, CaptureReport]:
    path = tmp_path_factory.mktemp("advance") / "capture.mcap"
    report = captured(path, link_of(specimen()))
    return read_recording(path), report


def test_the_carriage_follows_the_plan_and_the_blades_stand(taken):
    recording, report = taken
    samples = recording.samples
    plan = advance_plan(RECIPE, link_of(specimen()).identity)
    reference = plan.segments[0].reference
    assert recording.kind == "friction-advance"
    assert [s.kind for s in recording.strokes] == [s.kind for s in plan.strokes]
    for stroke in recording.strokes:
        ran, meant = samples["stroke"] == stroke.index, reference.stroke == stroke.index
        assert ran.sum() == meant.sum()
        assert np.abs(samples["advance"][ran] - reference.advance[meant]).max() < 2e-3
    moved = samples["stroke"] >= 0
    assert np.ptp(samples["opening"][moved]) < 1e-3
    assert np.abs(samples["force_command"]).max() <= RECIPE.limits.force_N
    assert report.coverage.share == 1.0
    assert report.coverage.sentence() == "32 of 32 cells filled"
    assert report.tally.faults == 0


def test_the_file_names_its_kind_without_its_samples(tmp_path):
    captured(tmp_path / "a.mcap", link_of(specimen()))
    header = read_header(tmp_path / "a.mcap")
    assert (header.kind, header.joint.kind) == ("friction-advance", "rotary")


def test_what_is_missing_and_used_is_counted_in_millimetres(taken):
    recording, _ = taken
    counts = count_recorded(recording, RECIPE, "friction-advance")
    used = count_used(
        recording, RECIPE, "friction-advance", np.array([[0, len(recording.samples)]])
    )
    whole = completeness([counts], RECIPE, "friction-advance", [used])
    assert whole.missing == ()
    ways = {(row.kind, round(row.speed, 9)) for row in whole.strokes}
    assert ways == {(way, v) for way in ("forward", "backward") for v in (30.0, 80.0)}
    assert all(row.used == row.recorded == row.planned == 1 for row in whole.strokes)
    low, high = whole.cells[0].range
    assert (low, high) == pytest.approx((55.0, 62.5))
    assert whole.excitation is not None
    assert whole.excitation.used_s == pytest.approx(2.0, abs=0.01)
    nothing = count_used(recording, RECIPE, "friction-advance", np.zeros((0, 2), np.int64))
    little = completeness([counts], RECIPE, "friction-advance", [nothing]).little_used
    assert any("forward at 30 mm/s: 0 s of" in sentence for sentence in little)
    assert all("ranges of advance" in sentence for sentence in little)
    more = changed(
        "paper-80gsm",
        capture__friction_advance={
            "speeds_mm_per_s": (5.0, 30.0, 80.0),
            "repeats": 1,
            "excitation_s": 8.0,
        },
    )
    lacking = completeness(
        [count_recorded(recording, more, "friction-advance")], more, "friction-advance"
    ).missing
    assert "forward strokes at 5 mm/s: 0 of 1 recorded" in lacking
    assert "excitation: 2.0 s of 8 s recorded" in lacking
    (cells,) = [sentence for sentence in lacking if sentence.startswith("forward at 5 mm/s")]
    assert "ranges of advance" in cells
    assert "mm) have less than" in cells


def test_a_blocked_carriage_stops_the_capture_and_what_was_recorded_stays(tmp_path):
    path = tmp_path / "blocked.mcap"
    with pytest.raises(DeviceError, match="nothing blocks the carriage") as ended:
        captured(path, link_of(specimen(coulomb_N=60.0)))
    assert ended.value.stop == "ADVANCE_STANDS"
    recording = read_recording(path)
    assert recording.stop == "ADVANCE_STANDS"
    assert len(recording.samples) > 1000
    assert np.ptp(recording.samples["advance"]) == 0.0


def test_a_rig_without_an_advance_motor_moves_nothing(tmp_path):
    link = link_of(specimen())
    link.identity = link.identity._replace(capabilities=int(Capability.HANDLE_FORCE_SENSOR))
    before = link.virtual_time
    with pytest.raises(InputError, match="has no advance motor"):
        captured(tmp_path / "a.mcap", link)
    assert link.virtual_time == before
    assert not list(tmp_path.iterdir())


def test_too_short_a_guide_moves_nothing(tmp_path):
    link = link_of(specimen(range_mm=(0.0, 12.0)))
    with pytest.raises(InputError, match="12 mm apart"):
        captured(tmp_path / "a.mcap", link)
    assert not list(tmp_path.iterdir())
