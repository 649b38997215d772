"""The spline response: what neither family can follow, found and told from them."""

import tomllib

import numpy as np
import pytest

from scissorcal.calibration import cut_experiment, cutting_from, fit_cut
from scissorcal.calibration.cut_ladder import allowed_laws
from scissorcal.calibration.storage import load_fit, save_fit
from scissorcal.recipe.schema import Recipe
from tests.calibration.test_cut import RECIPES, friction_of
from tests.calibration.truth import TwoSlopes, press_recording

KNEED = TwoSlopes(
    fracture_energy=1e9, upper_face=1e-3, force=2.0, exponent=1.0, reference=5e-4, knee=5e-4
)


def pressing(**cut) -> Recipe:
    facts = tomllib.loads((RECIPES / "press-only.toml").read_text(encoding="utf-8"))
    facts["fit"]["cut"].update(reference_indentation_mm=0.5, critic=False, **cut)
    return Recipe.model_validate(facts)


@pytest.fixture(scope="module")
def friction():
    return friction_of(KNEED, np.random.default_rng(40))


def test_a_recipe_says_whether_the_spline_is_in_the_ladder():
    families = {
        named: [law.response for law in allowed_laws(pressing(response=named))]
        for named in ("auto", "spline", "auto+spline")
    }
    assert families["auto"] == ["power", "exponential"]
    assert families["spline"] == ["spline"]
    assert families["auto+spline"] == ["power", "exponential", "spline"]


def test_a_spline_keeps_its_knots_where_the_data_are(friction, tmp_path):
    """Data press 1.2 mm deep; what a file gives back is the same design."""
    rng = np.random.default_rng(42)
    pressed = press_recording(KNEED, rng, presses=3)
    wanted = pressing(response="spline")
    fit = fit_cut((pressed,), wanted, friction, effort="draft", rng=rng)
    knots = fit.structure["response_knots_m"]
    assert knots[-1] == pytest.approx(1.2e-3, rel=0.1)
    assert knots[0] == pytest.approx(knots[-1] / 8.0, rel=1e-3)
    save_fit(fit, tmp_path / "cut.nc")
    design = cut_experiment((pressed,), wanted, friction, load_fit(tmp_path / "cut.nc"))
    assert design.structure["response_knots_m"] == knots
    assert [name for name in design.layout.names if "shape" in name] == [
        f"response_shape_{index}" for index in (1, 2, 3)
    ]
    assert fit.diagnostics["residual_rms"] < 2.5 * KNEED.noise


@pytest.mark.slow
def test_two_slopes_are_told_from_a_power_law_and_an_exponential(friction):
    """On strokes that a rung has not seen the spline's error is the noise, the others' is not."""
    rng = np.random.default_rng(41)
    pressed = press_recording(KNEED, rng)
    fit = fit_cut((pressed,), pressing(response="auto+spline"), friction, effort="draft", rng=rng)
    assert fit.structure["response"] == "spline"
    rms = {rung["key"]["response"]: rung["held_out_rms"] for rung in fit.rungs}
    assert 2.0 * rms["spline"] < min(rms["power"], rms["exponential"])
    assert rms["spline"] < 2.5 * KNEED.noise
    assert [rung["equivalent"] for rung in fit.rungs] == [False, False, True]
    drawn = cutting_from(
        fit.structure, {p.name: fit.draws[:, [i]] for i, p in enumerate(fit.parameters)}
    )
    depth = np.array([3e-4, 5e-4, 8e-4, 1.1e-3])
    true = np.array([KNEED.response(d) for d in depth])
    assert np.median(drawn.response.force_at(depth), axis=0) == pytest.approx(true, rel=0.07)
