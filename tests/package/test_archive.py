"""Packages that were damaged, forged or made to harm: refused, or harmless."""

import hashlib
import io
import json
import pickle
import stat
import struct
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from scissorcal.errors import InputError, MissingError, ScissorcalError
from scissorcal.foreign import PACKAGE
from scissorcal.package import PackageSummary, build_package, check_package, open_package
from scissorcal.package.archive import array_bytes, member_of
from scissorcal.package.manifest import content_hash
from tests.package.fits import cut_fit, friction_fit, recipe

Members = dict[str, bytes]
HEALTH = [HealthCheck.function_scoped_fixture, HealthCheck.too_slow]
"""Left out: each example writes its copy anew, and the machine is shared."""


def members(path: Path) -> Members:
    with zipfile.ZipFile(path) as archive:
        return {name: archive.read(name) for name in archive.namelist()}


def pack(path: Path, content: Members, compression: int = zipfile.ZIP_STORED) -> None:
    with zipfile.ZipFile(path, "w", compression, compresslevel=1) as archive:
        for name, data in content.items():
            archive.writestr(name, data)


def forge(path: Path, change: Callable[[Any, Members], None]) -> None:
    """Rewrite a package with a changed manifest that has a right content hash again."""
    content = members(path)
    facts = json.loads(content["manifest.json"])
    change(facts, content)
    facts["content_hash"] = content_hash(facts)
    content["manifest.json"] = json.dumps(facts).encode()
    pack(path, content)


def forge_array(path: Path, file: str, array: np.ndarray[Any, Any]) -> None:
    """Put in another array, with a right hash everywhere."""

    def change(facts: Any, content: Members) -> None:
        content[file] = array_bytes(array)
        for index, member in enumerate(facts["members"]):
            if member["file"] == file:
                facts["members"][index] = member_of(file, array).model_dump(mode="json")

    forge(path, change)


def test_equal_inputs_give_equal_bytes(paper: PackageSummary, tmp_path: Path) -> None:
    chosen = recipe()
    again = tmp_path / "again.zip"
    fit = cut_fit(chosen, kappa=0.75)
    build_package(chosen, friction_fit(), fit, again, np.random.default_rng(3))
    assert again.read_bytes() == paper.path.read_bytes()
    build_package(chosen, friction_fit(), fit, again, np.random.default_rng(4))
    assert again.read_bytes() != paper.path.read_bytes()


def test_what_is_written_is_what_is_read(paper: PackageSummary) -> None:
    package = open_package(paper.path)
    assert package.manifest == paper.manifest
    assert set(members(paper.path)) == {"manifest.json", *package.arrays}


def test_every_flipped_byte_is_refused_or_harmless(
    paper: PackageSummary, copy_of_paper: Path
) -> None:
    """One byte after another through the whole file, headers and directory included."""
    original = paper.path.read_bytes()
    truth = open_package(paper.path)
    rng = np.random.default_rng(5)
    directory = original.rindex(b"PK\x01\x02", 0, original.index(b"PK\x01\x02") + 4)
    places = np.concatenate([np.arange(0, directory, 131), np.arange(directory, len(original), 5)])
    refused = 0
    for place in places:
        damaged = bytearray(original)
        damaged[place] ^= int(rng.integers(1, 256))
        copy_of_paper.write_bytes(damaged)
        refused += not opens_as(copy_of_paper, truth)
    assert refused > 0.8 * len(places)


@settings(max_examples=150, suppress_health_check=HEALTH)
@given(data=st.data())
def test_any_changed_range_of_a_member_is_refused(
    data: st.DataObject, paper: PackageSummary, copy_of_paper: Path
) -> None:
    content = members(paper.path)
    name = data.draw(st.sampled_from(sorted(content)))
    start = data.draw(st.integers(0, len(content[name]) - 1))
    stop = data.draw(st.integers(start, min(start + 64, len(content[name]))))
    junk = data.draw(st.binary(max_size=64))
    changed = content[name][:start] + junk + content[name][stop:]
    pack(copy_of_paper, content | {name: changed})
    if changed == content[name]:
        assert opens_as(copy_of_paper, open_package(paper.path))
    elif name == "manifest.json":
        opens_as(copy_of_paper, open_package(paper.path))
    else:
        with pytest.raises(InputError, match=name):
            open_package(copy_of_paper)


@settings(max_examples=150, suppress_health_check=HEALTH)
@given(data=st.data())
def test_any_changed_range_of_the_file_is_refused_or_harmless(
    data: st.DataObject, paper: PackageSummary, copy_of_paper: Path
) -> None:
    original = paper.path.read_bytes()
    start = data.draw(st.integers(0, len(original)))
    stop = data.draw(st.integers(start, min(start + 200, len(original))))
    junk = data.draw(st.binary(max_size=200))
    copy_of_paper.write_bytes(original[:start] + junk + original[stop:])
    opens_as(copy_of_paper, open_package(paper.path))


def opens_as(path: Path, truth: Any) -> bool:
    """Whether a file is accepted; if it is, it must say exactly what the true one says."""
    try:
        package = open_package(path)
    except InputError:
        return False
    assert package.manifest == truth.manifest
    assert all(np.array_equal(package.arrays[name], truth.arrays[name]) for name in truth.arrays)
    return True


def test_every_truncation_is_refused(paper: PackageSummary, copy_of_paper: Path) -> None:
    original = paper.path.read_bytes()
    for length in (*range(0, 200, 13), *range(200, len(original), 1501), len(original) - 1):
        copy_of_paper.write_bytes(original[:length])
        with pytest.raises(InputError):
            open_package(copy_of_paper)


@pytest.mark.parametrize(
    "name",
    [
        "/etc/evil.npy",
        "../evil.npy",
        "tables/../../evil",
        "..\\evil",
        "C:\\evil",
        "~/evil",
        "c:evil",
    ],
)
def test_paths_that_leave_the_archive_are_refused(name: str, copy_of_paper: Path) -> None:
    pack(copy_of_paper, members(copy_of_paper) | {name: b"x"})
    with pytest.raises(InputError, match="leaves the archive"):
        open_package(copy_of_paper)


def test_symbolic_links_are_refused(copy_of_paper: Path) -> None:
    with zipfile.ZipFile(copy_of_paper, "a") as archive:
        link = zipfile.ZipInfo("tables/extra.npy")
        link.create_system = 3
        link.external_attr = (stat.S_IFLNK | 0o777) << 16
        archive.writestr(link, "/etc/passwd")
    with pytest.raises(InputError, match="symbolic link"):
        open_package(copy_of_paper)


def test_unknown_missing_and_doubled_members_are_refused(copy_of_paper: Path) -> None:
    content = members(copy_of_paper)
    pack(copy_of_paper, content | {"notes.txt": b"hello"})
    with pytest.raises(InputError, match=r"notes\.txt.*not in the manifest"):
        open_package(copy_of_paper)
    for name in content:
        pack(copy_of_paper, {key: value for key, value in content.items() if key != name})
        with pytest.raises(InputError, match=name):
            open_package(copy_of_paper)
    pack(copy_of_paper, content)
    with (
        pytest.warns(UserWarning, match="Duplicate"),
        zipfile.ZipFile(copy_of_paper, "a") as archive,
    ):
        archive.writestr("tables/edge.npy", content["tables/edge.npy"])
    with pytest.raises(InputError, match="there twice"):
        open_package(copy_of_paper)


def test_a_decompression_bomb_is_refused_without_unpacking(copy_of_paper: Path) -> None:
    content = members(copy_of_paper)
    content["tables/edge.npy"] = bytes(300_000_000)
    pack(copy_of_paper, content, zipfile.ZIP_DEFLATED)
    with pytest.raises(InputError, match="claims 300000000 bytes"):
        open_package(copy_of_paper)


def test_a_decompression_bomb_with_a_false_size_is_refused(copy_of_paper: Path) -> None:
    content = members(copy_of_paper)
    right = len(content["tables/edge.npy"])
    content["tables/edge.npy"] = bytes(50_000_000)
    pack(copy_of_paper, content, zipfile.ZIP_DEFLATED)
    raw = copy_of_paper.read_bytes()
    copy_of_paper.write_bytes(raw.replace(struct.pack("<I", 50_000_000), struct.pack("<I", right)))
    with pytest.raises(InputError, match=r"edge\.npy|damaged"):
        open_package(copy_of_paper)


def test_an_oversized_manifest_is_refused(copy_of_paper: Path) -> None:
    content = members(copy_of_paper) | {"manifest.json": b" " * 50_000_000}
    pack(copy_of_paper, content, zipfile.ZIP_DEFLATED)
    with pytest.raises(InputError, match=r"manifest\.json.*unpacks to more"):
        open_package(copy_of_paper)


def test_a_recompressed_package_is_accepted(paper: PackageSummary, copy_of_paper: Path) -> None:
    pack(copy_of_paper, members(paper.path), zipfile.ZIP_DEFLATED)
    assert opens_as(copy_of_paper, open_package(paper.path))


def test_a_pickled_array_is_never_loaded(copy_of_paper: Path) -> None:
    class Trap:
        def __reduce__(self) -> Any:
            return (Path.touch, (copy_of_paper.with_name("sprung"),))

    buffer = io.BytesIO()
    np.lib.format.write_array_header_1_0(
        buffer, {"descr": "|O", "fortran_order": False, "shape": (3, 2)}
    )
    data = buffer.getvalue() + pickle.dumps([Trap()] * 6)

    def change(facts: Any, content: Members) -> None:
        content["tables/edge.npy"] = data
        entry = next(m for m in facts["members"] if m["file"] == "tables/edge.npy")
        entry |= {"bytes": len(data), "sha256": hashlib.sha256(data).hexdigest(), "shape": [3, 2]}

    forge(copy_of_paper, change)
    with pytest.raises(InputError, match=r"edge\.npy.*not an array"):
        open_package(copy_of_paper)
    assert not copy_of_paper.with_name("sprung").exists()


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
@pytest.mark.parametrize("file", ["tables/response.npy", "draws/cut.npy"])
def test_arrays_that_are_not_finite_are_refused(
    file: str, bad: float, paper: PackageSummary, copy_of_paper: Path
) -> None:
    array = np.array(open_package(paper.path).arrays[file])
    array[1, 1] = bad
    forge_array(copy_of_paper, file, array)
    with pytest.raises(InputError, match="not finite"):
        open_package(copy_of_paper)


def test_tables_that_do_not_form_a_model_are_refused(
    paper: PackageSummary, copy_of_paper: Path
) -> None:
    response = np.array(open_package(paper.path).arrays["tables/response.npy"])
    falling = response.copy()
    falling[1] = falling[1][::-1]
    backwards = response.copy()
    backwards[0, 3] = backwards[0, 1]
    for array in (falling, backwards, response[:2], response[:, :1], np.tile(response, 20)):
        forge_array(copy_of_paper, "tables/response.npy", array)
        with pytest.raises(InputError, match=r"not form a model|response\.npy"):
            open_package(copy_of_paper)


def test_a_forged_table_is_caught_by_the_check(paper: PackageSummary, copy_of_paper: Path) -> None:
    """Right hashes, wrong torque: opening cannot tell, checking can."""
    edge = np.array(open_package(paper.path).arrays["tables/edge.npy"])
    edge[1] += 1e-4
    forge_array(copy_of_paper, "tables/edge.npy", edge)
    verdicts = {verdict.check: verdict for verdict in check_package(copy_of_paper)}
    assert verdicts["bound"].status == "fail"
    assert "N m" in verdicts["bound"].why


def _set(path: str, value: Any) -> Callable[[Any, Members], None]:
    *parents, last = path.split(".")

    def change(facts: Any, content: Members) -> None:
        for key in parents:
            facts = facts[key]
        facts[last] = value

    return change


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (_set("format", "scissorcal-package/2"), "scissorcal-package/2"),
        (_set("surprise", 1), "surprise"),
        (_set("limits.torque_Nm", -1.0), "torque_Nm"),
        (_set("limits.torque_Nm", "1.0"), "torque_Nm"),
        (_set("limits.torque_Nm", float("inf")), "not JSON"),
        (_set("ranges.opening_rad", [0.9, 0.2]), "opening_rad"),
        (_set("mechanics.moving_blades", 3), "moving_blades"),
        (_set("mechanics.fracture.kappa", 1.5), "kappa"),
        (_set("mechanics.fracture", None), "members do not fit"),
        (_set("mechanics.friction", None), "members do not fit"),
        (_set("mechanics.loop_rate_Hz", 0), "loop_rate_Hz"),
        (_set("signature", "someone"), "signature"),
        (_set("review", "someone"), "review"),
        (_set("members", []), "members"),
        (_set("provenance.cut.parameters", []), "parameters"),
        (_set("name", "../evil"), "name"),
    ],
)
def test_a_forged_manifest_is_refused(
    change: Callable[[Any, Members], None], words: str, copy_of_paper: Path
) -> None:
    content = members(copy_of_paper)
    facts = json.loads(content["manifest.json"])
    change(facts, content)
    try:
        facts["content_hash"] = content_hash(facts)
    except ValueError:
        assert words == "not JSON"
    content["manifest.json"] = json.dumps(facts).encode()
    pack(copy_of_paper, content)
    with pytest.raises(InputError, match=words):
        open_package(copy_of_paper)


def test_a_changed_manifest_without_its_hash_is_refused(copy_of_paper: Path) -> None:
    content = members(copy_of_paper)
    facts = json.loads(content["manifest.json"])
    facts["limits"]["torque_Nm"] = 50.0
    pack(copy_of_paper, content | {"manifest.json": json.dumps(facts).encode()})
    with pytest.raises(InputError, match="was changed"):
        open_package(copy_of_paper)


@pytest.mark.parametrize("data", [b"", b"PK", b"not a zip at all", b"[" * 100_000])
def test_foreign_files_are_refused(data: bytes, tmp_path: Path) -> None:
    path = tmp_path / "foreign.zip"
    path.write_bytes(data)
    with pytest.raises(InputError, match=r"foreign\.zip"):
        open_package(path)


@pytest.mark.parametrize("kappa", [1e-300, 1e-60])
def test_numbers_that_the_kernel_cannot_hold_are_refused(copy_of_paper: Path, kappa: float) -> None:
    def change(facts: Any, _: Members) -> None:
        facts["mechanics"]["fracture"]["kappa"] = kappa

    forge(copy_of_paper, change)
    with pytest.raises(InputError, match=r"copy\.zip: its tables .* do not form a model"):
        open_package(copy_of_paper)


def test_deeply_nested_json_is_refused(copy_of_paper: Path) -> None:
    pack(copy_of_paper, members(copy_of_paper) | {"manifest.json": b"[" * 200_000})
    with pytest.raises(InputError, match="nested too deeply for JSON"):
        open_package(copy_of_paper)


def test_a_missing_file_a_folder_and_a_large_file_are_refused(tmp_path: Path) -> None:
    with pytest.raises(MissingError, match="does not exist"):
        open_package(tmp_path / "none.zip")
    with pytest.raises(InputError, match="not a file"):
        open_package(tmp_path)
    giant = tmp_path / "giant.zip"
    with giant.open("wb") as stream:
        stream.truncate(PACKAGE.most_bytes + 1)
    with pytest.raises(InputError, match="another file"):
        open_package(giant)
    with pytest.raises(ScissorcalError):
        open_package("nul\0byte")


def test_a_failed_write_leaves_the_old_package(
    paper: PackageSummary, copy_of_paper: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(self: Path, data: bytes) -> int:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(Path, "write_bytes", full)
    chosen = recipe()
    with pytest.raises(InputError, match="No space left"):
        build_package(
            chosen, friction_fit(), cut_fit(chosen), copy_of_paper, np.random.default_rng(0)
        )
    monkeypatch.undo()
    assert copy_of_paper.read_bytes() == paper.path.read_bytes()
