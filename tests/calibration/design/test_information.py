"""Information of strokes: closed forms, and against what the fits' own likelihoods say."""

from dataclasses import replace

import numpy as np
import pytest

from scissorcal.calibration.cut.known import CutBasis
from scissorcal.calibration.design import (
    Information,
    Knowledge,
    PlannedMotion,
    cut_information,
    friction_information,
    planned_cut,
    planned_friction,
)
from scissorcal.calibration.design.state import (
    CutState,
    FrictionState,
    expected_cut,
    expected_friction,
)
from scissorcal.calibration.friction.model import FrictionExperiment
from scissorcal.calibration.friction.moments import ReducedLaw
from scissorcal.calibration.parameters import Layout, Parameter
from scissorcal.calibration.signals.torque_noise import TorqueNoise
from scissorcal.device import Plan, cut_plan, friction_plan
from scissorcal.inference import likelihood_information
from scissorcal.model import IDENTITY, LOG
from scissorcal.recipe import builtin_recipe
from scissorcal.workday import nominal_identity

RECIPE = builtin_recipe("paper-80gsm")
IDENTITY_OF_RIG = nominal_identity(RECIPE)


def layout_of(*sds: float) -> Layout:
    return Layout(
        tuple(Parameter(f"p{i}", "1", LOG, 0.0, sd, "a parameter") for i, sd in enumerate(sds))
    )


def told(*rows: tuple[float, ...], noise: float = 1.0) -> Information:
    columns = np.array(rows)
    curvature = columns.T @ columns / noise**2
    return Information(curvature, curvature)


def planned(plan: Plan, segment: int = 0) -> PlannedMotion:
    reference = plan.segments[segment].reference
    sheet = np.full(len(reference), plan.segments[segment].sheet, dtype=np.int64)
    steps = IDENTITY_OF_RIG.opening_resolution, IDENTITY_OF_RIG.advance_resolution
    return PlannedMotion(
        reference.opening,
        reference.advance,
        reference.stroke.astype(np.int64),
        sheet,
        plan.strokes,
        plan.tick_s,
        *steps,
    )


def sweeps(speeds: tuple[float, ...]) -> Plan:
    wanted = RECIPE.capture.friction.model_copy(
        update={"speeds_rad_per_s": speeds, "repeats": 1, "excitation_s": 1.0}
    )
    capture = RECIPE.capture.model_copy(update={"friction": wanted})
    return friction_plan(RECIPE.model_copy(update={"capture": capture}), IDENTITY_OF_RIG)


def strokes(speeds: tuple[float, ...], count: int) -> Plan:
    wanted = RECIPE.capture.cut.model_copy(
        update={"speeds_rad_per_s": speeds, "strokes_per_sheet": count, "sheets": 1}
    )
    capture = RECIPE.capture.model_copy(update={"cut": wanted})
    return cut_plan(RECIPE.model_copy(update={"capture": capture}), IDENTITY_OF_RIG)


@pytest.fixture(scope="module")
def friction() -> FrictionState:
    return expected_friction(RECIPE)


@pytest.fixture(scope="module")
def cut(friction: FrictionState) -> CutState:
    return expected_cut(RECIPE, friction)


def test_one_recording_with_white_noise_is_a_normal_regression() -> None:
    layout, rows = layout_of(2.0, 0.5), ((1.0, 0.3), (0.2, 1.1), (0.4, -0.7))
    columns, prior = np.array(rows), np.diag([1 / 4.0, 4.0])
    known = Knowledge(layout, np.zeros(2), prior).plus(told(*rows, noise=0.1))
    exact = np.linalg.inv(columns.T @ columns / 0.01 + prior)
    np.testing.assert_allclose(known.covariance, exact, rtol=1e-9)


def test_the_order_of_strokes_does_not_matter() -> None:
    known = Knowledge(layout_of(1.0, 1.0), np.zeros(2), np.eye(2))
    one, other = told((1.0, 0.0)), told((0.5, 2.0))
    np.testing.assert_allclose(
        known.plus(one).plus(other).covariance, known.plus(other + one).covariance, rtol=1e-9
    )
    np.testing.assert_allclose((one + one + one).curvature, one.times(3).curvature)


def test_correlated_noise_widens_as_the_least_squares_estimate_says() -> None:
    """Variance of a mean of n values with covariance R is 1' R 1 / n^2."""
    count, size = 50, 0.2
    apart = np.abs(np.subtract.outer(np.arange(count), np.arange(count)))
    correlated = size**2 * 0.8**apart
    curvature = np.array([[count / size**2]])
    scores = np.array([[correlated.sum() / size**4]])
    known = Knowledge(layout_of(1e6), np.zeros(1), np.array([[1e-12]]))
    found = known.plus(Information(curvature, scores)).covariance[0, 0]
    assert found == pytest.approx(correlated.sum() / count**2)


def test_noisy_data_never_tell_less_than_the_prior() -> None:
    """A score that is far noisier than its curvature says leaves the prior as it was."""
    known = Knowledge(layout_of(2.0), np.zeros(1), np.array([[0.25]]))
    found = known.plus(Information(np.array([[1.0]]), np.array([[1e9]]))).covariance[0, 0]
    assert found == pytest.approx(4.0, rel=1e-6)
    assert found <= 4.0


def test_an_error_of_the_law_does_not_shrink_with_more_strokes() -> None:
    known = Knowledge(layout_of(1e3), np.zeros(1), np.array([[1e-6]]), error_shares={"run": 0.002})
    one = replace(told((1.0,)), errors={"run": np.array([1.0])})
    many = known.plus(one.times(1e12)).covariance[0, 0]
    assert many == pytest.approx(0.002**2, rel=1e-3)


def test_two_recordings_scatter_about_their_mean() -> None:
    """With exact recordings the mean over two has half of the scatter's variance."""
    between = np.array([0.1])
    known = Knowledge(layout_of(1e3), np.zeros(1), np.array([[1e-6]]), between=between)
    exact = told((1e6,))
    assert known.plus(exact).covariance[0, 0] < 1e-10
    two = known.plus(exact).plus(exact, new_recording=True)
    assert two.covariance[0, 0] == pytest.approx(0.1**2 / 2, rel=1e-4)


def test_a_scatter_that_nothing_tells_has_its_usual_size() -> None:
    logarithmic = layout_of(3.0)
    plain = Layout((Parameter("q", "1", IDENTITY, 0.0, 3.0, "a parameter"),))
    for layout, size in ((logarithmic, 0.02), (plain, 0.06)):
        assert Knowledge(layout, np.zeros(1), np.eye(1)).between_sd[0] == pytest.approx(size)


def two_sweeps(friction: FrictionState) -> FrictionExperiment:
    known = friction.knowledge
    return planned_friction(
        planned(sweeps((0.2, 0.8))),
        RECIPE.fit.friction,
        friction.structure,
        known.layout,
        known.point,
        friction.zero_sd,
    )


def test_sweeps_have_the_curvature_of_the_fits_own_likelihood(friction: FrictionState) -> None:
    known = friction.knowledge
    design = two_sweeps(friction)
    by_stroke = friction_information(design, known.point, friction.noise, 0.0)
    assert sorted(by_stroke) == [0, 1, 2, 3, 4, 5], "two, three from the middle, and the excitation"
    law = design.candidate(design.observed).reduced
    assert isinstance(law, ReducedLaw)
    total = sum(by_stroke.values(), Information.none(len(known.point)))
    unit = np.outer(known.layout.sd, known.layout.sd)
    exact = law.information(known.point) * unit
    np.testing.assert_allclose(total.curvature * unit, exact, atol=2e-3 * exact.max())
    np.testing.assert_allclose(np.diag(total.curvature * unit), np.diag(exact), rtol=0.02)


def test_white_noise_of_windows_counts_once_and_slow_noise_more(friction: FrictionState) -> None:
    """White noise by sample: windows overlap, so a mean has the variance of the samples' mean."""
    known = friction.knowledge
    design = two_sweeps(friction)
    place = known.layout.names.index("coulomb_neg")
    size = float(np.exp(known.point[-1]))

    def variance(noise: TorqueNoise) -> float:
        one = friction_information(design, known.point, noise, 0.0)[0]
        return float(one.scores[place, place] / one.curvature[place, place] ** 2)

    level = np.exp(known.point[place])
    samples = (np.radians(38.0) / 0.2) / 1e-3
    white = variance(TorqueNoise(size, 0.0, 0.01)) * level**2
    assert white == pytest.approx(size**2 / samples, rel=0.1)
    slow = variance(TorqueNoise(0.0, size, 0.01)) * level**2
    assert slow == pytest.approx(20.0 * size**2 / samples, rel=0.1)


def test_strokes_through_material_add_up_to_the_fits_own_information(
    friction: FrictionState, cut: CutState
) -> None:
    known = cut.knowledge
    design = planned_cut(
        planned(strokes((0.6,), 2)),
        CutBasis(RECIPE, cut.geometry, friction.known),
        cut.law,
        cut.structure,
        known.layout,
        known.point,
    )
    assert design is not None
    by_stroke = cut_information(design, known.point)
    assert set(by_stroke) <= {0, 1, 2, 3}
    assert len(by_stroke) >= 3
    total = sum(by_stroke.values(), Information.none(len(known.point)))
    candidate = design.candidate(design.observed)
    problem = replace(candidate.problem(design.series), standardised=candidate.likelihood.normal)
    direct = likelihood_information(problem, known.point, 1e-3 * known.layout.sd)
    strong = np.diag(direct) * known.layout.sd**2 > 1.0
    np.testing.assert_allclose(np.diag(total.curvature)[strong], np.diag(direct)[strong], rtol=0.1)
    force = known.layout.names.index("response_force")
    assert np.sqrt(known.plus(total).covariance[force, force]) < 0.05 * known.layout.sd[force]


def test_a_motion_that_never_touches_has_no_design(friction: FrictionState, cut: CutState) -> None:
    motion = planned(strokes((0.6,), 1))
    away = replace(motion, advance=motion.advance - 0.5)
    known = cut.knowledge
    made = planned_cut(
        away,
        CutBasis(RECIPE, cut.geometry, friction.known),
        cut.law,
        cut.structure,
        known.layout,
        known.point,
    )
    assert made is None
