"""Candidates as knobs: recipes of one candidate, their costs, and errors against the richest."""

import pickle
from dataclasses import replace

import numpy as np
import pytest

from scissorcal.bench.trade.assemble import curve_of
from scissorcal.bench.trade.candidate_fit import as_fitted, needed_minutes
from scissorcal.bench.trade.fits import PROCESSOR
from scissorcal.bench.trade.knob import make_knob
from scissorcal.bench.trade.knobs.candidates import (
    HOLDOUT,
    RIPPLE_WORST,
    Closure,
    Damping,
    Edge,
    Fracture,
    Friction,
    Response,
    candidate_sample,
    projected,
)
from scissorcal.bench.trade.models import (
    BYTES,
    STEP,
    central_law,
    fitted_model,
    held_law,
    model_of_law,
)
from scissorcal.bench.trade.recommend import choices_of
from scissorcal.bench.trade.torque import AVERAGE, WORST
from scissorcal.package import fitted_candidate
from tests.bench.trade.cases import case, linear, pressing
from tests.package.fits import cut_fit, friction_fit, recipe

CUT_KNOBS = (Response, Damping, Fracture, Friction, Closure)


def sampled(one, cut=None, friction=None, seconds=1.0):
    """A sample of fits, as a refit would give it."""
    cut, friction = cut or one.cut_fit, friction or one.friction_fit
    return candidate_sample(one, central_law(one, cut, friction), seconds, fits=[cut])


def test_the_recipe_of_a_refit_compares_nothing():
    one = case(kappa=0.75, damping=2.0)
    fixed = as_fitted(one).fit
    assert (fixed.cut.response, fixed.cut.fracture, fixed.cut.rate_damping) == (
        "power",
        "rippled",
        "fit",
    )
    assert fixed.cut.load_share == "none"
    assert (fixed.friction.law, fixed.friction.symmetry) == ("stribeck+angle", "asymmetric")


@pytest.mark.parametrize("kind", CUT_KNOBS)
def test_one_candidate_is_present_and_the_fitted_one_is_the_reference(kind):
    one, knob = case(kappa=0.75), pickle.loads(pickle.dumps(kind()))
    settings = knob.settings(one)
    assert sum(setting.present for setting in settings) == 1
    best = max(settings, key=lambda one: one.accuracy)
    assert best.value == knob.supported(one)
    assert {setting.accuracy for setting in settings[settings.index(best) + 1 :]} <= {0}
    (present,) = (setting for setting in settings if setting.present)
    assert knob.recipe(as_fitted(one), present.value) == as_fitted(one)
    for setting in settings:
        changed = knob.applied(one, setting).recipe
        assert knob.recipe(changed, setting.value) == changed
    assert knob.missing(one) == ""
    assert "linear joint" in knob.missing(linear())


def record(label, **failed):
    """A measurement of a candidate, all of equal torque."""
    sample = sampled(case(kappa=0.75))
    return {
        "knob": "response",
        "label": label,
        "repeat": 0,
        "baseline_s": 0.02,
        "costs": {name: [cost.value, cost.unit] for name, cost in sample.costs.items()},
        "outcome": sample.outcome,
        "notes": [],
        "rejected": [],
        **failed,
    }


def test_without_the_candidate_that_the_data_support_none_is_recommended():
    one = case(response="spline", shape=(1.0, 1.2, 1.3))
    knob = Response()
    assert knob.supported(one) == "spline"
    simple = [record("power"), record("exponential")]
    found = curve_of(one, knob, simple, 0.01)
    assert found.against == (
        "exponential, in place of the candidate that the data support (spline was not measured)"
    )
    assert found.sentences[0] == (
        "No setting is recommended, since spline was not measured: errors are to be counted "
        "against the candidate that the data support."
    )
    assert choices_of([found]) == ()
    found = curve_of(one, knob, [*simple, record("spline", failed="It broke.")], 0.01)
    assert "since spline gave no result" in found.sentences[0]
    found = curve_of(one, knob, [*simple, record("spline")], 0.01)
    assert found.against == "the candidate that the data support (spline)"
    assert choices_of([found])


def test_a_scene_without_a_choice_says_why():
    assert "scene.cut = false" in Fracture().missing(pressing())
    assert "scene.render_friction = false" in Friction().missing(pressing())
    assert "simplest candidate" in Edge().missing(case())


def test_no_friction_is_fitted_but_not_rendered():
    chosen = Friction().recipe(as_fitted(case()), "none")
    assert chosen.fit.friction.law == "coulomb"
    assert not chosen.scene.render_friction


def test_a_candidate_has_no_error_against_itself_and_a_closed_form_against_another():
    """Coulomb levels 10 % higher: torque is off by a tenth of the level times the factor."""
    one = case(kappa=0.75)
    law = friction_fit(law="coulomb", symmetric=True)
    louder = friction_fit(law="coulomb", symmetric=True, coulomb=0.0132)
    known, other = sampled(one, friction=law), sampled(one, friction=louder)
    errors = Friction().errors(one, known, known)
    assert errors[AVERAGE].value == errors[WORST].value == errors[RIPPLE_WORST].value == 0.0
    assert HOLDOUT not in errors
    errors = Friction().errors(one, other, known)
    assert errors[AVERAGE].value == pytest.approx(0.0012, rel=1e-6)
    assert errors[WORST].value == pytest.approx(0.0012, rel=1e-6)
    assert errors[RIPPLE_WORST].value == 0.0
    assert Friction().errors(one, other, None) == {}


def test_a_smooth_crack_leaves_the_whole_ripple_out():
    one = case(kappa=0.5)
    smooth = cut_fit(one.recipe, energy=0.375)
    errors = Fracture().errors(one, sampled(one, cut=smooth), sampled(one))
    steeper = case(kappa=0.9)
    less = Fracture().errors(steeper, sampled(steeper, cut=smooth), sampled(steeper))
    assert errors[RIPPLE_WORST].share > 3.0 * less[RIPPLE_WORST].share > 0.0


def test_what_a_package_holds_is_present_and_what_the_fits_have_is_the_reference():
    one = case(kappa=0.75)
    scene = one.recipe.scene.model_copy(update={"simplify": True, "tolerance_percent": 30.0})
    one = replace(one, recipe=one.recipe.model_copy(update={"scene": scene}))
    law = held_law(one, one.cut_fit, one.friction_fit)
    one = replace(one, held=law)
    settings = Friction().settings(one)
    (present,) = (setting.value for setting in settings if setting.present)
    assert present == fitted_candidate(law, "friction").name != Friction().fitted(one)
    assert settings[-1].value == Friction().fitted(one) == "stribeck+angle"


def test_more_terms_take_more_bytes():
    one = case(kappa=0.75)
    laws = ("coulomb", "coulomb+viscous", "stribeck")
    found = [sampled(one, friction=friction_fit(law=law)) for law in laws]
    sizes = [sample.costs[BYTES].value for sample in found]
    assert sizes == sorted(sizes)
    assert sizes[0] < sizes[-1]
    assert {PROCESSOR, STEP} <= set(found[0].costs)


def test_minutes_grow_with_the_speeds_that_a_law_needs():
    one = case()
    minutes = [needed_minutes(one, speeds, 1) for speeds in (1, 2, 4)]
    assert minutes == sorted(minutes)
    assert minutes[0] > 0.0
    assert needed_minutes(replace(one, friction=()), 1, 1) is None
    assert needed_minutes(one, 99, 99) == pytest.approx(needed_minutes(one, 5, 3))


def bent(curvature: float):
    """A case whose fit has an arc for its edge."""
    one = case()
    edge = {**one.cut_fit.structure["edge"], "family": "arc", "curvature_per_m": curvature}
    structure = {**one.cut_fit.structure, "edge": edge}
    return replace(one, cut_fit=replace(one.cut_fit, structure=structure))


def test_an_edge_is_projected_onto_simpler_families():
    one, knob = bent(0.3), Edge()
    assert [(s.label, s.present) for s in knob.settings(one)] == [("line", False), ("arc", True)]
    line, arc = (knob.measure(one, setting, 0) for setting in knob.settings(one))
    own = fitted_model(one)
    assert model_of_law(projected(one, "arc")).cutting.edge == own.cutting.edge
    assert knob.errors(one, arc, arc)[WORST].value == 0.0
    errors = knob.errors(one, line, arc)
    flatter = bent(0.03)
    less = knob.errors(flatter, *(knob.measure(flatter, s, 0) for s in knob.settings(flatter)))
    assert errors[AVERAGE].value > 5.0 * less[AVERAGE].value > 0.0
    assert line.costs[BYTES].value <= arc.costs[BYTES].value


@pytest.mark.slow
def test_candidates_are_fitted_to_the_recordings_of_a_virtual_rig():
    """Real fits of a short capture: the present candidate repeats itself, none is left out."""
    from scissorcal.calibration import fit_cut, fit_friction
    from tests.bench.trade.captured import captured

    one = captured("paper-80gsm")
    rng = np.random.default_rng(5)
    friction = fit_friction(one.friction, one.recipe.fit.friction, effort="draft", rng=rng)
    cut = fit_cut(one.cut, one.recipe, friction, effort="draft", rng=rng)
    one = replace(one, friction_fit=friction, cut_fit=cut)
    knob = make_knob("closure")
    samples = {s.label: knob.measure(one, s, 0) for s in knob.settings(one)}
    errors = knob.errors(one, samples["eq4"], samples["work"])
    assert 0.0 < errors[WORST].share < 1e-2
    assert errors[HOLDOUT].value > 0.0
    assert samples["work"].costs["capture"].value > 0.0
    again = knob.measure(one, knob.settings(one)[1], 0)
    assert again.outcome == samples["work"].outcome
    assert recipe("paper-80gsm").scene.closure == "work"
