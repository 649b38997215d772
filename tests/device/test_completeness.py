"""Planned, recorded and used: by cell of motion, by stroke and by sheet."""

import copy
from typing import Any

import numpy as np
import pytest

from scissorcal.device.capture import capture_friction, open_writer
from scissorcal.device.completeness import completeness
from scissorcal.device.counting import count_recorded, count_used
from scissorcal.device.lockstep import LockstepLink
from scissorcal.recipe.schema import Recipe
from scissorcal.recording import read_recording
from scissorcal.recording.recording import Recording
from tests.device.recipes import short

RECIPE = short("paper-80gsm")


@pytest.fixture(scope="module")
def recording(tmp_path_factory: pytest.TempPathFactory) -> Recording:
    path = tmp_path_factory.mktemp("completeness") / "capture.mcap"
    link = LockstepLink("office-paper", np.random.default_rng(1))
    with open_writer(path, "friction", link, RECIPE, "") as writer:
        capture_friction(link, RECIPE, writer)
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
