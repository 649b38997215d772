"""Sheets that were cut before, or were not there, are found and named."""

from dataclasses import replace

import numpy as np
import pytest

from scissorcal.calibration import fit_cut
from scissorcal.calibration.cut.checks import SheetStrokes, count_empty, stale_verdict
from scissorcal.calibration.cut.path_motion import path_motion
from scissorcal.calibration.cut.path_work import material_of
from scissorcal.recording import Stroke
from tests.calibration.cut.made_cuts import FRICTION, HIGH, LOW, cut, way
from tests.calibration.cut.path.made import INERTIA
from tests.calibration.cut.recipes import friction_of, paper
from tests.calibration.truth import QUICK, Truth, make_recording, sweep

PLACES = (-0.018, 0.012, 0.042)
SPEEDS = (0.4, 0.2, 0.4)


def capture(*, fed: bool, sheets: int = 2):
    """Three strokes through each sheet; where it is not ``fed``, all through the first one."""
    ways = [way(HIGH, LOW, HIGH, speed=speed) for speed in SPEEDS * sheets]
    sheet = [number for number in range(sheets) for _ in PLACES]
    made = cut(*ways, places=PLACES * sheets, kinds=tuple(sheet) if fed else (0,) * len(sheet))
    recording = made.made.recording
    strokes = tuple(
        replace(stroke, sheet=number)
        for stroke, number in zip(recording.strokes, sheet, strict=True)
    )
    return replace(recording, strokes=strokes, source="day/cut-1.mcap")


def counted(recording):
    motions = path_motion((recording,), INERTIA)
    materials = tuple(material_of(motion, FRICTION, 0.0) for motion in motions)
    return count_empty(motions, materials, (recording,))


def test_fresh_sheets_have_no_empty_stroke():
    rows = counted(capture(fed=True))
    assert [(row.sheet, row.strokes, row.empty) for row in rows] == [(0, 3, 0), (1, 3, 0)]
    assert stale_verdict(rows).status == "pass"


def test_a_sheet_that_was_not_replaced_is_named():
    rows = counted(capture(fed=False))
    assert [(row.sheet, row.strokes, row.empty) for row in rows] == [(0, 3, 0), (1, 3, 3)]
    verdict = stale_verdict(rows)
    assert (verdict.status, verdict.value) == ("fail", 1.0)
    assert "sheet 1 of cut-1.mcap: 3 of 3" in verdict.why
    assert "Insert fresh material" in verdict.why


@pytest.mark.parametrize(("empty", "status"), [(0, "pass"), (2, "pass"), (3, "fail")])
def test_only_most_of_the_strokes_make_a_sheet_stale(empty, status):
    assert stale_verdict((SheetStrokes("a.mcap", 4, 4, empty),)).status == status


def day(rng):
    """Three sheets of which the second was never put in: its strokes go through the first."""
    openings, advances, strokes, planned = [], [], [], []
    for sheet in range(3):
        for place, speed in zip(PLACES, (0.5, 0.9, 0.7), strict=True):
            for a, b, kind, v in ((0.85, 0.22, "closing", speed), (0.22, 0.85, "opening", 1.0)):
                there = 0 if sheet == 1 else sheet
                strokes.append(Stroke(len(strokes), kind, v, there))
                planned.append(Stroke(len(planned), kind, v, sheet))
                openings.append(sweep(a, b, v))
                advances.append(place)
    made = make_recording("cut", openings, advances, strokes, Truth(), rng, True)
    return replace(made, strokes=tuple(planned))


def test_a_capture_with_a_missing_sheet_fails():
    rng = np.random.default_rng(4)
    friction = friction_of(Truth(), rng, QUICK)
    recipe = paper(response="power", fracture="smooth")
    found = fit_cut((day(rng),), recipe, friction, effort="draft", rng=rng)
    verdict = {one.check: one for one in found.verdicts}["stale sheets"]
    assert verdict in found.rejected
    assert "sheet 1 of cut.mcap: 3 of 3" in verdict.why
    assert "sheet 0" not in verdict.why
    assert "sheet 2" not in verdict.why
