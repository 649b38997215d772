"""Bands hold measured samples of new strokes, recordings and loads as often as they promise."""

import dataclasses

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

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
from scissorcal.recipe import FitFriction
from scissorcal.recording import Recording
from tests.calibration.friction.test_fit import emps
from tests.calibration.friction.test_transmission import CUTOFF_HZ, each_split, split_of
from tests.calibration.truth import QUICK, Truth, friction_recording

SETTINGS = FitFriction(law="coulomb+viscous", symmetry="asymmetric", critic=False)


def predicted(
    train: tuple[Recording, ...], test: tuple[Recording, ...], settings: FitFriction = SETTINGS
) -> tuple[Band, Prediction]:
    fit = fit_friction(train, settings, effort="draft", rng=np.random.default_rng(0))
    band = effort_band(friction_experiment(train, settings, fit), fit)
    return band, predict_effort(fit, band, test, settings.cutoff_Hz)


@pytest.mark.slow
@pytest.mark.parametrize("shared", [0.0, 0.5, 1.0])
@pytest.mark.parametrize("count", [3, 12, 40])
def test_a_random_sample_of_a_new_unit_lies_within(count: int, shared: float) -> None:
    """2,000 sets of units, part of whose error all their samples share.

    Of each set the new unit's share inside scatters by at most 0.3, so that their mean is within 4
    sds, 0.027, of the probability. That is 0.9 for 12 and 40 units, up to 0.3 / (K + 1) more where
    quantiles of whole units step; few units may be wider than promised.
    """
    rng = np.random.default_rng([count, round(10 * shared)])
    held = []
    for _ in range(2000):
        common = np.sqrt(shared) * rng.standard_normal((count + 1, 1))
        errors = common + np.sqrt(1 - shared) * rng.standard_normal((count + 1, 30))
        units = np.repeat(np.arange(count), 30)
        width, calibrated = half_width(errors[:count].ravel(), units, 0.9, float(count))
        assert calibrated == (count >= 9)
        held.append(np.mean(np.abs(errors[count]) <= width))
    assert np.mean(held) > 0.873
    assert count < 9 or np.mean(held) < 0.927 + 0.3 / (count + 1)


def test_units_that_are_alike_give_the_plain_quantile() -> None:
    """Ten copies of one unit: the quantile at 90 %, not the conformal one at 99 %."""
    errors = np.tile(np.linspace(-1.0, 1.0, 1001), 10)
    width, calibrated = half_width(errors, np.repeat(np.arange(10), 1001), 0.9, 10.0)
    assert calibrated
    assert width == pytest.approx(0.9, abs=2e-3)


def test_units_held_as_a_whole_give_the_conformal_quantile() -> None:
    """Errors 1 to 20, one for each unit: the 19th, as (K + 1) 0.9 = 18.9."""
    width, _ = half_width(np.arange(1.0, 21.0), np.arange(20), 0.9, 20.0)
    assert width == 19.0


@given(
    seed=st.integers(0, 2**32 - 1), count=st.integers(9, 30), level=st.sampled_from([0.5, 0.8, 0.9])
)
def test_half_widths_keep_their_order_and_unit(seed: int, count: int, level: float) -> None:
    """Never below the plain quantile or above the largest error; units of effort carry through."""
    rng = np.random.default_rng(seed)
    units = np.repeat(np.arange(count), 7)
    errors = rng.standard_normal(7 * count) * np.exp(rng.standard_normal(count))[units]
    width, _ = half_width(errors, units, level, float(count))
    assert np.quantile(np.abs(errors), level, method="inverted_cdf") <= width
    assert width <= np.abs(errors).max()
    assert half_width(-1e3 * errors, units, level, float(count))[0] == pytest.approx(1e3 * width)


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
    assert (band.unit, band.count, band.calibrated) == ("stroke", 4, False)
    assert 0.87 < found.share_inside < 0.98
    assert found.rms_error < 2.0
    assert "Student" in band.sentence


def test_fresh_recordings_of_the_same_system_lie_within() -> None:
    """17 strokes held out: no assumption but that strokes are alike."""
    rng = np.random.default_rng(7)
    band, found = predicted(
        (friction_recording(Truth(), rng, QUICK),), (friction_recording(Truth(), rng, QUICK),)
    )
    assert band.calibrated
    assert (band.recordings, band.new_recording) == (1, None)
    assert 0.86 < found.share_inside < 0.94
    assert np.isnan(found.low[~found.moving]).all()


@pytest.mark.slow
def test_a_new_recording_of_a_rig_whose_friction_scatters_lies_within() -> None:
    """Coulomb friction scatters by 10 %; three recordings predict a fourth, 8 times.

    The half-width of a new recording is meant, not the band, which is of a new stroke. Shares
    scatter by 0.17 each, so their mean stays above 0.9 - 4 * 0.17 / sqrt(8) = 0.66.
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
        assert (band.unit, band.recordings) == ("stroke", 3)
        assert band.new_recording is not None
        told = found.moving & np.isfinite(found.measured)
        away = np.abs(found.predicted - found.measured)[told]
        shares.append(np.mean(away <= band.new_recording))
    assert np.mean(shares) > 0.66


@each_split
def test_real_loads_lie_within_where_the_parameters_band_held_few(split: str) -> None:
    """Fitted to files, or their first halves; predicted on what was not seen."""
    made = split_of(split)
    settings = FitFriction(
        law="coulomb+viscous+load+presliding",
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
    share = np.mean(inside[unseen])
    assert band.count == {"00 and 03 on 40": 8, "03 and 40 on 00": 23}.get(split, 14)
    assert 0.86 < share < 0.94 if band.calibrated else share > 0.9
    assert band.new_recording is not None
    assert band.new_recording > 2.0 * band.moving


def test_one_stroke_sets_no_band() -> None:
    recording = friction_recording(Truth(), np.random.default_rng(9), QUICK)
    fit = fit_friction((recording,), SETTINGS, effort="draft", rng=np.random.default_rng(0))
    design = friction_experiment((recording,), SETTINGS, fit)
    alone = dataclasses.replace(design, strokes=np.zeros_like(design.strokes))
    with pytest.raises(InputError, match="there is only one"):
        effort_band(alone, fit)
