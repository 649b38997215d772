"""Manifests that call a fit's candidate ``rung``."""

from scissorcal.package.manifest import FitRecord


def test_a_package_with_the_old_name_of_a_fits_candidate_is_read() -> None:
    parameter = {"name": "coulomb", "unit": "N m", "value": 0.005, "mean": 0.005, "sd": 1e-4}
    facts = {
        "rung": "coulomb, symmetric",
        "effort": "draft",
        "inputs_hash": "",
        "sources": (),
        "parameters": ({**parameter, "q05": 0.0048, "q50": 0.005, "q95": 0.0052},),
        "warnings": (),
    }
    assert FitRecord.model_validate(facts).candidate == "coulomb, symmetric"
    assert "rung" not in FitRecord.model_validate(facts).model_dump()
