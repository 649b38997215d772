"""A blade's edge from its points: comparison, intervals, nicks, several photographs, the file."""

from dataclasses import replace

import numpy as np
import pytest

from scissorcal.calibration.edge import fit as edge_fit
from scissorcal.calibration.edge.cells import EdgeCells, cells_each, edge_cells, merged_nicks
from scissorcal.calibration.edge.fit import (
    Blade,
    compare_edges,
    fit_blade,
)
from scissorcal.calibration.edge.model import (
    MOST_EVALUATIONS,
    SEARCH_EVALUATIONS,
    CellData,
    EdgeEvidence,
    basis_of,
)
from scissorcal.calibration.edge.result import BladeResult, FoundNick
from scissorcal.errors import InputError
from scissorcal.inference import SamplingStatus
from scissorcal.recipe import load_recipe, recipe_path
from scissorcal.vision import BladeMeasurement, BladeParts, BorderPoints

LENGTH = 0.075


def shape(family, s):
    e = -0.008 + 0.035 * s
    if family in ("arc", "cubic"):
        e = e - 0.5 * 0.9 * s**2
    if family == "cubic":
        e = e + 40.0 * s**3 / 6.0
    if family == "spline":
        e = e + 1e-4 * np.sin(2 * np.pi * s / 0.03)
    return e


def cells(family, rng, *, noise=2e-6, moved=4e-6, count=80, shared=None, photo="a.jpg"):
    """One photograph's edge as the renderer never made it: known curve, known errors."""
    s = np.linspace(0.12, 0.97, count) * LENGTH
    own = np.stack([np.ones_like(s), s / LENGTH], axis=1) * moved
    tone = np.full((count, 1), moved)
    draw = rng.standard_normal(1) if shared is None else shared
    offset = shape(family, s) + own @ rng.standard_normal(2) + tone @ draw
    offset = offset + noise * rng.standard_normal(count)
    names = ("pivot", "centreline", "tone")
    modes = np.concatenate([own, tone], axis=1)
    return EdgeCells(photo, s, offset, np.full(count, noise), modes, names, (), 0.0)


def measurement(rng, nicks=(), *, metric=True, source="a.jpg"):
    s = np.linspace(0.12, 0.97, 400) * LENGTH
    e = shape("line", s) + 4e-6 * rng.standard_normal(400)
    for place, width, depth in nicks:
        e = e + depth * np.maximum(1 - ((s - place) / (0.5 * width)) ** 2, 0.0)
    unit = 1.0 if metric else 4000.0
    parts = BladeParts(
        np.zeros(2), np.array([1.0, 0.0]), np.array([0.0, -1.0]), *(np.zeros((0, 2)),) * 3, LENGTH
    )
    border = BorderPoints(np.zeros((1, 2)), np.zeros((1, 2)), np.ones(1), np.ones(1), 0.8, 1.0)
    return BladeMeasurement(
        source,
        s * unit,
        e * unit,
        np.full(400, 4e-6 * unit),
        np.ones(400),
        np.full((400, 1), 5e-6 * unit),
        ("tone",),
        LENGTH * unit,
        0.003 * unit,
        parts,
        border,
        border,
        metric,
        "As made.",
        np.zeros(2),
        np.ones(2),
    )


@pytest.mark.parametrize("family", ["line", "arc", "cubic", "spline"])
def test_the_family_is_found_and_the_edge_within_its_intervals(family):
    rng = np.random.default_rng(3)
    compared = compare_edges(CellData((cells(family, rng),), LENGTH), "draft", rng)
    best = compared.best
    order = ["line", "arc", "cubic", "spline"]
    assert order.index(best.family) >= order.index(family)
    assert (best.family == "spline") == (family == "spline")
    s = np.linspace(0.15, 0.95, 9) * LENGTH
    draws = compared.edge_posterior.with_values(compared.draws).offset_at(s)
    z = (draws.mean(axis=0) - shape(family, s)) / draws.std(axis=0)
    assert np.abs(z).max() < 3.5
    # the posterior is what the draws are
    np.testing.assert_allclose(
        compared.edge_posterior.edge.offset_at(s), draws.mean(axis=0), atol=1e-8
    )


def test_simpler_families_that_the_evidence_rejects_are_not_chosen():
    rng = np.random.default_rng(4)
    compared = compare_edges(CellData((cells("arc", rng),), LENGTH), "draft", rng, ("line", "arc"))
    assert compared.best.family == "arc"
    assert compared.rows[1].evidence > compared.rows[0].evidence + 20.0


@pytest.mark.parametrize("family", ["cubic", "spline"])
def test_the_evidence_has_the_gradient_that_differences_have(family):
    rng = np.random.default_rng(15)
    data = CellData((cells("arc", rng, count=30), cells("arc", rng, count=30)), LENGTH)
    evidence = EdgeEvidence(data, basis_of(data, family))
    u = evidence.middle + 0.3 * evidence.sd * rng.standard_normal(len(evidence.sd))
    value, slope = evidence.with_gradient(u)
    assert value == pytest.approx(evidence.problem().log_posterior(u), rel=1e-9)
    step = 1e-3 * np.eye(len(u))
    numeric = [
        (evidence.with_gradient(u + h)[0] - evidence.with_gradient(u - h)[0]) / 2e-3 for h in step
    ]
    np.testing.assert_allclose(slope, numeric, rtol=1e-3, atol=1e-3)


def test_photographs_of_two_blades_end_within_a_stated_number_of_evaluations():
    """Their disagreement, a tenth of the length, once lay on a bound and led to ensembles."""
    rng = np.random.default_rng(16)
    one, other = (cells("arc", rng, noise=4e-5, count=80, photo=f"{k}.jpg") for k in range(2))
    other = replace(other, offset=other.offset + 0.004 + 0.05 * other.station)
    compared = compare_edges(CellData((one, other), LENGTH), "standard", rng)
    assert compared.status.trusted
    assert compared.evaluations < 4 * (2 * SEARCH_EVALUATIONS + 12) + MOST_EVALUATIONS["standard"]
    # in fact a twelfth of that
    assert compared.evaluations < 2500
    assert compared.best.between_m > 5e-4


def test_draws_that_cannot_be_trusted_fail_a_verdict(monkeypatch):
    rng = np.random.default_rng(17)
    real = edge_fit.compare_edges

    def heavy(*arguments, **named):
        return replace(real(*arguments, **named), status=SamplingStatus.HEAVY_WEIGHTS)

    monkeypatch.setattr(edge_fit, "compare_edges", heavy)
    fit = fit_blade([measurement(rng)], None, effort="draft", rng=rng)
    verdict = next(v for v in fit.verdicts if v.check == "sizes of the errors")
    assert verdict.status == "fail"
    assert "--effort thorough" in verdict.why


def test_progress_goes_from_nothing_to_all_of_it():
    rng = np.random.default_rng(18)
    told = []
    fit_blade(
        [measurement(rng)],
        None,
        effort="draft",
        rng=rng,
        progress=lambda done, sentence: told.append((done, sentence)),
    )
    shares = [done for done, _ in told]
    assert shares == sorted(shares)
    assert shares[0] == 0.0
    assert shares[-1] == 1.0
    assert all(sentence for _, sentence in told)


@pytest.mark.slow
def test_intervals_hold_what_they_say_over_many_blades():
    """90 % intervals of e(s) and alpha(s) in 120 fits: binomial 90 +- 8 points at 3 sd."""
    held = []
    for seed in range(120):
        rng = np.random.default_rng([9, seed])
        compared = compare_edges(
            CellData((cells("arc", rng),), LENGTH), "draft", rng, ("arc", "cubic")
        )
        edges = compared.edge_posterior.with_values(compared.draws)
        s = 0.6 * LENGTH
        low, high = np.quantile(edges.offset_at(s), [0.05, 0.95])
        slopes = np.quantile(edges.slope_at(s), [0.05, 0.95])
        held.append((low < shape("arc", s) < high, slopes[0] < 0.035 - 0.9 * s < slopes[1]))
    share = np.mean(held, axis=0)
    assert np.all(share > 0.82)
    assert np.all(share < 0.985)


def test_several_photographs_share_what_is_shared_and_average_what_is_not():
    def sd_of(count):
        rng = np.random.default_rng(5)
        shared = rng.standard_normal(1)
        every = tuple(
            cells("line", rng, moved=8e-6, count=30, shared=shared, photo=f"{k}.jpg")
            for k in range(count)
        )
        compared = compare_edges(CellData(every, LENGTH), "draft", rng, ("line",))
        draws = compared.edge_posterior.with_values(compared.draws)
        return float(draws.offset_at(0.5 * LENGTH).std())

    one, four = sd_of(1), sd_of(4)
    assert four < 0.85 * one
    # the tone is common to all: it never averages out
    assert four > 7e-6


def test_a_nick_is_found_and_left_out_a_burr_is_only_left_out():
    nicks = ((0.03, 1.5e-3, 4e-4), (0.055, 1.2e-3, -3e-4))
    found = edge_cells(measurement(np.random.default_rng(6), nicks), 60)
    assert len(found.nicks) == 1
    assert found.nicks[0].station_m == pytest.approx(0.03, abs=3e-4)
    assert found.nicks[0].depth_m == pytest.approx(4e-4, abs=4e-5)
    assert found.nicks[0].width_m == pytest.approx(1.5e-3, abs=4e-4)
    assert 0.005 < found.spoilt < 0.06
    off = found.offset - shape("line", found.station)
    assert np.abs(off).max() < 15e-6


def test_a_soft_bite_is_glare_and_no_nick():
    one = measurement(np.random.default_rng(7), ((0.03, 3e-3, 3e-4),))
    soft = np.where(np.abs(one.station - 0.03) < 2e-3, 2.3, 1.0)
    assert edge_cells(replace(one, softness=soft), 60).nicks == ()


def test_nicks_of_several_photographs_are_one_row_each():
    rows = [
        replace(
            cells("line", np.random.default_rng(8)),
            nicks=(FoundNick(0.03 + shift, 1e-3, 4e-4, f"{k}.jpg"),),
        )
        for k, shift in enumerate((0.0, 2e-4, 2e-2))
    ]
    merged = merged_nicks(rows)
    assert [round(1e3 * nick.station_m, 2) for nick in merged] == [30.1, 50.0]
    assert merged[0].source == "0.jpg, 1.jpg"


@pytest.fixture(scope="module")
def fit():
    rng = np.random.default_rng(10)
    recipe = load_recipe(recipe_path("paper-80gsm"))
    many = [measurement(rng, ((0.03, 1.5e-3, 4e-4),), source=f"{k}.jpg") for k in range(2)]
    return fit_blade(many, recipe, effort="draft", rng=rng)


def test_a_fit_says_where_the_edge_is_over_the_scene(fit):
    assert fit.metric
    assert fit.height is not None
    assert fit.height.mean.shape == (len(fit.opening), len(fit.contact))
    assert np.all(fit.height.q05 < fit.height.q95)
    assert np.abs(fit.offset.mean - shape("line", fit.station)).max() < 2e-5
    assert np.abs(np.tan(fit.taper.mean) - 0.035).max() < 2e-3
    assert len(fit.nicks) == 1
    assert {v.check: v.status for v in fit.verdicts} == {
        "clear edge": "pass",
        "photographs agree": "pass",
        "residual against claimed sd": "pass",
    }


def test_one_photograph_says_nothing_on_agreement():
    rng = np.random.default_rng(11)
    fit = fit_blade([measurement(rng)], None, effort="draft", rng=rng)
    assert fit.verdicts[1].status == "not_evaluated"
    assert fit.height is None


def test_a_photograph_of_another_blade_does_not_agree():
    rng = np.random.default_rng(12)
    many = [measurement(rng, source=f"{k}.jpg") for k in range(4)]
    many[2] = replace(many[2], offset=many[2].offset + 6e-3)
    fit = fit_blade(many, None, effort="draft", rng=rng)
    verdict = next(v for v in fit.verdicts if v.check == "photographs agree")
    assert verdict.status == "fail"
    assert "one blade only" in verdict.why


def test_without_a_scale_the_edge_is_in_blade_lengths_until_a_length_is_given(tmp_path):
    rng = np.random.default_rng(13)
    flat = measurement(rng, metric=False)
    free = fit_blade([flat], None, effort="draft", rng=rng)
    assert not free.metric
    assert free.edge_posterior.edge.length_m == pytest.approx(1.0)
    assert any("--length-mm" in note for note in free.notes)
    with pytest.raises(InputError, match="no scale"):
        _ = BladeResult((free,), (), "x", ()).edge_posterior
    known = fit_blade([flat], None, effort="draft", rng=rng, blade=Blade(length_m=LENGTH))
    assert known.metric
    assert np.abs(known.offset.mean - shape("line", known.station)).max() < 3e-5
    with pytest.raises(InputError, match="with and without a scale"):
        fit_blade([flat, measurement(rng)], None, effort="draft", rng=rng)


def test_a_nick_is_found_without_a_scale_too():
    rng = np.random.default_rng(14)
    nicked = measurement(rng, nicks=((0.04, 4e-4, 2e-4),), metric=False)
    (nick,) = fit_blade([nicked], None, effort="draft", rng=rng).nicks
    assert nick.station_m == pytest.approx(0.04 / LENGTH, abs=2e-3)
    assert nick.depth_m == pytest.approx(2e-4 / LENGTH, rel=0.1)


def test_nothing_to_fit_is_said():
    with pytest.raises(InputError, match="nothing to fit"):
        fit_blade([], None, rng=np.random.default_rng(0))


def test_a_photograph_with_too_few_points_of_the_edge_is_refused_by_name():
    whole = measurement(np.random.default_rng(0))
    for count, words in ((0, "only 0 points"), (9, "only 9 points")):
        rows = slice(0, count)
        few = replace(
            whole,
            station=whole.station[rows],
            offset=whole.offset[rows],
            sd=whole.sd[rows],
            modes=whole.modes[rows],
            softness=whole.softness[rows],
        )
        with pytest.raises(InputError, match=f"^a.jpg: {words} of the blade's edge"):
            edge_cells(few, 40)
    at_one_place = replace(whole, station=np.full_like(whole.station, 0.02))
    with pytest.raises(InputError, match="take it again from nearer"):
        edge_cells(at_one_place, 40)


def test_a_photograph_whose_points_lie_in_few_places_is_refused_by_name():
    whole = measurement(np.random.default_rng(0))
    away = whole.station.copy()
    away[1:-1] = np.linspace(0.0200, 0.0201, len(away) - 2)
    with pytest.raises(InputError, match="stretches without nicks"):
        edge_cells(replace(whole, station=np.sort(away)), 40)


def test_many_photographs_take_fewer_cells_each():
    assert cells_each(1) == 110
    assert cells_each(4) == 40
    assert cells_each(50) == 24
