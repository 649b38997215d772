"""The schemas in data_schemas/ agree with the code, and with what they describe."""

import json
import tomllib
from pathlib import Path

import jsonschema
import pytest

from scissorcal.recipe import recipe_names, recipe_path, schemas_dir
from scissorcal.workday.schemas import SOURCES, fallen_behind, generate, main, write


def test_no_schema_has_fallen_behind() -> None:
    assert fallen_behind() == []


def test_what_has_fallen_behind_is_named_and_mended(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("scissorcal.workday.schemas.schemas_dir", lambda: tmp_path)
    assert {path.name for path in write()} == set(SOURCES)
    assert main(["--check"]) == 0
    (tmp_path / "recipe.schema.json").write_text("{}")
    assert main(["--check"]) == 1
    assert "recipe.schema.json has fallen behind" in capsys.readouterr().err
    assert main(["--write"]) == 0
    assert main(["--check"]) == 0
    assert main([]) == 2


@pytest.mark.parametrize("name", SOURCES)
def test_schemas_are_schemas(name: str) -> None:
    jsonschema.Draft202012Validator.check_schema(json.loads(generate(name)))


@pytest.mark.parametrize("name", recipe_names())
def test_recipes_follow_their_schema(name: str) -> None:
    schema = json.loads((schemas_dir() / "recipe.schema.json").read_text(encoding="utf-8"))
    document = tomllib.loads(recipe_path(name).read_text(encoding="utf-8"))
    jsonschema.validate(document, schema)
    document["rig"]["colour"] = "red"
    with pytest.raises(jsonschema.ValidationError, match="colour"):
        jsonschema.validate(document, schema)
