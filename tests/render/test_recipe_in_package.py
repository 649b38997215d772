"""The recipe in a package: what `package check` opens, a rendering can read."""

import json
from pathlib import Path
from typing import Any

import pytest

from scissorcal.errors import InputError
from scissorcal.identity import bytes_digest
from scissorcal.package import ModelPackage, canonical, check_package, open_package
from scissorcal.render.admission import admit_package
from tests.package.test_archive import forge
from tests.render.test_engine import rig


def with_recipe(package: ModelPackage, path: Path, text: str) -> Path:
    """A copy with another recipe, both hashes right again."""

    def change(facts: Any, _: Any) -> None:
        facts["provenance"]["recipe"] = text
        facts["provenance"]["recipe_sha256"] = bytes_digest(text.encode())

    path.write_bytes(Path(package.source).read_bytes())
    forge(path, change)
    return path


@pytest.mark.parametrize(
    "text",
    ["", "{}", "[]", "null", "x", "[" * 100_000, '{"rig":' * 20_000, '{"rig":{"edge":NaN}}'],
)
def test_a_text_that_is_no_recipe_is_refused(
    paper: ModelPackage, tmp_path: Path, text: str
) -> None:
    path = with_recipe(paper, tmp_path / "a.zip", text)
    with pytest.raises(InputError, match=r"a\.zip: provenance\.recipe is not a recipe") as raised:
        check_package(path)
    assert len(str(raised.value)) < 600


@pytest.mark.parametrize("damping", ["x", "4", None, True, -1.0, 1e300, [], {}])
def test_a_damping_that_no_recipe_may_have_is_refused(
    paper: ModelPackage, tmp_path: Path, damping: Any
) -> None:
    facts = json.loads(paper.manifest.provenance.recipe)
    facts["rig"]["hand_damping_N_s_per_m"] = damping
    path = with_recipe(paper, tmp_path / "a.zip", canonical(facts).decode())
    with pytest.raises(InputError, match=r"rig\.hand_damping_N_s_per_m"):
        check_package(path)


@pytest.mark.parametrize(
    ("section", "key", "value"),
    [
        ("scene", "tolerance_percent", 70.0),
        ("scene", "confidence_percent", 60.0),
        ("scene", "loop_rate_Hz", 500.0),
        ("scene", "plate_pose", "estimated"),
        ("limits", "torque_Nm", 0.5),
        ("rig", "handle_radius_mm", 20.0),
    ],
)
def test_a_recipe_that_contradicts_the_manifest_is_refused(
    paper: ModelPackage, tmp_path: Path, section: str, key: str, value: Any
) -> None:
    facts = json.loads(paper.manifest.provenance.recipe)
    assert facts[section][key] != value
    facts[section][key] = value
    path = with_recipe(paper, tmp_path / "a.zip", canonical(facts).decode())
    with pytest.raises(InputError, match="the recipe and parameters in the package give"):
        open_package(path)


def test_a_recipe_with_another_hash_is_refused(paper: ModelPackage, tmp_path: Path) -> None:
    path = tmp_path / "a.zip"
    path.write_bytes(Path(paper.source).read_bytes())
    forge(path, lambda facts, _: facts["provenance"].update(recipe_sha256="0" * 64))
    with pytest.raises(InputError, match=r"does not have the hash in provenance\.recipe_sha256"):
        open_package(path)


def test_admission_takes_the_hand_that_the_recipe_states(paper: ModelPackage) -> None:
    asked = paper.recipe.rig
    found = admit_package(paper, rig().identity, None, 1.0)
    radius_m = asked.handle_radius_mm * 1e-3
    wanted = asked.hand_damping_N_s_per_m * radius_m**2 / 2
    assert found.hand_damping_Nm_s_per_rad == pytest.approx(wanted)
