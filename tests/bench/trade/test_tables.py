"""Tables as a knob: settings, costs and errors against the exact model."""

import pickle
import shutil
from dataclasses import replace

import numpy as np
import pytest

from scissorcal.bench.trade import models
from scissorcal.bench.trade.knobs.tables import INSTRUCTIONS, TOLERANCES, Tables, _beyond
from scissorcal.bench.trade.models import BYTES, STEP, central, tables_of
from scissorcal.bench.trade.point import Setting
from scissorcal.bench.trade.torque import AVERAGE, WORST
from scissorcal.errors import MissingError, ScissorcalError
from scissorcal.package import TOLERANCE, compile_model, cost_and_error, table_bytes
from scissorcal.package.stated_bound import stated_bound
from tests.bench.trade.cases import case, linear, pressing


def chosen(tolerance: float, number_format: str = "float32") -> Setting:
    """The setting of a tolerance and a format."""
    value = {"number_format": number_format, "tolerance": tolerance}
    return next(one for one in Tables().settings(case()) if one.value == value)


def test_settings_go_from_coarse_to_fine_in_each_format_and_mark_the_present_one():
    one = case()
    settings = Tables().settings(one)
    assert len({setting.label for setting in settings}) == 2 + sum(map(len, TOLERANCES.values()))
    for form, tolerances in TOLERANCES.items():
        own = [s.value["tolerance"] for s in settings if s.method == form]
        assert own == sorted(tolerances, reverse=True)
    assert labels_present(simplified(one)) == ["float32, smallest that fit"]
    finer = replace(one, table_tolerance=3e-4, number_format="int16")
    assert labels_present(finer) == ["int16, tolerance 0.03 %"]
    assert labels_present(one) == [f"float32, tolerance {100.0 * TOLERANCE:g} %"]
    searched = Tables().applied(one, settings[0])
    assert labels_present(searched) == ["int16, smallest that fit"]


def simplified(one):
    """The case of a scene that asks for no more than it needs."""
    scene = one.recipe.scene.model_copy(update={"simplify": True})
    return replace(one, recipe=one.recipe.model_copy(update={"scene": scene}))


def labels_present(one):
    """Labels of the settings that are marked as present."""
    return [setting.label for setting in Tables().settings(one) if setting.present]


@pytest.mark.slow
def test_the_smallest_tables_that_fit_take_fewer_bytes_than_those_of_the_fixed_tolerance():
    one, model = case(), central(case())
    found = {
        s.label: tables_of(Tables().applied(one, s), model) for s in Tables().settings(one)[:2]
    }
    fixed = tables_of(replace(one, table_tolerance=TOLERANCE), model)
    for tables in found.values():
        assert table_bytes(tables) < table_bytes(fixed)


def test_a_setting_is_applied_to_the_package_but_float64_is_not():
    one = case()
    coarse = Tables().applied(one, chosen(1e-2, "int16"))
    assert (coarse.table_tolerance, coarse.number_format) == (1e-2, "int16")
    assert Tables().applied(one, chosen(1e-2, "float64")) is one


def test_the_error_falls_as_the_fourth_power_of_the_knots():
    """A smooth law in cubic tables: 16 times the tolerance takes half the knots."""
    one = pressing(opening_deg=(10.0, 40.0))
    model = central(one)
    made = [
        compile_model(model, one.recipe, tolerance=tolerance, number_format="float64")
        for tolerance in (1e-2, 1e-2 / 16.0**2)
    ]
    coarse, fine = (found.arrays["tables/response.npy"].shape[1] for found in made)
    assert 3.0 < (fine - 1) / (coarse - 1) < 5.5


def test_finer_tables_take_more_bytes_and_err_less():
    one = case()
    model, rng = central(one), np.random.default_rng(0)
    float32 = [compile_model(model, one.recipe, tolerance=t) for t in (1e-1, 1e-3, 1e-5)]
    found = [
        cost_and_error(model, one.recipe, tables, rng, repeats=1, count_instructions=False)
        for tables in float32
    ]
    worst = [each.grid.worst_Nm for each in found]
    sizes = [each.cost.bytes for each in found]
    assert worst[0] > 10.0 * worst[1] > 100.0 * worst[2]
    assert sizes == sorted(sizes)


def test_a_measurement_has_costs_and_errors_and_says_what_was_not_measured(monkeypatch):
    monkeypatch.setattr(models, "cost_and_error", _without_counting)
    one, knob = case(kappa=0.75), pickle.loads(pickle.dumps(Tables()))
    sample = knob.measure(one, chosen(1e-3), 0)
    assert {BYTES, STEP, "knots"} <= set(sample.costs)
    assert sample.costs[BYTES].value == 12.0 * sample.costs["knots"].value
    assert INSTRUCTIONS not in sample.costs
    assert any("not measured" in note for note in sample.notes)
    errors = knob.errors(one, sample, None)
    assert 0.0 < errors[AVERAGE].share < errors[WORST].share < 1e-2


def test_tables_that_a_build_would_refuse_fail_a_check():
    one = case(kappa=0.75)
    model = central(one)
    beyond = {
        tolerance: _beyond(
            stated_bound(model, compile_model(model, one.recipe, tolerance=tolerance), one.recipe)
        )
        for tolerance in (0.2, 1e-4)
    }
    assert beyond == {0.2: True, 1e-4: False}


def test_what_cannot_be_measured_is_a_named_failure(monkeypatch):
    monkeypatch.setattr(shutil, "which", lambda tool: None)
    with pytest.raises(MissingError, match="float64, tolerance 1 %: not measured: cc not found"):
        Tables().measure(case(), chosen(1e-2, "float64"), 0)

    def fails(*_: object, **__: object) -> None:
        raise RuntimeError("cc failed with 1")

    monkeypatch.setattr(models, "cost_and_error", fails)
    one = case()
    with pytest.raises(ScissorcalError, match="cc failed with 1"):
        Tables().measure(one, chosen(1e-2), 0)
    model = central(one)
    made = compile_model(model, one.recipe)
    with pytest.raises(ScissorcalError, match="could not be measured: cc failed with 1"):
        models.package_costs(one, model, made, np.random.default_rng(0))


def test_nothing_rendered_has_no_tables():
    assert "linear joint" in Tables().missing(linear())
    assert Tables().missing(case()) == ""


@pytest.mark.slow
@pytest.mark.skipif(shutil.which("qemu-system-arm") is None, reason="qemu-system-arm not found")
@pytest.mark.skipif(shutil.which("arm-none-eabi-gcc") is None, reason="no compiler for Cortex-M")
def test_instructions_are_counted_where_the_tools_are():
    sample = Tables().measure(case(kappa=0.75), chosen(1e-3), 0)
    assert 500 < sample.costs[INSTRUCTIONS].value < 10_000


def _without_counting(*arguments, **keywords):
    return cost_and_error(*arguments, **{**keywords, "count_instructions": False})
