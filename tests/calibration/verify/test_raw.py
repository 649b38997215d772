"""Raw recordings over the motion of a rig of other construction, and the whole fit of them."""

from dataclasses import dataclass

import numpy as np
import pytest

from scissorcal.calibration import FitResult, cut_experiment, fit_cut, fit_friction
from scissorcal.calibration.cut.known import KnownFriction
from scissorcal.calibration.cut.structure import edge_of
from scissorcal.calibration.friction.fit import friction_experiment
from scissorcal.calibration.verify.check import StudySettings, assess, make_study, tasks_of
from scissorcal.calibration.verify.result import Calibration
from scissorcal.calibration.verify.simulated_motion import DriveTruth, motion_of
from scissorcal.calibration.verify.simulated_recordings import CutTruth, Unevenness, simulate_cut
from scissorcal.calibration.verify.simulator import cut_simulator, friction_simulator
from scissorcal.calibration.verify.study import Study, run
from scissorcal.model import Cutting, Response
from scissorcal.recipe import Recipe
from scissorcal.recording import Recording
from tests.second_rig import capture_cut, capture_friction, draw_truth, fine, paper, recipe_for

pytestmark = pytest.mark.slow

FITS = 20


@dataclass(frozen=True)
class Day:
    recipe: Recipe
    empty: Recording
    cuts: Recording
    friction: FitResult


@pytest.fixture(scope="module")
def day() -> Day:
    """Paper cut on the fine rig, with its friction fitted; critics are left out."""
    rng = np.random.default_rng(21)
    rig = draw_truth(fine(paper()), rng, spread=0.3, shape="uniform")
    recipe = recipe_for(rig)
    settings = {
        "friction": recipe.fit.friction.model_copy(update={"critic": False}),
        "cut": recipe.fit.cut.model_copy(update={"critic": False}),
    }
    recipe = recipe.model_copy(update={"fit": recipe.fit.model_copy(update=settings)})
    empty, _ = capture_friction(rig, recipe, rng)
    cuts, _ = capture_cut(rig, recipe, rng)
    fit = fit_friction((empty,), recipe.fit.friction, effort="standard", rng=rng)
    return Day(recipe, empty, cuts, fit)


@pytest.mark.parametrize("load_share", [0.0, 0.1])
def test_another_materials_parameters_and_teeth_are_recovered(day: Day, load_share: float) -> None:
    """Force, exponent, energy and kappa within four standard deviations; kappa to 1 % on average.

    The material has nothing of the one that was cut: what is found is what was put in.
    """
    recipe, known = day.recipe, KnownFriction.of(day.friction)
    reference_m = recipe.fit.cut.reference_indentation_mm * 1e-3
    wanted = {
        "response_force": 1.0,
        "response_exponent": 1.5,
        "fracture_energy": 0.5,
        "kappa": 0.68,
    }
    truth = CutTruth(
        cutting=Cutting(
            edge_of(recipe).edge,
            Response("power", 1.0, 1.5, reference_m),
            recipe.rig.moving_blades,
            recipe.upper_face_m,
            0.5,
            0.68,
        ),
        uneven=Unevenness(0.04, 1.5e-3, 0.004),
        drive=DriveTruth(
            known.inertia,
            known.law,
            known.noise,
            offset=known.offset,
            cogging=(-known.cogging[0], -known.cogging[1], known.cogging[2]),
            load_share=load_share,
            stroke_sd=known.stroke_sd,
        ),
    )
    kappas = []
    for seed in (5, 6, 7, 8):
        rng = np.random.default_rng(seed)
        made = simulate_cut(motion_of((day.cuts,), known.inertia, known.noise.white_Nm), truth, rng)
        fit = fit_cut(made, recipe, day.friction, effort="standard", rng=rng)
        assert not [note for note in fit.notes if "Kappa is poorly determined" in note]
        for name, value in wanted.items():
            found = fit.parameter(name)
            assert abs(found.mean - value) < 4.0 * found.sd, name
        kappas.append(fit.parameter("kappa").mean)
    assert np.mean(kappas) == pytest.approx(0.68, rel=0.01)  # one fit's sd is 0.3 to 1 %


def test_the_fit_of_friction_is_calibrated_on_raw_samples(day: Day) -> None:
    settings = day.recipe.fit.friction
    design = friction_experiment((day.empty,), settings, day.friction)
    simulator = friction_simulator((day.empty,), settings, day.friction, design.layout)
    study = make_study(design, day.friction, simulator, settings=StudySettings(seed=1))
    assert calibrated(study, day.friction).other_law < 0.2


def test_the_fit_of_a_cut_is_calibrated_on_raw_samples(day: Day) -> None:
    """About half of the fits are averages over laws with and without load-dependent friction."""
    rng = np.random.default_rng(6)
    fit = fit_cut((day.cuts,), day.recipe, day.friction, effort="standard", rng=rng)
    design = cut_experiment((day.cuts,), day.recipe, day.friction, fit)
    simulator = cut_simulator((day.cuts,), day.recipe, day.friction, fit, design.layout)
    quantities = calibrated(
        make_study(design, fit, simulator, settings=StudySettings(seed=1)), fit
    ).quantities
    names = [quantity.name for quantity in quantities[:4]]
    assert names == ["response_force", "response_exponent", "fracture_energy", "kappa"]
    assert [len(quantity.ranks) for quantity in quantities[:4]] == [FITS] * 4


def calibrated(study: Study, fit: FitResult) -> Calibration:
    """The calibration by 20 whole fits, which must pass; 2 % of false alarms over all quantities.

    Intervals that are half as wide as they should be are found with probability 0.8 where one
    quantity has them, 0.99 where three have. The predicted effort is ranked only
    where a fit chose the study's own law, so its limits of coverage are wider.
    """
    records = [run(study, task) for task in tasks_of(study, ("sbc",), FITS)]
    result = assess(study, fit, ("sbc",), records)
    assert {verdict.status for verdict in result.verdicts} == {"pass"}
    assert result.calibration is not None
    assert not result.calibration.broken
    for quantity in result.calibration.quantities:
        assert all(one.low <= one.share for one in quantity.coverage), quantity.name
        assert quantity.width < 1.5, quantity.name
    return result.calibration
