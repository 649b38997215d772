"""A package against 50 digits: its states, what counts as right, and the panels of a run."""

from dataclasses import replace

import numpy as np
import pytest

from scissorcal.bench.extremes import compare
from scissorcal.bench.extremes.compare import (
    PARALLEL_KERNEL,
    Judgement,
    compare_kernel,
    compare_model,
    compare_package,
    strokes,
    table_friction,
)
from scissorcal.bench.extremes.exact_laws import NotComparedError
from scissorcal.bench.extremes.states import QUANTITIES, State, blade_of_law, package_states
from scissorcal.kernel import Kernel
from scissorcal.model import Edge, Response
from scissorcal.package import open_package
from scissorcal.report import WRONG_LOOK, extremes_panels, map_chart, refusals_panel
from tests.package.conftest import pad as pad
from tests.package.conftest import paper as paper


@pytest.fixture(scope="module")
def packages(paper, pad):
    """Paper that ripples, with friction, and a pad that is only pressed."""
    return [open_package(summary.path, warn=False) for summary in (paper, pad)]


def scene_states(package, count: int) -> list[State]:
    states = package_states(package, 0.02 * count, 20261128)
    return [state for state in states if state.band == "scene"][:count]


def test_states_are_the_same_for_the_same_seed_and_reach_from_the_scene_to_the_absurd(packages):
    package = packages[0]
    first, again, other = (package_states(package, 0.05, seed) for seed in (1, 1, 2))
    assert first == again != other
    assert {state.swept for state in first if len(state.swept) == 1} == {(n,) for n in QUANTITIES}
    for state in first:
        covered = package.covers(state.opening, state.rate, state.contact)
        assert covered or state.band == "beyond"
    assert max(abs(state.rate) for state in first) == 1e3
    assert max(state.contact for state in first) > package.exact.cutting.edge.length_m


@pytest.mark.parametrize("which", [0, 1])
def test_a_package_is_right_in_its_scene_and_never_wrong_beyond(packages, which):
    package = packages[which]
    chosen = np.random.default_rng(7).permutation(package_states(package, 0.05, 7))[:15]
    for state in [*scene_states(package, 4), *chosen]:
        answers = (
            compare_model(state),
            compare_kernel(state, package.tables),
            compare_package(state, package),
        )
        for answer in answers:
            assert answer.outcome != "wrong", (answer, state)
            if state.band == "scene":
                assert answer.outcome == "right", (answer, state)


def test_friction_of_the_tables_is_that_of_the_kernel(packages):
    tables = packages[0].tables
    kernel = Kernel(replace(tables, fracture_energy=0.0))
    for opening, rate in ((0.4, -0.5), (0.4, 0.5), (0.7, 0.001), (0.7, 5.0), (0.5, 0.0)):
        opening, rate = (float(np.float32(value)) for value in (opening, rate))
        out = kernel.step(opening, rate, 10.0)
        exact = float(table_friction(tables, opening, rate))
        assert out.friction_torque == pytest.approx(exact, rel=1e-5, abs=1e-12)
    assert float(table_friction(packages[1].tables, 0.4, 0.5)) == 0.0


def test_an_edge_off_by_more_than_the_bound_is_wrong_in_the_scene_alone(packages):
    package = packages[0]
    state = scene_states(package, 1)[0]
    assert compare_package(state, package).outcome == "right"
    edge = package.arrays["tables/edge.npy"].copy()
    edge[1] += 2e-3
    arrays = {**package.arrays, "tables/edge.npy": edge}
    assert compare_package(state, replace(package, arrays=arrays)).outcome == "wrong"
    outside = replace(state, contact=0.9 * package.manifest.ranges.contact_m[0])
    answer = compare_package(outside, package)
    assert answer.outcome == "flagged"
    assert "outside what the package covers" in answer.sentence


def test_an_error_of_friction_in_a_step_is_found(packages, monkeypatch):
    state = scene_states(packages[0], 1)[0]
    step = compare.Kernel.step
    monkeypatch.setattr(
        compare.Kernel,
        "step",
        lambda *a: (o := step(*a))._replace(torque=o.torque - 2.0 * o.friction_torque),
    )
    assert compare_kernel(state, packages[0].tables).outcome == "wrong"


def test_a_response_that_is_a_spline_is_not_compared(packages):
    state = scene_states(packages[0], 1)[0]
    spline = Response("spline", 2.0, 1.5, 3e-4, shape=(), knots_m=(1e-5, 1e-3))
    bent = replace(state, cutting=replace(state.cutting, response=spline))
    answer = compare_model(bent)
    assert (answer.outcome, "spline" in answer.sentence) == ("not compared", True)
    with pytest.raises(NotComparedError):
        blade_of_law(bent.cutting, PARALLEL_KERNEL)


@pytest.mark.parametrize(
    "changes",
    [
        {"family": "cubic", "curvature_per_m": 0.5, "bend_per_m2": 8.0},
        {"family": "spline", "spline_m": (0.0, 1e-4, -1e-4, 2e-4, 0.0, 1e-4)},
        {"family": "spline", "spline_m": (0.0, 1e-4, -1e-4, 2e-4), "spline_start_m": 0.01},
    ],
)
def test_bent_edges_are_right(packages, changes):
    state = scene_states(packages[0], 1)[0]
    edge = Edge(offset_m=-0.008, taper_rad=0.03, length_m=0.075, **changes)
    bent = replace(state, cutting=replace(state.cutting, edge=edge))
    assert compare_model(bent).outcome == "right"


def test_energy_is_balanced_over_long_strokes(packages, monkeypatch):
    for package in packages:
        ranges = package.manifest.ranges
        place = ranges.opening_rad, ranges.contact_m[0]
        assert strokes(package.tables, *place).outcome == "right"
    true = Kernel.step_many

    def leaks(*inputs):
        out = true(*inputs)
        out["torque"] *= 1.05
        return out

    monkeypatch.setattr(Kernel, "step_many", leaks)
    assert strokes(packages[1].tables, *place).outcome == "wrong"


def test_strokes_that_touch_nothing_are_no_success(packages):
    tables = replace(packages[1].tables, upper_face=-1.0)
    assert strokes(tables, (0.3, 0.8), 0.02).outcome == "wrong"


def made(packages, outcomes) -> list:
    base = scene_states(packages[0], 1)[0]
    return [
        (
            replace(base, swept=("contact",), values={"contact": value}),
            [Judgement("model", outcome, "Why.", 1e-9, 1e-12)],
        )
        for value, outcome in outcomes
    ]


def test_a_wrong_answer_fails_the_run_and_stands_first_with_its_numbers(packages):
    tried = made(packages, [(0.01, "right"), (0.02, "refused"), (0.03, "wrong")])
    run = Judgement("strokes", "right", "energy balance: error 0, stated 1")
    totals, _, refusals, *_ = extremes_panels(tried, run)
    (verdict,) = totals.verdicts
    assert (verdict.status, verdict.value) == ("fail", 1.0)
    assert "Of 4 answers 2 are right" in totals.sentence
    assert [row.marked for row in refusals.rows] == [True, False]
    assert refusals.rows[0].note == "Why. (contact 0.03)"
    assert str(refusals.rows[1].value("where it begins")) == "contact 0.02 to 0.02"
    plain = [(replace(state, swept=()), answer) for state, answer in tried]
    first = extremes_panels(plain, run)[2].rows[0]
    assert str(first.value("where it begins")) == "within the scene"
    good = extremes_panels(made(packages, [(0.01, "right")]), run)
    assert good[0].verdicts[0].status == "pass"


def test_a_map_marks_refused_and_wrong_states_apart(packages):
    base, pair = scene_states(packages[0], 1)[0], ("opening", "contact")
    answers = [
        (
            replace(base, swept=pair, values={"opening": 1.0, "contact": place}),
            Judgement("kernel", outcome, "", 1e-6),
        )
        for place, outcome in ((1.0, "refused"), (2.0, "wrong"), (3.0, "right"))
    ]
    drawn = {series.name: series for series in map_chart(answers).series}
    assert (drawn["refused"].y, drawn["wrong"].y) == ((0.0,), (1.0,))
    assert drawn["wrong"].look == WRONG_LOOK != drawn["refused"].look
    assert drawn["log10 of the relative error"].value == pytest.approx((-6.0,))
    assert refusals_panel(answers).rows[0].marked
