"""Parameters whose calibration is known to be poor carry that, and only where it holds."""

from dataclasses import replace
from pathlib import Path

import pytest

from scissorcal.calibration import FittedParameter
from scissorcal.calibration.caveats import COLUMN, FEW_COUNTS, caveats_by_parameter, caveats_of
from scissorcal.cli.fit_law import parameter_facts, text
from scissorcal.report import parameters_panel
from scissorcal.workday import FitOutcome, StepState
from tests.package.fits import cut_fit, friction_fit, recipe

UNVERIFIED = StepState("fit cut", "unverified", "")
GOOD = {"counts_per_sample": 8.0, "teeth_line": True}


def fitted(structure=None, **diagnostics):
    fit = cut_fit(recipe(), kappa=0.7)
    return replace(
        fit,
        structure={**fit.structure, **(structure or {})},
        diagnostics={**fit.diagnostics, **GOOD, **diagnostics},
    )


def test_a_fit_of_which_nothing_poor_is_known_has_no_caveat():
    assert caveats_of(fitted()) == ()
    assert caveats_of(friction_fit()) == ()


@pytest.mark.parametrize(
    ("fit", "parameters", "begins"),
    [
        (
            fitted(counts_per_sample=0.5 * FEW_COUNTS),
            ("response_force", "response_exponent", "fracture_energy", "kappa"),
            "0.5 encoder counts per sample",
        ),
        (fitted(teeth_line=False), ("fracture_energy", "kappa"), "No spectral line of the teeth"),
    ],
    ids=["coarse encoder", "no line"],
)
def test_each_kind_of_data_is_told_with_its_parameters(fit, parameters, begins):
    (caveat,) = caveats_of(fit)
    assert caveat.parameters == parameters
    assert caveat.sentence.startswith(begins)
    assert caveat.sentence.count(". ") >= 1 or caveat.sentence.endswith(".")


def test_a_splines_caveat_names_its_deepest_knot():
    shape = FittedParameter("response_shape_1", "1", 0.1, 0.1, 0.0, 0.1, 0.2, 0.5)
    plain = fitted({"response": "spline", "response_knots_m": [1e-4, 4e-4]})
    fit = replace(plain, parameters=(*plain.parameters, shape))
    (caveat,) = caveats_of(fit)
    assert caveat.parameters == ("response_force", "response_exponent", "response_shape_1")
    assert caveat.sentence.startswith("0.4 mm is the deepest")


def test_no_line_is_no_fault_where_nothing_ripples():
    smooth = cut_fit(recipe())
    fit = replace(smooth, diagnostics={**GOOD, "teeth_line": False})
    assert caveats_of(fit) == ()


def test_terminal_json_and_report_carry_it_beside_the_interval():
    fit = fitted(teeth_line=False)
    outcome = FitOutcome("cut", fit, Path("cut.nc"), (), False, UNVERIFIED)
    said = text(outcome)
    sentence = caveats_by_parameter(fit)["kappa"][0]
    assert "kappa *" in said
    assert f"* fracture_energy, kappa: {sentence}" in said
    facts = {row["name"]: row["caveats"] for row in parameter_facts(outcome)}
    for row in parameters_panel(fit, "cut").rows:
        assert row.note == " ".join(f"Known to be poor: {said}" for said in facts[row.name])
    assert facts["kappa"] == [sentence]
    assert facts["response_force"] == []


def test_a_fit_without_its_trust_check_is_unverified():
    outcome = FitOutcome("cut", fitted(), Path("cut.nc"), (), False, UNVERIFIED)
    assert "unverified: 'scissorcal verify cut'" in text(outcome)
    assert "unverified" not in text(replace(outcome, state=StepState("fit cut", "done", "")))


def test_what_one_recording_does_not_show_stands_beside_the_interval():
    fit = fitted()
    outcome = FitOutcome("cut", fit, Path("cut.nc"), (), False, UNVERIFIED)
    assert "One recording does not show how far the next would differ" in text(outcome)
    assert text(outcome).count("not known") == len(fit.parameters) + len(fit.derived)
    assert all(row["next_recording_sd"] is None for row in parameter_facts(outcome))
    panel = parameters_panel(fit, "cut")
    assert "One recording does not show" in panel.sentence
    assert all(str(row.value(COLUMN)) == "not known" for row in panel.rows)


def test_the_size_that_recordings_showed_stands_beside_the_interval():
    sizes = {parameter.name: 0.0123 for parameter in fitted().parameters}
    for key, shown in (
        ("next_recording_sd", " 0.012 "),
        ("next_recording_sd_on_record", "(0.012)"),
    ):
        plain = fitted()
        fit = replace(plain, diagnostics={**plain.diagnostics, key: sizes})
        outcome = FitOutcome("cut", fit, Path("cut.nc"), (), False, UNVERIFIED)
        assert shown in text(outcome)
        assert "One recording does not show" not in text(outcome)
        assert parameter_facts(outcome)[0]["next_recording_sd"] == 0.0123
    assert "earlier fits of several" in text(outcome)


def test_moments_that_follow_a_tail_are_not_printed():
    """The first parameter has an sd of twice its half-width."""
    plain = fitted()
    first, *others = plain.parameters
    wide = replace(first, sd=2.0 * (first.q95 - first.q05))
    fit = replace(plain, parameters=(wide, *others))
    outcome = FitOutcome("cut", fit, Path("cut.nc"), (), False, UNVERIFIED)
    assert first.moments == (first.mean, first.sd)
    assert wide.moments is None
    assert f"{wide.sd:.4g}" not in text(outcome)
    assert f"{wide.q50:.4g} (median)" in text(outcome)
    assert (parameter_facts(outcome)[0]["mean"], parameter_facts(outcome)[0]["sd"]) == (None, None)
    row = parameters_panel(fit, "cut").row(wide.name)
    assert str(row.value("mean")) == "see the median"
    assert wide.words == f"{wide.q50:.2g} ({wide.q05:.2g} to {wide.q95:.2g})"
