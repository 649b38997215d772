"""The manifest's schema, and that what is written agrees with it."""

import json
import zipfile

import jsonschema
import pytest

from scissorcal.package import PackageSummary, manifest_schema_text
from scissorcal.package.manifest import Manifest
from scissorcal.recipe import schemas_dir

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


def test_pieces_with_an_estimated_pose_are_no_package(paper: PackageSummary) -> None:
    with zipfile.ZipFile(paper.path) as archive:
        content = json.loads(archive.read("manifest.json"))
    strip = {"end_m": 0.05, "fracture_energy_J_per_m": 0.4}
    piece = {"begin_m": 0.0, "upper_face_m": 5e-5, "scale": 1.0, "strips": [strip]}
    content["pieces"] = [piece]
    assert Manifest.model_validate_json(json.dumps(content)).pieces
    content["plate_pose"] = "estimated"
    with pytest.raises(ValueError, match="estimated pose"):
        Manifest.model_validate_json(json.dumps(content))
