"""What the report says of the physics, against laws that are known in closed form."""

from dataclasses import replace

import numpy as np
import pytest

from scissorcal.calibration import (
    EdgePlace,
    FitResult,
    force_along_edge,
    fracture_work,
    friction_curve,
    friction_map,
    response_curve,
)
from scissorcal.errors import MissingError
from scissorcal.package.scene_torque import scene_torque
from scissorcal.recording import Stroke
from scissorcal.report.document import fit_panels
from scissorcal.report.inputs import Evidence
from scissorcal.report.strokes import strokes_of
from scissorcal.report.subjects.cut import edge_sentence
from scissorcal.report.subjects.scene import scene_sentence
from scissorcal.verdicts import Verdict
from tests.calibration.truth import Truth, make_recording, sweep
from tests.report.conftest import paper
from tests.report.fits import cut_fit, friction_fit, linear_fit, without_numbers
from tests.report.laws import known_cut, known_friction, strokes_along_edge


def edge_of(fit: FitResult) -> tuple[EdgePlace, ...]:
    return force_along_edge(fit, [stroke.places for stroke in strokes_of(fit, "cut", [])])


def swept(ratio: np.ndarray, seed: int, strokes: int = 9) -> FitResult:
    rng = np.random.default_rng(seed)
    return strokes_along_edge(known_cut(Truth()), ratio, strokes, rng)


def test_a_blunt_place_is_found_where_it_is() -> None:
    station = np.linspace(0.016, 0.064, 240)
    blunt = (station > 0.036) & (station < 0.044)
    found = edge_of(swept(np.where(blunt, 1.25, 1.0), seed=1))
    odd = [place for place in found if place.differs]
    assert odd
    for place in odd:
        assert place.station_high > 0.036
        assert place.station_low < 0.044
    whole = [p for p in odd if p.station_low >= 0.036 and p.station_high <= 0.044]
    assert whole
    for place in whole:
        assert place.low is not None
        assert place.high is not None
        assert place.low < 1.25 < place.high
    assert "more force than the model says" in edge_sentence(found)
    assert "blunt spot" in edge_sentence(found)


def test_an_even_edge_is_seldom_blamed() -> None:
    blamed = sum(
        any(place.differs for place in edge_of(swept(np.ones(120), seed))) for seed in range(60)
    )
    assert blamed <= 9  # 5 % of 60 expected for all places together; 9 has a chance of 0.4 %


def test_two_strokes_say_nothing_with_certainty() -> None:
    found = edge_of(swept(np.ones(120), seed=2, strokes=2))
    assert all(place.low is None and not place.differs for place in found)
    assert "record more strokes" in edge_sentence(found)


def test_the_work_of_a_stroke_is_the_toughness_times_its_cut() -> None:
    truth, rng = Truth(), np.random.default_rng(11)
    opening, advance, strokes = [], [], []
    for place, speed in ((-0.018, 0.25), (0.016, 0.6)):
        for start, end, kind, rate in (
            (0.85, 0.22, "closing", speed),
            (0.22, 0.85, "opening", 1.0),
        ):
            strokes.append(Stroke(len(strokes), kind, rate, 0))
            opening.append(sweep(start, end, rate))
            advance.append(place)
    recording = make_recording("cut", opening, advance, strokes, truth, rng, True)
    fit = _with_strokes(known_cut(truth, recording), len(strokes))
    rows = fracture_work(fit, known_friction(truth), [recording], [0, 2])
    assert [row.stroke for row in rows] == [0, 2]
    for row in rows:
        assert row.length > 0.03
        assert row.fracture / row.length == pytest.approx(truth.fracture_energy, rel=0.02)
        assert row.expected / row.length == pytest.approx(truth.fracture_energy, rel=0.01)
        assert not row.pivot_moved
        assert row.total == pytest.approx(row.fracture + row.stored)


def test_the_work_says_why_it_is_missing() -> None:
    truth = Truth()
    cut = known_cut(truth)
    with pytest.raises(MissingError, match="made without"):
        fracture_work(cut, known_friction(truth), [], ())
    with pytest.raises(MissingError, match="fits of friction"):
        fracture_work(cut, None, [], ())
    keep = [i for i, p in enumerate(cut.parameters) if p.name != "fracture_energy"]
    pressing = replace(
        cut,
        parameters=tuple(cut.parameters[i] for i in keep),
        draws=cut.draws[:, keep],
        map_point=cut.map_point[keep],
        structure={**cut.structure, "fracture": "none"},
    )
    with pytest.raises(MissingError, match="Nothing is cut"):
        fracture_work(pressing, known_friction(truth), [], ())


def test_torque_over_the_scene_is_the_law_with_its_band() -> None:
    """A thin sheet, stiff response: tau = J_c h |dx_c / dtheta|, whatever the response is."""
    truth = Truth(force=200.0, upper_face=5e-5)
    recipe = paper()
    scene = recipe.scene.model_copy(update={"render_friction": False})
    recipe = recipe.model_copy(update={"scene": scene})
    fit = swept_like(truth)
    section = scene_torque(recipe, fit, None)
    cut = next(s for s in section.slices if s.along == "opening").places
    opening, torque, low, high = cut.opening, cut.torque, cut.low, cut.high
    reached = np.array([_contact(truth, theta) for theta in opening])
    settled = reached > cut.contact + 5e-4
    step = 1e-5
    slope = np.array(
        [(_contact(truth, t + step) - _contact(truth, t - step)) / (2 * step) for t in opening]
    )
    expected = truth.fracture_energy * np.abs(slope)
    assert np.sum(settled) > 10
    assert np.allclose(torque[settled], expected[settled], rtol=0.02)
    half = 0.5 * (high - low)[settled] / torque[settled]
    assert np.allclose(half, 1.96 * 0.01, rtol=0.4)
    assert section.within_tolerance == 1.0
    assert "within the tolerance of 7.0 %" in scene_sentence(section)
    assert section.not_in_band == ()
    assert "not measured" not in scene_sentence(section)
    wide = Verdict("fit.cut", "edge shape", "not_evaluated", 0.21, 0.07, "Photograph it.")
    small = Verdict("fit.cut", "torque zero", "pass", 0.01, 0.07, "Small.")
    elsewhere = Verdict("fit.cut", "recordings", "not_evaluated", 0.3, 0.2, "They differ.")
    measured = {"not_measured": [{"name": "edge shape"}, {"name": "torque zero"}]}
    open_fit = replace(
        fit,
        verdicts=(*fit.verdicts, wide, small, elsewhere),
        diagnostics={**fit.diagnostics, **measured},
    )
    doubted = scene_torque(recipe, open_fit, None)
    assert doubted.not_in_band == (("edge shape", 0.21),)
    said = "not measured, as shares of the mean torque: edge shape up to 21"
    assert said in scene_sentence(doubted)


def swept_like(truth: Truth) -> FitResult:
    """A fit whose samples lie where the crack stands, at openings below 0.5 rad only."""
    rng = np.random.default_rng(3)
    fit = strokes_along_edge(known_cut(truth), np.ones(150), 3, rng)
    opening = np.tile(np.linspace(0.5, 0.22, 150), 3)
    contact = np.array([_contact(truth, theta) for theta in opening])
    series = replace(fit.series, opening=opening, contact=contact)
    return replace(fit, series=series)


def test_support_ends_where_data_end() -> None:
    fit = swept_like(Truth())
    recipe = paper()
    scene = recipe.scene.model_copy(update={"render_friction": False, "contact_mm": (15.0, 60.0)})
    section = scene_torque(recipe.model_copy(update={"scene": scene}), fit, None)
    grid = section.grid
    opening, rates = np.unique(grid.opening), np.unique(grid.opening_rate)
    shape = (len(opening), len(rates), len(np.unique(grid.contact)))
    supported = grid.supported.reshape(shape)
    touching = grid.touching.reshape(shape)
    near = np.abs(np.log(-rates[rates < 0] / 0.25)) < np.log(2.0)
    closing = np.flatnonzero(rates < 0)[near]
    inside, outside = opening < 0.5, opening > 0.6
    lowest = supported[:, closing, 0]
    assert lowest[inside].all()
    assert not (lowest & touching[:, closing, 0])[outside].any()
    assert not (supported & touching)[:, rates > 0].any()


def test_a_scene_without_a_model_says_how_to_have_one() -> None:
    recipe = paper()
    with pytest.raises(MissingError, match="scissorcal capture cut"):
        scene_torque(recipe, None, friction_fit())
    with pytest.raises(MissingError, match="scissorcal fit friction"):
        scene_torque(recipe, known_cut(Truth()), None)
    lost = [without_numbers(fit) for fit in (known_cut(Truth()), known_friction(Truth()))]
    with pytest.raises(MissingError, match="no usable numbers"):
        scene_torque(recipe, *lost)


def test_the_response_is_the_law_with_other_candidates_beside_it() -> None:
    truth = Truth()
    fit = swept_like(truth)
    values = {"response_force": 0.6, "response_exponent": 2.0, "fracture_energy": 0.5}
    candidates = (
        {"name": "power, smooth", "chosen": True, "equivalent": True},
        {
            "name": "exponential, smooth",
            "equivalent": True,
            "key": {"response": "exponential"},
            "values": values,
        },
        {"name": "spline, smooth", "equivalent": True},
    )
    curve = response_curve(replace(fit, candidates=candidates))
    x = curve.indentation
    expected = np.array([truth.response(delta) for delta in x])
    assert np.allclose(curve.force, expected, rtol=0.02, atol=1e-6)
    drawn, kept_no_values = curve.others
    grown = 0.6 * np.expm1(2.0 * x / truth.reference) / np.expm1(2.0)
    assert drawn.force is not None
    assert np.allclose(drawn.force, grown, rtol=1e-4)
    assert (kept_no_values.name, kept_no_values.force) == ("spline, smooth", None)
    assert x[-1] == pytest.approx(1.25 * curve.support_high, rel=1e-4)
    with pytest.raises(MissingError, match="no usable numbers"):
        response_curve(without_numbers(fit))


def test_the_friction_map_is_the_law() -> None:
    truth = Truth()
    fit = known_friction(truth)
    found = friction_map(fit)
    assert found is not None
    rate = found.rate[:, None]
    level = np.where(rate > 0, truth.coulomb_pos, truth.coulomb_neg) + truth.viscous * abs(rate)
    assert np.allclose(found.friction, level, rtol=0.01)
    assert np.all(found.sd < 0.02 * level)
    assert friction_map(known_cut(truth)) is None
    assert friction_map(linear_fit()) is not None


def test_the_friction_curve_is_the_law_with_its_band() -> None:
    fit = friction_fit()
    curve = friction_curve(fit)
    assert curve is not None
    named = {p.name: p.mean for p in fit.parameters}
    level = named["coulomb"] + named["viscous"] * np.abs(curve.rate)
    level += named["stribeck"] * np.exp(-((curve.rate / named["stribeck_rate"]) ** 2))
    assert np.allclose(curve.friction, np.sign(curve.rate) * level, rtol=0.05)
    assert np.all(curve.low < curve.high)
    assert friction_curve(cut_fit()) is None
    assert friction_curve(without_numbers(fit)) is None


def test_a_cut_without_its_model_still_has_its_panels() -> None:
    lost = without_numbers(known_cut(Truth()))
    panels = {p.id: p for p in fit_panels(lost, (), "cut", Evidence(), None)}
    assert "Only a fit of the cut" in panels["cut-edge"].notes[0]
    assert "no usable numbers" in panels["cut-response"].notes[0]


def _contact(truth: Truth, opening: float) -> float:
    """Where the crack stands, by bisection: J_c h = 2 g tan(psi)."""
    low, high = 1e-3, 0.2
    for _ in range(60):
        middle = 0.5 * (low + high)
        if truth.cut(opening, middle)[1] > truth.fracture_energy:
            low = middle
        else:
            high = middle
    return low


def _with_strokes(fit: FitResult, count: int) -> FitResult:
    """The fit with one sample of each stroke, enough to name them."""
    series = fit.series
    some = np.linspace(0, len(series.stroke) - 1, count).astype(int)
    held = {name: getattr(series, name)[some] for name in series.__dataclass_fields__}
    held["stroke"] = np.arange(count)
    held["opening_rate"] = np.where(np.arange(count) % 2 == 0, -0.3, 0.3)
    return replace(fit, series=replace(series, **held), held_out=())
