"""Resting cracks: found from geometry, integrated out exactly, and no bias from where they rest."""

import pickle
from dataclasses import replace

import numpy as np
import pytest

from scissorcal.calibration import cut_experiment, fit_cut
from scissorcal.calibration.cut_expected import Expected, Spread, kept_of_a_saw_tooth
from scissorcal.calibration.cut_likelihood import contrasts, make_blocks, normal_terms
from scissorcal.calibration.cut_motion import cut_motion
from scissorcal.calibration.cut_rests import find_rests
from scissorcal.calibration.signals.filtering import condition
from scissorcal.model import Cutting, Edge, EdgeBelief, Response
from tests.calibration.test_cut import friction_of, recipe
from tests.calibration.truth import Truth, cut_recording, loaded_cut_recording

RIPPLED = Truth(kappa=0.75)
EDGE = Edge("line", RIPPLED.edge_offset, RIPPLED.taper, 0.075)


def law(**changes) -> Cutting:
    truth = RIPPLED
    cutting = Cutting(
        edge=EDGE,
        response=Response("power", truth.force, truth.exponent, truth.reference),
        moving_blades=2,
        upper_face_m=truth.upper_face,
        fracture_energy=truth.fracture_energy,
        kappa=truth.kappa,
    )
    return replace(cutting, **changes)


@pytest.fixture(scope="module")
def motion():
    recording = cut_recording(replace(RIPPLED, noise=1e-4), np.random.default_rng(20), sheets=1)
    bins = condition((recording,), 300.0, 150.0)
    bins = bins.where(bins.stroke >= 4)
    return cut_motion(bins, EDGE, 2, RIPPLED.upper_face, RIPPLED.reference)


@pytest.fixture(scope="module")
def friction():
    return friction_of(RIPPLED, np.random.default_rng(21))


def test_a_rest_is_a_withdrawal_that_lets_go():
    closing = np.linspace(-0.01, 0.03, 41)
    jitter = closing + np.where(np.arange(41) % 2, -2e-4, 0.0)
    away = np.linspace(0.029, 0.0, 20)
    again = np.linspace(0.001, 0.06, 60)
    rests = find_rests(np.concatenate([jitter, away, again]), np.zeros(121, dtype=np.int64))
    assert rests.arrived.tolist() == [40]
    assert rests.turned.tolist() == [60]
    assert set(rests.of[:40].tolist()) == {-1}
    assert set(rests.of[40:].tolist()) == {0}
    assert np.flatnonzero(rests.leaving).tolist() == list(range(40, 60))


def test_a_fresh_sheet_has_no_rest_before_it_is_touched():
    place = np.tile(np.concatenate([np.linspace(-0.02, 0.02, 30), np.linspace(0.02, -0.02, 30)]), 2)
    rests = find_rests(place, np.repeat([0, 1], 60))
    assert len(rests.arrived) == 2
    assert rests.of[60] == -1


def test_places_of_rest_are_integrated_out_as_the_dense_gaussian_says(motion):
    """Small spreads, so that torque is straight in the place; then the marginal is exact."""
    rng = np.random.default_rng(22)
    spread = Spread(1e-3, 5e-4, 1e-9, 1.0, 1.0, -0.2, 1e-3)
    expected = Expected(motion, law(), spread)
    torque = expected.mean + 1e-3 * rng.standard_normal(len(expected.mean))
    blocks = make_blocks(motion.runs)
    z, log_sd = normal_terms(torque, expected, blocks)
    slow, fast = expected.variances
    n = len(torque)
    assert len(expected.resting.place) > 0
    helmert = np.stack([contrasts(row, blocks) for row in np.eye(n)], axis=1)
    assert np.allclose(helmert @ helmert.T, np.eye(n))
    alone = _by_block(fast, blocks)
    shared = _by_block(slow, blocks)
    variance = np.where(blocks.place == 0, alone + blocks.length * shared, alone)
    resting = expected.resting
    columns = []
    for k, sd in enumerate(resting.sd):
        step = np.zeros(len(resting.place))
        step[k] = 1e-3 * sd
        ahead, behind = (
            expected.mean_with(resting.place + step),
            expected.mean_with(resting.place - step),
        )
        columns.append(helmert @ (ahead - behind) / 2e-3)
    covariance = np.diag(variance) + sum(np.outer(column, column) for column in columns)
    residual = helmert @ (torque - expected.mean)
    _, logdet = np.linalg.slogdet(covariance)
    exact = -0.5 * residual @ np.linalg.solve(covariance, residual) - 0.5 * logdet
    assert np.sum(-0.5 * z**2 - log_sd) == pytest.approx(exact, abs=0.02)


def _by_block(values, blocks):
    return np.array(
        [
            values[f : f + m].mean()
            for f, m in zip(blocks.first.tolist(), blocks.length.tolist(), strict=True)
        ]
    )


def test_a_saw_tooth_is_kept_whole_by_short_bins_and_lost_to_long_ones():
    kept = kept_of_a_saw_tooth(0.005)
    assert kept[0] == pytest.approx(1.0, abs=0.02)
    assert np.all(np.diff(kept) < 1e-9)
    assert kept[100] < 0.1


@pytest.fixture(scope="module")
def drafted(friction):
    rng = np.random.default_rng(23)
    cuts = cut_recording(RIPPLED, rng, sheets=1)
    edge = EdgeBelief(EDGE, ("offset_m", "taper_rad"), np.diag([5e-5, 1e-3]) ** 2)
    wanted = recipe(fracture="smooth", critic=False)
    fit = fit_cut((cuts,), wanted, friction, effort="draft", rng=rng, edge=edge)
    return cuts, wanted, edge, fit


def test_an_edge_that_is_believed_stands_among_the_draws(drafted):
    _, _, edge, fit = drafted
    for name, sd in zip(edge.names, np.sqrt(np.diag(edge.covariance)), strict=True):
        parameter = fit.parameter(f"edge_{name}")
        assert 0.0 < parameter.sd < 1.1 * sd
    verdicts = {v.check: v for v in fit.verdicts}
    assert "edge" not in verdicts["identifiability"].why
    assert verdicts["null-directions"].status == "pass"


def test_a_cut_can_be_simulated_from_its_design(drafted, friction):
    """Mean over simulations is the mean expected; pickling changes nothing."""
    cuts, wanted, edge, fit = drafted
    design = pickle.loads(pickle.dumps(cut_experiment((cuts,), wanted, friction, fit, edge)))
    assert design.layout.names[: len(design.material.names)] == design.material.names
    u = np.array(design.begin)
    rng = np.random.default_rng(24)
    drawn = np.stack([design.simulate(u, rng) for _ in range(200)])
    sd = drawn.std(axis=0)
    far = np.abs(drawn.mean(axis=0) - design.mean(u)) > 5.0 * sd / np.sqrt(200) + 1e-5
    assert np.mean(far) < 0.02
    rung = design.rung(drawn[0])
    assert rung.starts.shape == (1, len(design.layout.names))
    assert np.isfinite(rung.problem(design.series).log_posterior(u))


@pytest.mark.slow
def test_strokes_that_end_at_the_highest_force_leave_no_bias(friction):
    """Four standard deviations; taken at their mean place, rests drew the exponent 5-15 % down."""
    rng = np.random.default_rng(25)
    cuts = loaded_cut_recording(RIPPLED, rng, sheets=3)
    wanted = recipe(fracture="rippled", critic=False)
    fit = fit_cut((cuts,), wanted, friction, effort="draft", rng=rng)
    for name, value in (
        ("response_force", RIPPLED.force),
        ("response_exponent", RIPPLED.exponent),
        ("fracture_energy", RIPPLED.fracture_energy),
        ("kappa", RIPPLED.kappa),
    ):
        parameter = fit.parameter(name)
        assert abs(parameter.mean - value) < 4 * parameter.sd, name
    assert fit.parameter("response_exponent").sd < 0.1
