"""The manifest's schema, and that what is written agrees with it."""

import json
import zipfile

import jsonschema
import pytest

from scissorcal.package import PackageSummary, manifest_schema_text
from scissorcal.recipe.library import schemas_dir

SCHEMA = "manifest.schema.json"


def test_the_schema_on_disk_is_the_schema_of_the_code() -> None:
    assert (schemas_dir() / SCHEMA).read_text(encoding="utf-8") == manifest_schema_text()


@pytest.mark.parametrize("which", ["paper", "pad"])
def test_what_is_written_agrees_with_the_schema(which: str, request: pytest.FixtureRequest) -> None:
    summary: PackageSummary = request.getfixturevalue(which)
    with zipfile.ZipFile(summary.path) as archive:
        facts = json.loads(archive.read("manifest.json"))
    schema = json.loads(manifest_schema_text())
    jsonschema.Draft202012Validator.check_schema(schema)
    jsonschema.Draft202012Validator(schema).validate(facts)
    with pytest.raises(jsonschema.ValidationError):
        jsonschema.Draft202012Validator(schema).validate(facts | {"surprise": 1})


def test_units_are_given_for_what_a_package_has(paper: PackageSummary, pad: PackageSummary) -> None:
    assert paper.manifest.units["fracture_energy"] == "J/m"
    assert "fracture_energy" not in pad.manifest.units
    assert pad.manifest.units["torque"] == "N m"
