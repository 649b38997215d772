"""Cuts recorded twice: what differs is in the intervals, what is used is told."""

from dataclasses import replace

import numpy as np
import pytest

from scissorcal.calibration import fit_cut
from scissorcal.calibration.cut.checks import FREE, STARTING, usage_of_segments, usage_sentence
from scissorcal.calibration.cut.known import MaterialData
from scissorcal.calibration.cut.widening import NOT_KNOWN
from scissorcal.calibration.signals.usage import INVALID
from scissorcal.recording import Stroke
from tests.calibration.cut.made_cuts import GEOMETRY, GUESS, HIGH, LOW, NOISE, cut, way
from tests.calibration.cut.recipes import friction_of, paper
from tests.calibration.truth import Truth, make_recording, sweep

OTHER = Truth(fracture_energy=0.54)
"""A batch that is 8 % tougher."""


def one_day(truth, rng, name):
    """A sheet with three strokes at two speeds, closing and opening."""
    openings, advances, strokes = [], [], []
    for place, speed in ((-0.018, 0.3), (0.016, 0.6), (0.05, 0.6)):
        for a, b, kind, v in ((0.85, 0.22, "closing", speed), (0.22, 0.85, "opening", 1.0)):
            strokes.append(Stroke(len(strokes), kind, v, 0))
            openings.append(sweep(a, b, v))
            advances.append(place)
    made = make_recording("cut", openings, advances, strokes, truth, rng, True)
    return replace(made, source=name)


@pytest.fixture(scope="module")
def days():
    rng = np.random.default_rng(11)
    friction = friction_of(Truth(), rng)
    return friction, one_day(Truth(), rng, "monday.mcap"), one_day(OTHER, rng, "tuesday.mcap")


def fitted(friction, *recordings):
    recipe = paper(response="power", fracture="smooth")
    return fit_cut(recordings, recipe, friction, effort="draft", rng=np.random.default_rng(0))


def test_one_recording_notes_that_the_variation_is_unknown(days):
    friction, monday, _ = days
    fit = fitted(friction, monday)
    assert NOT_KNOWN in fit.notes
    assert "recordings" not in {verdict.check for verdict in fit.verdicts}
    assert any("recorded in closing strokes are used" in note for note in fit.notes)


def test_batches_that_differ_are_named_and_widen_the_interval(days):
    friction, monday, tuesday = days
    alone, both = fitted(friction, monday), fitted(friction, monday, tuesday)
    note = next(note for note in both.notes if note.startswith("2 recordings"))
    assert "They differ in fracture_energy from 0.5" in note
    energy, before = both.parameter("fracture_energy"), alone.parameter("fracture_energy")
    assert energy.sd > 3 * before.sd
    assert energy.q05 < 0.5 < 0.54 < energy.q95
    verdict = {one.check: one for one in both.verdicts}["recordings"]
    assert (verdict.scope, verdict.status) == ("fit.cut", "pass")
    assert verdict.value > 0.04
    names = [row["recording"] for row in both.diagnostics["left_out_recordings"]]
    assert names == ["monday.mcap", "tuesday.mcap"]
    assert both.diagnostics["between_recordings_sd"]["fracture_energy"] > 0.02


def test_every_sample_of_a_stroke_is_used_or_has_a_reason():
    from scissorcal.calibration.cut.segments import cut_into_segments

    invalid = np.ones(5 * len(way(HIGH, LOW, HIGH)), dtype=bool)
    made = cut(*[way(HIGH, LOW, HIGH)] * 3)
    usable = invalid[: len(made.made.recording.samples)]
    usable[900:950] = False
    made = cut(*[way(HIGH, LOW, HIGH)] * 3, usable=usable)
    segments = cut_into_segments(
        MaterialData(made.motions, made.materials, NOISE, 1e-4), GEOMETRY, GUESS, True
    )
    recordings = (made.made.recording,)
    usage = usage_of_segments(recordings, segments)
    for row in usage.rows:
        assert row.recorded_s == pytest.approx(row.used_s + sum(row.reasons.values()))
        assert set(row.reasons) <= {INVALID, STARTING, FREE}
    strokes = [row for row in usage.rows if row.stroke >= 0]
    assert len(strokes) == 3
    assert strokes[0].reasons[INVALID] > 0.0
    assert all(row.reasons[STARTING] > 0.0 for row in strokes[1:])
    assert all(row.share > 0.2 for row in strokes[1:])
    assert usage_sentence(recordings, usage).endswith(".")
