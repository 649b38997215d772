"""The cut's likelihood in C against a twin in NumPy, and what its parameters must do."""

import json
import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import minimize_scalar

from scissorcal.kernel import cut_log_likelihood, cut_log_likelihoods
from tests.calibration.cut.golden import PATH, golden
from tests.calibration.cut.made_segments import made_data, made_parameters, responses
from tests.calibration.cut.twin import Table, beliefs, cycle, log_likelihood

FAMILIES = ("power", "exponential", "spline")
FRACTURES = ("none", "smooth", "rippled")


def far_apart(core, twin) -> dict[str, float]:
    """Largest differences, relative to the largest value of each array."""
    total, terms, residuals, scaled, places, period = core
    pairs = {
        "total": (total, twin.total),
        "terms": (terms, twin.terms),
        "residuals": (residuals, twin.residuals),
        "standardised": (scaled, twin.standardised),
        "places": (places, twin.places),
        "log period": (period, twin.log_period),
    }
    return {
        name: float(np.max(np.abs(np.asarray(a) - b)) / max(np.max(np.abs(b)), 1e-12))
        for name, (a, b) in pairs.items()
    }


@pytest.mark.parametrize("fracture", FRACTURES)
@pytest.mark.parametrize("family", FAMILIES)
@pytest.mark.parametrize("edge_count", [0, 2])
@pytest.mark.parametrize("plain", [True, False])
def test_the_core_agrees_with_the_twin(family, fracture, edge_count, plain):
    """To 1e-9, the core's interpolation of cycles over the edge's slope included in the twin."""
    data = made_data(edge_count, edge_count)
    given = made_parameters(responses()[family], fracture, edge_count=edge_count, plain=plain)
    found = far_apart(cut_log_likelihood(data, given), log_likelihood(data, given))
    assert max(found.values()) < 1e-9, found


@pytest.mark.parametrize("seed", range(5))
def test_a_near_edge_that_is_not_quite_known_is_integrated_out_too(seed):
    data = made_data(seed, known_sd=2e-5)
    given = made_parameters(responses()["power"], "rippled")
    core = cut_log_likelihood(data, given)
    found = far_apart(core, log_likelihood(data, given))
    assert max(found.values()) < 1e-9, found
    assert core[4][0] != 0.0


@pytest.mark.parametrize("family", FAMILIES)
def test_cycles_may_be_interpolated_over_the_slope(family):
    """Slopes from 0.15 to 0.45, far more than a stroke has; a spline's exponent has kinks."""
    data = made_data(3)
    given = made_parameters(responses()[family], "rippled")
    exact = log_likelihood(data, given, exact_cycles=True)
    found = far_apart(cut_log_likelihood(data, given), exact)
    limit = 1e-4 if family == "spline" else 1e-5
    assert found["residuals"] < limit, found
    assert found["log period"] < limit, found


def test_a_tougher_sheet_leaves_the_line_where_it_is():
    """At a given torque: the teeth are longer by the torque's ratio to the power 1 / n."""
    given = made_parameters(responses()["power"], "rippled")
    for tougher in (0.98, 1.02):
        for data in (made_data(9), replace(made_data(9), line_log_torque=-4.0)):
            moved = replace(given, energy=tougher * given.energy)
            base, there = (cut_log_likelihood(data, p)[5] for p in (given, moved))
            longer = math.log(tougher) / responses()["power"].exponent
            assert abs(there - base) < 0.05 * abs(longer)


def test_the_lines_period_is_that_of_the_expected_torque():
    """What the line adds to the period's logarithm is nothing where the torques agree."""
    data, given = made_data(9), made_parameters(responses()["power"], "rippled", plain=True)
    expected = data.run_torque - cut_log_likelihood(data, given)[2][len(data.torque) :]
    at = replace(data, line_log_torque=float(data.line_weight @ np.log(expected)))
    twice = replace(at, line_log_torque=at.line_log_torque + math.log(2.0))
    exponent = responses()["power"].exponent
    here, longer = (cut_log_likelihood(one, given)[5] for one in (at, twice))
    assert here == pytest.approx(_mean_log_period(at, given), rel=1e-3)
    assert longer - here == pytest.approx(math.log(2.0) / exponent, rel=1e-9)


def test_places_of_rests_are_where_the_density_is_highest():
    """By a search that shares no step with the core: one rest moved, the others held."""
    data, given = made_data(4), made_parameters(responses()["power"], "rippled")
    places = cut_log_likelihood(data, given)[4]

    def density(rest: int, place: float) -> float:
        """Least squares of one rest, from a density whose rests are all known at their places."""
        here = places.copy()
        here[rest] = place
        moved = _by_segment(data, here - data.rest_place)
        known = replace(
            data,
            rest_known=np.ones(3, dtype=np.int32),
            rest_place=np.zeros(3),
            depth=data.depth + data.depth_dx * np.repeat(moved, 2),
            lever=data.lever + data.lever_dx * moved,
        )
        return cut_log_likelihood(known, given)[0]

    for rest in (1, 2):
        centre, spread = _belief(data, given, rest)
        best = minimize_scalar(
            lambda x, rest=rest, centre=centre, spread=spread: (
                0.5 * ((x - centre) / spread) ** 2 - density(rest, x)
            ),
            bracket=(places[rest] - 2e-5, places[rest] + 2e-5),
            tol=1e-12,
        )
        assert best.x == pytest.approx(places[rest], abs=0.02 * spread)


def test_a_batch_of_points_equals_single_evaluations():
    data = made_data(8)
    base = made_parameters(responses()["spline"], "rippled")
    kappas, forces = np.array([0.6, 0.7, 0.8]), np.array([-0.1, 0.0, 0.1])
    tables = base.log_force + forces[:, None]
    many = replace(
        base, kappa=kappas, log_force=tables, log_energy=base.log_energy + forces[:, None]
    )
    totals, periods = cut_log_likelihoods(data, many, 3)
    for index in range(3):
        one = replace(
            base,
            kappa=float(kappas[index]),
            log_force=tables[index],
            log_energy=base.log_energy + forces[index],
        )
        alone = cut_log_likelihood(data, one)
        assert (totals[index], periods[index]) == (alone[0], alone[5])


def test_invalid_numbers_give_no_likelihood():
    data, given = made_data(5), made_parameters(responses()["power"], "rippled")
    assert cut_log_likelihood(data, replace(given, energy=math.nan))[0] == -math.inf
    broken = replace(data, run_torque=np.full_like(data.run_torque, math.nan))
    assert cut_log_likelihood(broken, given)[0] == -math.inf


def test_parameters_change_the_likelihood_in_the_right_direction():
    """Load adds to closing and takes from opening; a delay lowers by what the data say it does."""
    data = made_data(6)
    given = made_parameters(responses()["power"], "smooth", plain=True)
    base, loaded, late = (
        cut_log_likelihood(replace(data, rest_known=np.ones(3, dtype=np.int32)), p)[2]
        for p in (given, replace(given, load=0.1), replace(given, delay=1.0))
    )
    count = len(data.torque)
    held = data.torque - base[:count]
    change = base - loaded
    assert change[:count] == pytest.approx(-0.1 * data.direction * held)
    mean = data.run_torque - base[count:]
    assert change[count:] == pytest.approx(-0.1 * data.run_direction * mean)
    every_late = np.concatenate([data.late, data.run_late])
    assert base - late == pytest.approx(every_late, abs=1e-13)


def test_no_sheet_and_no_rest_are_allowed():
    """A press has no running crack; a day of fresh sheets that never opened has no rest."""
    data = made_data(7)
    empty = {
        name: getattr(data, name)[:0]
        for name in vars(data)
        if name.startswith("run_") or name in ("joined", "start_noise", "end_noise", "line_weight")
    }
    pressed = replace(data, **{**empty, "run_first": np.zeros(1, dtype=np.int32)})
    given = made_parameters(responses()["power"], "rippled")
    found = far_apart(cut_log_likelihood(pressed, given), log_likelihood(pressed, given))
    assert max(found.values()) < 1e-9


def _by_segment(data, by_rest):
    return np.repeat(by_rest[data.piece_rest], np.diff(data.piece_first))


def _belief(data, given, rest):
    centre, spread = beliefs(data, given, Table(given))
    return centre[rest], spread[rest]


def test_the_golden_vectors_are_the_twins():
    """What tests/c compares the core with; ``python -m tests.calibration.cut.golden`` writes it."""
    stored = json.loads(PATH.read_text(encoding="utf-8"))
    for held, made in zip(stored["cases"], golden()["cases"], strict=True):
        assert held["title"] == made["title"]
        for name in ("terms", "residuals", "standardised", "places"):
            assert held[name] == pytest.approx(made[name], rel=1e-9, abs=1e-12)


def _mean_log_period(data, given):
    """Of one cycle at every segment's own slope and lever, in a loop."""
    table, found = Table(given), 0.0
    for k, weight in enumerate(data.line_weight):
        start, stop, _ = cycle(given, table, data.moving_blades, data.run_slope[k])
        away = 0.5 * (start + stop) - data.reference_depth
        slope = data.run_slope[k] + data.run_slope_dd[k] * away
        lever = data.run_lever[k] + data.run_lever_dd[k] * away
        power = table.log_force(float(np.log(start)))[1]
        turn = 0.5 * (start + stop) * (1.0 + slope**2) / (power * slope)
        found += weight * math.log(data.moving_blades * (start - stop) / (lever - turn))
    return found
