"""The verification on a real positioning system."""

import numpy as np
import pytest

from scissorcal.calibration import fit_friction
from scissorcal.calibration.friction.fit import friction_experiment
from scissorcal.calibration.verify.check import StudySettings, assess, make_study, tasks_of
from scissorcal.calibration.verify.simulator import friction_simulator
from scissorcal.calibration.verify.study import run
from scissorcal.recipe import FitFriction
from tests.calibration.friction.test_fit import emps


@pytest.mark.slow
def test_emps_is_calibrated_and_its_halves_agree():
    """30 fits, 1 % of false alarms. What the law lacks repeats: halves differ less than claimed."""
    recording = emps()
    settings = FitFriction(law="coulomb+viscous", symmetry="asymmetric")
    fit = fit_friction((recording,), settings, effort="standard", rng=np.random.default_rng(0))
    design = friction_experiment((recording,), settings, fit)
    simulator = friction_simulator((recording,), settings, fit, design.layout)
    study = make_study(design, fit, simulator, settings=StudySettings(seed=0))
    checks = ("sbc", "halves", "prior")
    result = assess(study, fit, checks, [run(study, task) for task in tasks_of(study, checks, 30)])
    assert {verdict.status for verdict in result.verdicts} == {"pass"}
    assert result.calibration is not None
    for quantity in result.calibration.quantities:
        assert 0.6 < quantity.width < 1.5, quantity.name
    assert result.halves is not None
    assert result.halves.effort_difference < 0.01
    assert {
        label
        for half in (result.halves.first_strokes, result.halves.second_strokes)
        for label in half
    } == set(range(8))
    assert result.sensitivity is not None
    assert max(row.prior for row in result.sensitivity.rows) < 0.01
