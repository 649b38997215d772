"""Verdicts on a blade's fit: residuals against the claimed sd, both lengths, the lamps."""

from dataclasses import replace

import numpy as np
import pytest

from scissorcal.calibration.edge.checks import FALSE_ALARMS, blade_verdicts, pair_verdicts
from scissorcal.calibration.edge.fit import fit_blade
from scissorcal.calibration.edge.model import CellData
from scissorcal.calibration.edge.result import SeenPair
from scissorcal.inference import SamplingStatus
from tests.calibration.edge.test_fit import LENGTH, cells, measurement


def verdict(fit, check="residual against claimed sd"):
    chosen = next(row for row in fit.candidates if row.chosen)
    found = blade_verdicts(fit, chosen, SamplingStatus.WEIGHED, "Drawn.", "draft")
    return next(one for one in found if one.check == check)


@pytest.fixture(scope="module")
def fit():
    rng = np.random.default_rng(20)
    return fit_blade([measurement(rng)], None, effort="draft", rng=rng)


def test_a_fit_that_leaves_its_own_points_fails_with_the_figures(fit):
    assert verdict(fit).status == "pass"
    (row,) = fit.photographs
    # as it was seen: off by 0.9 mm where 0.3 is claimed, turning along the blade
    off = np.linspace(0.76e-3, -0.93e-3, len(row.station))
    moved = replace(fit, photographs=(replace(row, residual=tuple(off.tolist())),))
    wide = replace(moved, offset=replace(fit.offset, sd=np.full_like(fit.offset.sd, 0.2e-3)))
    found = verdict(wide)
    assert found.status == "fail"
    assert "a.jpg" in found.why
    assert "-0.8" in found.why or "-0.9" in found.why


@pytest.mark.slow
def test_sound_edges_fail_no_more_often_than_stated():
    """At most 1 % by construction: of 20 sound fits, 3 or more fail with probability 1e-3."""
    failed = 0
    for seed in range(20):
        rng = np.random.default_rng([21, seed])
        one = measurement(rng)
        shift = 5e-6 * rng.standard_normal()
        moved = replace(one, offset=one.offset + shift)
        fit = fit_blade([moved], None, effort="draft", rng=rng)
        failed += verdict(fit).status == "fail"
    assert FALSE_ALARMS == 0.01
    assert failed < 3


def test_blades_of_unlike_length_fail_with_the_tilt_that_would_explain_them():
    alike = SeenPair("a.jpg", 0.9, 0.02, 0.025, 3.0, 10.0)
    unlike = SeenPair("b.jpg", 0.9, -0.105, 0.025, 16.0, 200.0)
    passed, lamps = pair_verdicts([alike])
    assert passed.status == "pass"
    assert lamps.status == "not_evaluated"
    assert "lamp elsewhere" in lamps.why
    failed, apart = pair_verdicts([alike, unlike])
    assert failed.status == "fail"
    assert "b.jpg" in failed.why
    assert "90.0 %" in failed.why
    assert "16 deg" in failed.why
    assert apart.status == "pass"
    assert apart.value == pytest.approx(170.0)


def test_photographs_under_one_lamp_are_no_evidence():
    pairs = [SeenPair(f"{k}.jpg", 0.9, 0.0, 0.02, 0.0, lamp) for k, lamp in enumerate((350.0, 6.0))]
    lamps = pair_verdicts(pairs)[1]
    assert lamps.status == "fail"
    assert lamps.value == pytest.approx(16.0)
    assert "no evidence" in lamps.why
    without = [pairs[0], replace(pairs[1], lamp_deg=None)]
    assert pair_verdicts(without)[1].status == "not_evaluated"
    assert pair_verdicts([SeenPair("lone.jpg", 0.0)]) == ()


def test_common_errors_that_move_an_edge_stay_in_its_family():
    """What is left of such a column outside the family would be measured by the points' noise."""
    one = cells("line", np.random.default_rng(22), count=60)
    wavy = one.modes.copy()
    wavy[:, 0] += 1e-5 * np.sin(40.0 * np.pi * one.station / LENGTH)
    data = CellData((replace(one, modes=wavy),), LENGTH)
    line = np.stack([np.ones_like(one.station), one.station], axis=1)
    known = data.known(line)
    across = line @ np.linalg.solve(line.T @ line, line.T)
    np.testing.assert_allclose(across @ known @ across, known, atol=1e-16)
    assert np.sqrt(np.diag(known)).max() > 3e-6
