"""A package that a key signed: whatever is changed afterwards, no trusted key stands for it."""

import copy
import json
import random
import zipfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from cryptography.hazmat.primitives.asymmetric.ed25519 import Ed25519PrivateKey
from cryptography.hazmat.primitives.serialization import Encoding, NoEncryption, PrivateFormat

from scissorcal.errors import InputError
from scissorcal.identity import bytes_digest
from scissorcal.package import (
    ModelPackage,
    PackageSummary,
    Review,
    check_package,
    open_package,
    put_review,
)
from scissorcal.package.archive import array_bytes, member_of
from scissorcal.package.keys import signer
from scissorcal.package.manifest import canonical, content_hash
from scissorcal.package.review import stated_digest
from scissorcal.package.signature import Sign
from tests.package.test_archive import Members, members, pack

Facts = dict[str, Any]
Forge = Callable[[Facts, Members], None]


@dataclass(frozen=True)
class Signed:
    """A signed package, its parts, the lab's public key, and what else may be put in."""

    path: Path
    facts: Facts
    content: Members
    trusted: tuple[str, ...]
    lab: Sign
    stranger: Sign
    rejection: Review
    other: Review


def key_of(folder: Path, name: str) -> Sign:
    """What signs by a new private key in a file."""
    path = folder / name
    private = Ed25519PrivateKey.generate()
    path.write_bytes(private.private_bytes(Encoding.PEM, PrivateFormat.OpenSSH, NoEncryption()))
    path.chmod(0o600)
    return signer(path)


def review_of(package: ModelPackage, sign: Sign, decision: str, note: str = "") -> Review:
    review = Review.of(
        name="A. Lovelace",
        decision=decision,
        note=note,
        time_utc="2025-01-31T15:02:00Z",
        content={"report/report.json": "0" * 64},
        fit_hashes=package.manifest.fit_hashes,
    )
    return review.model_copy(update={"key": sign(review.signed_text)})


@pytest.fixture(scope="module")
def signed(paper: PackageSummary, tmp_path_factory: pytest.TempPathFactory) -> Signed:
    folder = tmp_path_factory.mktemp("signed")
    lab, stranger = key_of(folder, "lab"), key_of(folder, "stranger")
    package, path = open_package(paper.path), folder / "signed.zip"
    put_review(package, review_of(package, lab, "accept"), path, lab)
    content = members(path)
    return Signed(
        path=path,
        facts=json.loads(content["manifest.json"]),
        content=content,
        trusted=(lab("any").public_key,),
        lab=lab,
        stranger=stranger,
        rejection=review_of(package, lab, "reject"),
        other=review_of(package, lab, "accept", "an earlier report of the same fits"),
    )


def accepted(signed: Signed, path: Path) -> bool:
    """Whether a file passes for signed, by whatever looks at it."""
    try:
        package = open_package(path, warn=False)
    except InputError:
        return False
    return not package.against_review(signed.trusted)


def forged(signed: Signed, path: Path, forge: Forge) -> Path:
    """The package with a change, its content hash right again, review and signature kept."""
    facts, content = copy.deepcopy(signed.facts), dict(signed.content)
    forge(facts, content)
    facts["content_hash"] = content_hash(facts)
    content["manifest.json"] = json.dumps(facts).encode()
    pack(path, content)
    return path


def times(place: str, factor: float) -> Forge:
    """Multiply the number at a place of the manifest."""
    *parents, last = place.split(".")

    def change(facts: Any, _: Members) -> None:
        for key in parents:
            facts = facts[int(key)] if key.isdigit() else facts[key]
        key: Any = int(last) if last.isdigit() else last
        facts[key] *= factor

    return change


def put(place: str, value: Any) -> Forge:
    """Put a value at a place of the manifest."""
    *parents, last = place.split(".")

    def change(facts: Any, _: Members) -> None:
        for key in parents:
            facts = facts[int(key)] if key.isdigit() else facts[key]
        facts[last] = value

    return change


def array(file: str, factor: float) -> Forge:
    """Multiply the values of a table, or all draws, with right hashes."""

    def change(facts: Facts, content: Members) -> None:
        place = next(i for i, one in enumerate(facts["members"]) if one["file"] == file)
        data, dtype = content[file], facts["members"][place]["dtype"]
        shape = facts["members"][place]["shape"]
        size = int(np.prod(shape)) * np.dtype(dtype).itemsize
        values = np.frombuffer(data[-size:], dtype).reshape(shape).copy()
        values[1:] = (values[1:] * factor).astype(dtype)
        content[file] = array_bytes(values)
        facts["members"][place] = member_of(file, values).model_dump(mode="json")

    return change


def recipe_value(place: str, value: Any) -> Forge:
    """Change a value of the recipe's text, with a right hash of it."""

    def change(facts: Facts, content: Members) -> None:
        recipe = json.loads(facts["provenance"]["recipe"])
        put(place, value)(recipe, content)
        text = canonical(recipe)
        facts["provenance"]["recipe"] = text.decode()
        facts["provenance"]["recipe_sha256"] = bytes_digest(text)

    return change


def all_of(*changes: Forge) -> Forge:
    def change(facts: Facts, content: Members) -> None:
        for one in changes:
            one(facts, content)

    return change


def tougher(facts: Facts, content: Members) -> None:
    """Three times as tough, everywhere where it stands: the forgery that agrees with itself."""
    times("mechanics.fracture.energy_J_per_m", 3.0)(facts, content)
    record = facts["provenance"]["cut"]
    for one in record["parameters"]:
        if one["name"] == "fracture_energy":
            for key in ("value", "mean", "sd", "q05", "q50", "q95"):
                one[key] *= 3.0
    array("tables/mean_energy.npy", 3.0)(facts, content)


def wider_limits(facts: Facts, content: Members) -> None:
    """Ten times the limits, in the manifest and in the recipe."""
    recipe = json.loads(facts["provenance"]["recipe"])
    for key in facts["limits"]:
        facts["limits"][key] *= 10.0
        recipe_value(f"limits.{key}", recipe["limits"][key] * 10.0)(facts, content)


def exchanged_names(facts: Facts, _: Members) -> None:
    one, other = facts["provenance"]["cut"]["parameters"][:2]
    one["name"], other["name"] = other["name"], one["name"]


def exchanged_tables(facts: Facts, content: Members) -> None:
    """The friction of closing under the name of opening, and the reverse, with right hashes."""
    one, other = (f"tables/friction_{part}.npy" for part in ("opening", "closing"))
    content[one], content[other] = content[other], content[one]
    for entry in facts["members"]:
        entry["file"] = {one: other, other: one}.get(entry["file"], entry["file"])


ROOM = "provenance.cut.parameters.0"

REACH = {"tolerance": 0.07, "crossed_share": 0.0, "through_share": 0.0} | dict.fromkeys(
    ("data_depth_m", "data_force_N", "scene_depth_m", "scene_force_N"), 1.0
)

FORGERIES: dict[str, Forge] = {
    "fracture energy x 3": times("mechanics.fracture.energy_J_per_m", 3.0),
    "fracture energy x 3 everywhere": tougher,
    "kappa": put("mechanics.fracture.kappa", 0.9),
    "torque limit x 10": times("limits.torque_Nm", 10.0),
    "torque slew x 10": times("limits.torque_slew_Nm_per_s", 10.0),
    "force limit x 10": times("limits.force_N", 10.0),
    "force slew x 10": times("limits.force_slew_N_per_s", 10.0),
    "engagement ramp / 10": times("limits.engagement_ramp_s", 0.1),
    "all limits x 10, and the recipe's": wider_limits,
    "opening range": times("ranges.opening_rad.1", 1.1),
    "rate range": times("ranges.opening_rate_rad_per_s.1", 2.0),
    "contact range": times("ranges.contact_m.1", 1.1),
    "handle radius": times("mechanics.handle_radius_m", 0.5),
    "tip station": times("mechanics.tip_station_m", 1.2),
    "rate damping": put("mechanics.rate_damping_s_per_m", 5.0),
    "loop rate": times("mechanics.loop_rate_Hz", 2.0),
    "one blade moves": put("mechanics.moving_blades", 1),
    "force along the cut rendered": put("mechanics.render", ["torque", "translation_force"]),
    "friction near rest": times("mechanics.friction.rate_eps_rad_per_s", 0.01),
    "stated bound x 100": times("bound.stated_Nm", 100.0),
    "allowed share": put("bound.allowed_share", 1.0),
    "proved bound": put("bound.proved_Nm", 1e-9),
    "recipe: hand damping": recipe_value("rig.hand_damping_N_s_per_m", 1000.0),
    "recipe: tolerance": recipe_value("scene.tolerance_percent", 100.0),
    "recipe: confidence": recipe_value("scene.confidence_percent", 51.0),
    "recipe: {}": all_of(
        put("provenance.recipe", "{}"), put("provenance.recipe_sha256", bytes_digest(b"{}"))
    ),
    "recipe's hash alone": put("provenance.recipe_sha256", "0" * 64),
    "inputs hash": put("provenance.inputs_hash", "1" * 64),
    "version": put("provenance.scissorcal_version", "99.0"),
    "friction that the rig has": times("provenance.friction.parameters.0.q05", 3.0),
    "a parameter's value": times(f"{ROOM}.value", 1.05),
    "a parameter's interval": times(f"{ROOM}.q95", 2.0),
    "no failed checks": put("provenance.cut.warnings", ["none"]),
    "sources": put("provenance.cut.sources", ["captures/other.mcap"]),
    "edge x 1.5": array("tables/edge.npy", 1.5),
    "response x 3": array("tables/response.npy", 3.0),
    "mean energy x 3": array("tables/mean_energy.npy", 3.0),
    "friction, closing x 0.1": array("tables/friction_closing.npy", 0.1),
    "friction, opening x -1": array("tables/friction_opening.npy", -1.0),
    "friction by angle x 2": array("tables/friction_angle.npy", 2.0),
    "draws of the cut": array("draws/cut.npy", 1.1),
    "draws of friction": array("draws/friction.npy", 1.1),
    "plate pose": put("plate_pose", "estimated"),
    "rig": put("rig", {"name": "a", "serial": "b", "torque_limit_Nm": 9.0, "force_limit_N": 9.0}),
    "reach": put("reach", REACH),
    "simplification": put("simplification", None),
    "name": put("name", "another"),
    "unit of torque": put("units.torque", "N mm"),
    "left out": put("provenance.cut.left_out", ["nothing"]),
    "points of the bound": put("bound.points", 1),
    "friction alike in both ways": put("provenance.friction.structure.symmetric", False),
    "parameters' names exchanged": exchanged_names,
    "friction tables exchanged": exchanged_tables,
}
"""Changes of what a key signed; the content hash is right again after each."""


@pytest.mark.parametrize("name", FORGERIES)
def test_no_change_of_the_content_passes_under_a_trusted_key(
    name: str, signed: Signed, tmp_path: Path
) -> None:
    path = forged(signed, tmp_path / "forged.zip", FORGERIES[name])
    assert (
        json.loads(members(path)["manifest.json"])["content_hash"] != signed.facts["content_hash"]
    ), "nothing was changed"
    assert not accepted(signed, path)


@pytest.mark.parametrize("name", ["fracture energy x 3 everywhere", "sources", "rig"])
def test_what_agrees_with_itself_is_refused_by_its_signature_alone(
    name: str, signed: Signed, tmp_path: Path
) -> None:
    package = open_package(forged(signed, tmp_path / "forged.zip", FORGERIES[name]), warn=False)
    assert any("not of this package" in one for one in package.against_review(signed.trusted))


def signature_taken_over(signed: Signed) -> dict[str, Forge]:
    """Changes of review and signature, whose content hash stays what it was."""
    review, lab = signed.facts["review"], signed.lab
    renamed = {key: value for key, value in review.items() if key not in ("digest", "key")}
    renamed["name"] = "B. Forger"
    renamed |= {"digest": stated_digest(renamed), "key": review["key"]}
    plain = {"mode": "json"}
    by_stranger = signed.stranger(f"scissorcal-signature/2\n{review['digest']}").model_dump(**plain)
    own = signed.facts["signature"]
    other_text = f"scissorcal-package-signature/1\n{'0' * 64}\n{review['digest']}"
    return {
        "no signature": put("signature", None),
        "no review": put("review", None),
        "neither": all_of(put("signature", None), put("review", None)),
        "the review's signature": put("signature", review["key"]),
        "the package's as the review's": put("review.key", own),
        "a stranger's of the review": put("review.key", by_stranger),
        "a stranger's of the package": put(
            "signature", signed.stranger("scissorcal-package-signature/1\n").model_dump(**plain)
        ),
        "a stranger's signature, the lab's key": put(
            "signature", own | {"signature": by_stranger["signature"]}
        ),
        "the lab's of another package": put("signature", lab(other_text).model_dump(**plain)),
        "the lab's of the hash alone": put(
            "signature", lab(signed.facts["content_hash"]).model_dump(**plain)
        ),
        "another review of the lab": put("review", signed.other.model_dump(**plain)),
        "the lab's rejection": put("review", signed.rejection.model_dump(**plain)),
        "another name in the review": put("review", renamed),
    }


TAKEN_OVER = 13


@pytest.mark.parametrize("index", range(TAKEN_OVER))
def test_no_review_and_no_signature_can_be_exchanged(
    index: int, signed: Signed, tmp_path: Path
) -> None:
    changes = signature_taken_over(signed)
    assert len(changes) == TAKEN_OVER
    path = forged(signed, tmp_path / "forged.zip", list(changes.values())[index])
    assert members(path)["manifest.json"] != signed.content["manifest.json"]
    assert not accepted(signed, path)


def random_edit(facts: Facts, content: Members, rng: random.Random) -> bool:
    """Change one number, word or truth value somewhere, or a byte of an array; False if neither."""
    if rng.random() < 0.3:
        file = rng.choice(sorted(set(content) - {"manifest.json"}))
        data = bytearray(content[file])
        data[rng.randrange(128, len(data))] ^= rng.randrange(1, 256)
        content[file] = bytes(data)
        entry = next(one for one in facts["members"] if one["file"] == file)
        entry |= {"bytes": len(data), "sha256": bytes_digest(bytes(data))}
        return True
    leaves: list[tuple[Any, Any]] = []
    waiting: list[Any] = [facts]
    while waiting:
        one = waiting.pop()
        for key, value in one.items() if isinstance(one, dict) else enumerate(one):
            if one is facts and key == "content_hash":
                continue
            if isinstance(value, dict | list):
                waiting.append(value)
            else:
                leaves.append((one, key))
    where, key = rng.choice(leaves)
    value = where[key]
    if isinstance(value, bool) or value is None:
        where[key] = rng.choice([not value, 1.0, None])
    elif isinstance(value, int | float):
        where[key] = value * rng.choice([0.0, -1.0, 0.5, 1.0 + 1e-12, 3.0, 1e3]) + rng.choice(
            [0.0, 1e-9, 1.0]
        )
    elif value:
        at = rng.randrange(len(value))
        where[key] = value[:at] + rng.choice("0a9 -") + value[at + 1 :]
    return bool(where[key] != value)


def edits_accepted(signed: Signed, path: Path, count: int, seed: int) -> tuple[int, int]:
    """How many random edits were made, and how many of them passed under the trusted key."""
    rng, made, passed = random.Random(seed), 0, 0
    while made < count:
        changed = [False]

        def forge(facts: Facts, content: Members, changed: list[bool] = changed) -> None:
            changed[0] = random_edit(facts, content, rng)

        forged(signed, path, forge)
        if changed[0]:
            made += 1
            passed += accepted(signed, path)
    return made, passed


def test_random_edits_do_not_pass(signed: Signed, tmp_path: Path) -> None:
    assert edits_accepted(signed, tmp_path / "forged.zip", 60, 1) == (60, 0)


@pytest.mark.slow
def test_many_random_edits_do_not_pass(signed: Signed, tmp_path: Path) -> None:
    assert edits_accepted(signed, tmp_path / "forged.zip", 1000, 2) == (1000, 0)


def test_what_was_signed_passes(signed: Signed, tmp_path: Path) -> None:
    assert accepted(signed, signed.path)
    verdicts = {one.check: one for one in check_package(signed.path, signed.trusted)}
    assert (verdicts["review"].status, verdicts["signature"].status) == ("pass", "pass")
    assert "which you trust" in verdicts["signature"].why
    copied = forged(signed, tmp_path / "same.zip", lambda facts, content: None)
    assert accepted(signed, copied)


def test_without_a_trusted_key_the_check_states_what_it_cannot_know(
    signed: Signed, paper: PackageSummary
) -> None:
    for path, words in (
        (paper.path, "not who made it"),
        (signed.path, "Whose key that is cannot be known"),
    ):
        (verdict,) = [one for one in check_package(path) if one.check == "signature"]
        assert verdict.status == "not_evaluated"
        assert words in verdict.why
        assert "--trusted-key" in verdict.why
        assert "\n" not in verdict.why


def test_a_changed_package_is_judged_as_forged_without_a_trusted_key_too(
    signed: Signed, tmp_path: Path
) -> None:
    path = forged(signed, tmp_path / "forged.zip", put("provenance.cut.warnings", []))
    path = forged(signed, path, put("provenance.scissorcal_version", "99.0"))
    (verdict,) = [one for one in check_package(path) if one.check == "signature"]
    assert verdict.status == "fail"
    assert "not of this package" in verdict.why


def test_units_that_are_not_those_of_the_package_are_refused_without_a_key(
    signed: Signed, tmp_path: Path
) -> None:
    path = forged(signed, tmp_path / "forged.zip", put("units.torque", "N mm"))
    with pytest.raises(InputError, match=r"units\.torque is 'N mm', .* give 'N m'"):
        open_package(path, warn=False)


def test_a_manifest_with_a_key_twice_is_the_one_that_is_hashed(
    signed: Signed, tmp_path: Path
) -> None:
    """Of two values under one key the last counts for the hash, and for what is used."""
    limits = json.dumps(signed.facts["limits"] | {"torque_Nm": 50.0})
    text = signed.content["manifest.json"].decode().rstrip()
    for twice in (f'{text[:-1]}, "limits": {limits}}}', f'{{"limits": {limits}, {text[1:]}'):
        pack(tmp_path / "forged.zip", {**signed.content, "manifest.json": twice.encode()})
        if accepted(signed, tmp_path / "forged.zip"):
            package = open_package(tmp_path / "forged.zip", warn=False)
            assert package.manifest.limits.torque_Nm == signed.facts["limits"]["torque_Nm"]
        else:
            assert twice.startswith(text[:-1])


def test_a_signed_package_in_the_comment_of_a_forged_one(signed: Signed, tmp_path: Path) -> None:
    """Two packages in one file: what is read has to be what is signed."""
    path = forged(signed, tmp_path / "forged.zip", times("limits.torque_Nm", 9.0))
    with zipfile.ZipFile(path, "a") as archive:
        archive.comment = signed.path.read_bytes()[-60_000:]
    if accepted(signed, path):
        package = open_package(path, warn=False)
        assert package.manifest.limits.torque_Nm == signed.facts["limits"]["torque_Nm"]
