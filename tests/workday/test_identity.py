"""Identities of stored results do not change with the names of settings."""

import json
from pathlib import Path

from scissorcal.identity import digest
from scissorcal.recipe import as_first_named, builtin_recipe
from scissorcal.workday.engine import Engine
from scissorcal.workday.runs.design import FORMAT, _inputs_of
from scissorcal.workday.steps import BY_NAME
from scissorcal.workday.workspace import create_workspace


def test_stored_fits_stay_current() -> None:
    """The identity of settings is that of the version that called the key ``rung``."""
    settings = BY_NAME["fit friction"].settings(builtin_recipe("paper-80gsm"))
    assert digest(as_first_named(settings)) == (
        "434e6cdb2461d0db3e90fa43482ef7afc4a1fe39e11d832c3f11b203e87681a1"
    )


def test_a_stored_design_stays_current(tmp_path: Path) -> None:
    engine = Engine.of(create_workspace(tmp_path / "paper", "paper-80gsm"))
    dump = engine.recipe.model_dump_json()
    assert dump.count('"law":') == 2
    facts = {
        "format": FORMAT,
        "recipe": json.loads(dump.replace('"law":', '"rung":')),
        "fits": {"friction": "", "cut": ""},
    }
    assert _inputs_of(engine) == digest(facts)
