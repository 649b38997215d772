"""Planned, recorded and used: by cell of motion, by stroke and by sheet."""

import copy
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from scissorcal.device.capture import capture, open_writer
from scissorcal.device.completeness import completeness
from scissorcal.device.counting import count_recorded, count_used
from scissorcal.device.lockstep import LockstepLink
from scissorcal.device.session import RigSession
from scissorcal.recipe import Recipe
from scissorcal.recording import UNTIL_MARK, Recording, UntilMark, read_recording
from tests.device.recipes import short

RECIPE = short("paper-80gsm")


@pytest.fixture(scope="module")
def recording(tmp_path_factory: pytest.TempPathFactory) -> Recording:
    path = tmp_path_factory.mktemp("completeness") / "capture.mcap"
    link = LockstepLink("office-paper", np.random.default_rng(1))
    with open_writer(RigSession(link, RECIPE), "friction", path) as writer:
        capture(RigSession(link, RECIPE), "friction", writer)
    return read_recording(path)


@pytest.fixture(scope="module")
def recorded(recording: Recording) -> dict[str, Any]:
    return count_recorded(recording, RECIPE, "friction")


def spans_without(recording: Recording, *strokes: int) -> np.ndarray[Any, np.dtype[np.int64]]:
    """All samples but those of some strokes, as first and one past last."""
    keep = ~np.isin(recording.samples["stroke"], strokes)
    change = np.flatnonzero(np.diff(keep.astype(np.int8), prepend=0, append=0))
    return change.reshape(-1, 2).astype(np.int64)


def found(counts: dict[str, Any], used: dict[str, Any] | None, recipe: Recipe = RECIPE) -> Any:
    return completeness([counts], recipe, "friction", None if used is None else [used])


def test_all_samples_used_are_all_that_is_recorded(recording, recorded):
    everything = np.array([[0, len(recording.samples)]])
    result = found(recorded, count_used(recording, RECIPE, "friction", everything))
    assert all(cell.used_s == pytest.approx(cell.recorded_s) for cell in result.cells)
    assert all(row.used == row.recorded == row.planned for row in result.strokes)
    assert result.little_used == ()


def test_a_speed_that_is_not_used_is_named_with_its_seconds(recording, recorded):
    slow = min(s.speed for s in recording.strokes if np.isfinite(s.speed))
    lost = [s.index for s in recording.strokes if s.speed == slow and s.kind == "closing"]
    used = count_used(recording, RECIPE, "friction", spans_without(recording, *lost))
    result = found(recorded, used)
    (sentence,) = result.little_used
    assert sentence.startswith(f"closing at {slow:g} rad/s: ")
    assert "of motion are used, in " in sentence
    row = next(r for r in result.strokes if (r.kind, r.speed_rad_per_s) == ("closing", slow))
    assert (row.recorded, row.used) == (len(lost), 0)
    opening = next(r for r in result.strokes if (r.kind, r.speed_rad_per_s) == ("opening", slow))
    assert opening.used == opening.recorded
    assert result.missing == found(recorded, None).missing, "not used is not missing"


def test_without_a_fit_nothing_is_said_of_use(recorded):
    result = found(recorded, None)
    assert all(cell.used_s is None for cell in result.cells)
    assert {row.used for row in result.summary} == {None}
    assert result.little_used == ()


def test_use_adds_up_over_recordings_and_is_unknown_where_one_is(recording, recorded):
    everything = count_used(recording, RECIPE, "friction", np.array([[0, len(recording.samples)]]))
    counts = [recorded, copy.deepcopy(recorded)]
    both = completeness(counts, RECIPE, "friction", [everything, everything])
    one = completeness(counts, RECIPE, "friction", [everything, {}])
    single = found(recorded, everything)
    for double, cell in zip(both.cells, single.cells, strict=True):
        assert double.used_s == pytest.approx(2 * cell.used_s)
    assert all(cell.used_s is None for cell in one.cells)


def test_an_import_has_no_cells(recording):
    foreign = Recording("friction", recording.samples, strokes=recording.strokes)
    everything = np.array([[0, len(recording.samples)]])
    assert count_recorded(foreign, RECIPE, "friction") == {}
    assert count_used(foreign, RECIPE, "friction", everything) == {}
    assert completeness([{}], RECIPE, "friction", [{}]).summary == ()


def test_excitation_has_a_row_that_is_short_where_it_is_missing(recording, recorded):
    everything = count_used(recording, RECIPE, "friction", np.array([[0, len(recording.samples)]]))
    *_, row = found(recorded, everything).summary
    assert (row.name, row.unit) == ("excitation", "s of excitation")
    assert (row.planned, row.recorded, row.used) == (1, 1, None)
    assert row.motion.endswith(" s used")
    longer = changed_friction(RECIPE, excitation_s=12.0)
    *_, row = found(recorded, everything, longer).summary
    assert (row.planned, row.recorded) == (12, 1)
    assert found(recorded, None, longer).missing[-1].endswith("of 12 s recorded")
    without = changed_friction(RECIPE, excitation_s=0.0)
    assert found(recorded, None, without).excitation is None


@pytest.mark.parametrize(("share", "counted"), [(0.0, 0), (0.001, 0), (0.45, 0), (0.55, 1)])
def test_a_stroke_is_used_from_half_of_its_samples(recording, share, counted):
    label = recording.samples["stroke"]
    (chosen, *_) = [s for s in recording.strokes if s.kind == "closing"]
    here = np.flatnonzero(label == chosen.index)
    spans = np.array([[here[0], here[0] + int(np.ceil(share * len(here)))]])
    used = count_used(recording, RECIPE, "friction", spans)
    assert used["strokes"] == [[chosen.kind, chosen.speed]] * counted


def changed_friction(recipe: Recipe, **keys: object) -> Recipe:
    friction = recipe.capture.friction.model_copy(update=keys)
    capture = recipe.capture.model_copy(update={"friction": friction})
    return recipe.model_copy(update={"capture": capture})


def changed_cut(recipe: Recipe, **keys: object) -> Recipe:
    cut = recipe.capture.cut.model_copy(update=keys)
    capture = recipe.capture.model_copy(update={"cut": cut})
    return recipe.model_copy(update={"capture": capture})


def cut_of(folder: Path, recipe: Recipe, specimen: str, *, hand: bool = False) -> Recording:
    link = LockstepLink(specimen, np.random.default_rng(1))
    path = folder / "cut.mcap"
    with open_writer(RigSession(link, recipe), "cut", path, hand=hand) as writer:
        capture(RigSession(link, recipe), "cut", writer, hand=hand)
    return read_recording(path)


CUT = short("paper-80gsm", sheets=2)


@pytest.fixture(scope="module")
def cut(tmp_path_factory: pytest.TempPathFactory) -> Recording:
    return cut_of(tmp_path_factory.mktemp("cut"), CUT, "office-paper")


def missing(recordings: list[Recording], recipe: Recipe) -> tuple[str, ...]:
    counts = [count_recorded(one, recipe, "cut") for one in recordings]
    return completeness(counts, recipe, "cut").missing


def until(recording: Recording, stroke: int) -> Recording:
    """What was recorded until shortly after a stroke."""
    last = int(np.flatnonzero(recording.samples["stroke"] == stroke)[-1])
    return replace(recording, samples=recording.samples[: last + 50])


def test_a_whole_cut_has_all_its_sheets(cut):
    result = completeness([count_recorded(cut, CUT, "cut")], CUT, "cut")
    assert result.missing == ()
    assert [(s.sheet, s.planned, s.recorded) for s in result.sheets] == [(1, 2, 2), (2, 2, 2)]
    assert {row.kind for row in result.strokes} == {"closing"}, "a fit is not of return strokes"


def test_as_many_strokes_on_fewer_sheets_are_incomplete(cut):
    """Two sheets of two strokes are not four of one."""
    four = changed_cut(CUT, sheets=4, strokes_per_sheet=1)
    assert missing([cut], four) == ("sheets 3, 4: 0 of 1 closing strokes recorded each",)
    result = completeness([count_recorded(cut, four, "cut")], four, "cut")
    assert [row.planned for row in result.sheets] == [1] * 4
    rows = [row for row in result.summary if row.unit == "closing strokes"]
    assert [row.recorded for row in rows] == [2, 2, 0, 0]


def test_a_sheet_that_was_left_early_is_named_until_another_takes_its_place(cut):
    last = [s.index for s in cut.strokes if s.kind == "closing"][2]
    short_of_one = until(cut, last)
    assert "sheet 2: 1 of 2 closing strokes recorded" in missing([short_of_one], CUT)
    assert missing([short_of_one, cut], CUT) == ()
    counts = [count_recorded(one, CUT, "cut") for one in (short_of_one, cut)]
    sheets = completeness(counts, CUT, "cut").sheets
    assert [(s.planned, s.recorded) for s in sheets] == [(2, 2), (0, 1), (2, 2), (0, 2)]


def test_a_cut_stroke_is_used_by_what_follows_its_first_used_sample(cut):
    label = cut.samples["stroke"]
    closing = [s.index for s in cut.strokes if s.kind == "closing"]
    late, brief, broken, whole = (np.flatnonzero(label == index) for index in closing)
    spans = np.array(
        [
            [late[int(0.7 * len(late))], late[-1] + 1],  # free of the material until then
            [brief[-1], brief[-1] + 1],
            [broken[0], broken[int(0.3 * len(broken))]],
            [whole[0], whole[-1] + 1],
        ]
    )
    used = count_used(cut, CUT, "cut", spans)
    assert used["sheets"] == [1, 1]
    assert len(used["strokes"]) == 2
    returns = np.flatnonzero(np.isin(label, [s.index for s in cut.strokes if s.kind == "opening"]))
    spans = np.array([[int(returns[0]), int(returns[-1]) + 1]])
    kinds = {kind for kind, _ in count_used(cut, CUT, "cut", spans)["strokes"]}
    assert "opening" not in kinds


def test_whole_presses_are_complete_although_all_are_on_one_piece(tmp_path):
    recipe = short("press-only", sheets=2)
    pressed = cut_of(tmp_path, recipe, "soft-pad")
    assert missing([pressed], recipe) == ()
    result = completeness([count_recorded(pressed, recipe, "cut")], recipe, "cut")
    assert result.sheets == ()
    assert {row.kind for row in result.strokes} == {"press"}


def test_a_hand_is_held_to_sheets_alone(tmp_path):
    byhand = cut_of(tmp_path, CUT, "office-paper", hand=True)
    assert missing([byhand], CUT) == ()
    three = changed_cut(CUT, sheets=3)
    found = missing([byhand], three)
    assert found[-1] == "sheet 3: 0 of 2 closing strokes recorded"
    assert found[0] == "closing strokes: 4 of 6 recorded"
    result = completeness([count_recorded(byhand, CUT, "cut")], CUT, "cut")
    assert result.cells == ()
    assert [(s.planned, s.recorded) for s in result.sheets] == [(2, 2), (2, 2)]


def marked(ended: str, within: float = 0.9) -> str:
    mark = UntilMark(ended, 4, 2, 1.0, 0.5, within, 0.03, 0.07, 0.95, why="Friction is widest.")
    return mark.as_text()


def test_a_capture_until_the_tolerance_is_judged_by_whether_it_was_reached(recording):
    """Not by the recipe's list: it planned what it chose."""
    few = replace(recording, strokes=recording.strokes[:2], marks=((UNTIL_MARK, marked("")),))
    went_on = count_recorded(few, RECIPE, "friction")
    (missing,) = found(went_on, None).missing
    assert missing.startswith("the scene's tolerance: 4 strokes, 1.0 planned min")
    marks = (*few.marks, (UNTIL_MARK, marked("tolerance", 0.96)))
    reached = count_recorded(replace(few, marks=marks), RECIPE, "friction")
    assert found(reached, None).missing == ()
    assert len(found(reached, None).strokes) == 2
    gave_up = replace(few, marks=((UNTIL_MARK, marked("out of reach")),))
    (missing,) = found(count_recorded(gave_up, RECIPE, "friction"), None).missing
    assert missing.endswith("Friction is widest.")
    both = completeness([went_on, reached], RECIPE, "friction", None)
    assert both.missing == ()
    assert completeness([reached, went_on], RECIPE, "friction", None).missing


@pytest.mark.parametrize("key", ["tolerance_percent", "confidence_percent"])
def test_a_capture_until_a_tolerance_is_incomplete_for_a_tighter_one(recording, key):
    marks = ((UNTIL_MARK, marked("tolerance", 0.96)),)
    count = count_recorded(replace(recording, marks=marks), RECIPE, "friction")

    def lacks(value):
        scene = RECIPE.scene.model_copy(update={key: value})
        recipe = RECIPE.model_copy(update={"scene": scene})
        return completeness([count], recipe, "friction", None).missing

    tight, same, loose = (3.0, 7.0, 9.0) if key == "tolerance_percent" else (99.0, 95.0, 90.0)
    assert lacks(same) == lacks(loose) == ()
    (sentence,) = lacks(tight)
    assert "ended within 7 % at 95 % confidence" in sentence
    assert f"{tight:g} %" in sentence
    assert "scissorcal capture friction --until-tolerance" in sentence


def test_a_capture_of_the_list_beside_one_until_the_tolerance_keeps_its_own_plan(recording):
    listed = count_recorded(recording, RECIPE, "friction")
    marks = ((UNTIL_MARK, marked("tolerance")),)
    short_one = replace(recording, strokes=recording.strokes[:2], marks=marks)
    other = count_recorded(short_one, RECIPE, "friction")
    assert completeness([listed, other], RECIPE, "friction", None).missing == ()
