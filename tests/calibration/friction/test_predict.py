"""Bands hold measured samples of new strokes, recordings and loads as often as they promise."""

import dataclasses

import numpy as np
import pytest

from scissorcal.calibration import fit_friction, friction_experiment
from scissorcal.calibration.friction.predict import (
    Band,
    Prediction,
    effort_band,
    half_width,
    load_band,
    predict_effort,
    predict_far_load,
)
from scissorcal.errors import InputError
from scissorcal.recipe.schema import FitFriction
from scissorcal.recording.recording import Recording
from tests.calibration.friction.test_fit import emps
from tests.calibration.friction.test_transmission import CUTOFF_HZ, each_split, split_of
from tests.calibration.truth import QUICK, Truth, friction_recording

SETTINGS = FitFriction(rung="coulomb+viscous", symmetry="asymmetric", critic=False)


def predicted(
    train: tuple[Recording, ...], test: tuple[Recording, ...], settings: FitFriction = SETTINGS
) -> tuple[Band, Prediction]:
    fit = fit_friction(train, settings, effort="draft", rng=np.random.default_rng(0))
    band = effort_band(friction_experiment(train, settings, fit), fit)
    return band, predict_effort(fit, band, test, settings.cutoff_Hz)


@pytest.mark.slow
@pytest.mark.parametrize(("count", "shared"), [(3, 1.0), (3, 0.0), (12, 1.0), (12, 0.5)])
def test_a_random_sample_of_a_new_unit_lies_within(count: int, shared: float) -> None:
    """2,000 sets of units, part of whose error all their samples share: 90 % less 4 sds, 87 %."""
    rng = np.random.default_rng([count, round(10 * shared)])
    held = []
    for _ in range(2000):
        common = np.sqrt(shared) * rng.standard_normal((count + 1, 1))
        errors = common + np.sqrt(1 - shared) * rng.standard_normal((count + 1, 30))
        units = np.repeat(np.arange(count), 30)
        width, conformal = half_width(errors[:count].ravel(), units, 0.9, float(count))
        assert conformal == (count >= 9)
        held.append(np.mean(np.abs(errors[count]) <= width))
    assert np.mean(held) > 0.87


@pytest.mark.parametrize("first", [0, 1])
def test_half_of_emps_predicts_the_other_half(first: int) -> None:
    """Real data; 4 strokes are held out, so the band is widened and may hold more than 90 %."""
    recording = emps()
    stroke = recording.samples["stroke"]
    seen = np.isin(stroke, [label for label in range(8) if (label // 2) % 2 == first])
    halves = [
        dataclasses.replace(recording, samples=recording.samples[here]) for here in (seen, ~seen)
    ]
    band, found = predicted((halves[0],), (halves[1],))
    assert (band.unit, band.count, band.conformal) == ("stroke", 4, False)
    assert 0.87 < found.share_inside < 0.98
    assert found.rms_error < 2.0
    assert "Student" in band.sentence


def test_fresh_recordings_of_the_same_system_lie_within() -> None:
    """17 strokes held out: no assumption but that strokes are alike."""
    rng = np.random.default_rng(7)
    band, found = predicted(
        (friction_recording(Truth(), rng, QUICK),), (friction_recording(Truth(), rng, QUICK),)
    )
    assert band.conformal
    assert 0.87 < found.share_inside < 0.99
    assert np.isnan(found.low[~found.moving]).all()


@pytest.mark.slow
def test_a_new_recording_of_a_rig_whose_friction_scatters_lies_within() -> None:
    """Coulomb friction scatters by 10 %; three recordings predict a fourth, 8 times.

    Shares scatter by 0.17 each, so their mean stays above 0.9 - 4 * 0.17 / sqrt(8) = 0.66.
    """
    rng = np.random.default_rng(8)
    shares = []
    for _ in range(8):
        truths = [
            dataclasses.replace(
                Truth(),
                coulomb_pos=0.013 * np.exp(0.1 * rng.standard_normal()),
                coulomb_neg=0.016 * np.exp(0.1 * rng.standard_normal()),
            )
            for _ in range(4)
        ]
        *train, test = (friction_recording(truth, rng) for truth in truths)
        band, found = predicted(tuple(train), (test,))
        assert band.unit == "recording"
        shares.append(found.share_inside)
    assert np.mean(shares) > 0.66


@each_split
def test_real_loads_lie_within_where_the_parameters_band_held_few(split: str) -> None:
    """Fitted to files, or their first halves; predicted on what was not seen."""
    made = split_of(split)
    settings = FitFriction(
        rung="coulomb+viscous+load+presliding",
        symmetry="symmetric",
        cutoff_Hz=CUTOFF_HZ,
        critic=False,
    )
    fit = fit_friction(made.train, settings, effort="draft", rng=np.random.default_rng(0))
    design = friction_experiment(made.train, settings, fit)
    band = load_band(design, fit, made.train, CUTOFF_HZ)
    found = predict_far_load(fit, band, made.test, CUTOFF_HZ)
    unseen = found.time_s >= made.unseen_from_s
    inside = (found.measured >= found.low) & (found.measured <= found.high)
    assert np.mean(inside[unseen]) > 0.9
    assert band.count == len(made.train)


def test_one_stroke_sets_no_band() -> None:
    recording = friction_recording(Truth(), np.random.default_rng(9), QUICK)
    fit = fit_friction((recording,), SETTINGS, effort="draft", rng=np.random.default_rng(0))
    design = friction_experiment((recording,), SETTINGS, fit)
    alone = dataclasses.replace(design, strokes=np.zeros_like(design.strokes))
    with pytest.raises(InputError, match="there is only one"):
        effort_band(alone, fit)
