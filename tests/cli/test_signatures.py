"""What a signature covers: each thing that is forged is noticed, by name, by each command."""

import json
import shutil
import subprocess
import sys
import zipfile
from collections.abc import Callable
from pathlib import Path

import pytest

from scissorcal.cli.root import run
from scissorcal.package import MANIFEST_FILE, open_package, stated_digest
from scissorcal.workday import Workspace
from tests.workday.made import fitted_copy, record_cut

from .conftest import Cli

SIGN = ("report", "sign", "--name", "A. Reviewer", "--decision", "accept")
needs_ssh_keygen = pytest.mark.skipif(
    shutil.which("ssh-keygen") is None, reason="OpenSSH's ssh-keygen is not here"
)


@pytest.fixture(scope="module")
def signed_day(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A workspace whose report is signed, and whose package carries the signature."""
    folder = tmp_path_factory.mktemp("signed") / "paper"
    workspace = fitted_copy(tmp_path_factory, folder, "friction", "cut")
    for words in (("report",), SIGN, ("package", "build")):
        with pytest.raises(SystemExit) as ended:
            run([*words, "--workspace", str(workspace.root)])
        assert ended.value.code == 0, words
    return workspace.root


@pytest.fixture
def day(signed_day: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Workspace:
    """A copy of it, to be forged."""
    shutil.copytree(signed_day, tmp_path / "paper")
    monkeypatch.chdir(tmp_path / "paper")
    return Workspace(tmp_path / "paper")


def edited(path: Path, old: bytes, new: bytes) -> None:
    data = path.read_bytes()
    assert old in data
    path.write_bytes(data.replace(old, new, 1))


def recorded_again(day: Workspace) -> None:
    """Exchange a recording for another one under its name."""
    (first,) = day.recordings("cut")
    first.unlink()
    record_cut(day, seed=4).rename(first)


FORGERIES: dict[str, tuple[Callable[[Workspace], None], str]] = {
    "page": (
        lambda day: edited(day.report_html, b"pass", b"PASS-FORGED"),
        "report/report.html was changed",
    ),
    "signature on the page": (
        lambda day: edited(day.report_html, b"A. Reviewer", b"A. Forger"),
        "report/report.html shows another signature",
    ),
    "twin": (
        lambda day: edited(day.report_json, b"pass", b"fail"),
        "report/report.json was changed",
    ),
    "recipe": (
        lambda day: edited(day.recipe_path, b"\n", b"\n# a remark\n"),
        "recipe.toml was changed",
    ),
    "fit": (
        lambda day: day.fit_path("cut").write_bytes(day.fit_path("friction").read_bytes()),
        "",
    ),
    "recording": (recorded_again, ""),
}
"""What is forged, and how the signature's state names it; empty where an earlier step does."""


def steps_of(cli: Cli) -> dict[str, dict[str, str]]:
    return {step["name"]: step for step in cli("plan", "--json").envelope["result"]["steps"]}


def test_nothing_forged_is_signed(day: Workspace, cli: Cli) -> None:
    assert steps_of(cli)["report sign"]["state"] == "done"
    page = day.report_html.read_text(encoding="utf-8")
    signature = json.loads(day.signature_path.read_text(encoding="utf-8"))
    assert signature["digest"][:16] in page
    recordings = {f"captures/{path.name}" for path in day.captures_dir.glob("*.mcap")}
    assert recordings < set(signature["content"])
    assert {"recipe.toml", "fits/cut.nc", "fits/friction.nc"} < set(signature["content"])


@pytest.mark.parametrize("forged", FORGERIES)
def test_a_forgery_voids_the_signature(day: Workspace, cli: Cli, forged: str) -> None:
    forge, named = FORGERIES[forged]
    forge(day)
    steps = steps_of(cli)
    assert steps["report sign"]["state"] in ("stale", "failed")
    assert named in steps["report sign"]["found"]
    if "report/report." in named:
        assert "'scissorcal report' writes it anew" in steps["report sign"]["found"]
    built = cli("package", "build")
    if built.code == 0:
        assert open_package(day.package_path(day.recipe()), warn=False).manifest.review is None
        assert "signature under the report is void" in built.out
    else:
        assert forged in ("fit", "recording")


def put_manifest(path: Path, change: Callable[[dict[str, object]], None]) -> None:
    """Write a package with another manifest, all else as it was."""
    with zipfile.ZipFile(path) as archive:
        files = {name: archive.read(name) for name in archive.namelist()}
    manifest = json.loads(files[MANIFEST_FILE])
    change(manifest)
    files[MANIFEST_FILE] = json.dumps(manifest).encode()
    with zipfile.ZipFile(path, "w") as archive:
        for name, data in files.items():
            archive.writestr(name, data)


def typed_in(manifest: dict[str, object], *, with_digest: bool) -> None:
    review = manifest["review"]
    assert isinstance(review, dict)
    review["name"] = "B. Forger"
    stated = {key: value for key, value in review.items() if key not in ("digest", "key")}
    if with_digest:
        review["digest"] = stated_digest(stated)


def test_a_review_typed_into_a_manifest_is_refused(day: Workspace, cli: Cli) -> None:
    path = day.package_path(day.recipe())
    put_manifest(path, lambda manifest: typed_in(manifest, with_digest=False))
    for words in (("package", "check"), ("render", "--device", "sim", "--yes", "--no-record")):
        said = cli(*words)
        assert said.code == 2
        assert "the review was changed" in said.err


def test_a_review_with_a_right_digest_proves_no_name_and_says_so(day: Workspace, cli: Cli) -> None:
    path = day.package_path(day.recipe())
    put_manifest(path, lambda manifest: typed_in(manifest, with_digest=True))
    said = cli("package", "check", "-v")
    assert said.code == 0
    assert "B. Forger" in said.out
    assert "nothing shows who wrote the name" in said.out


@needs_ssh_keygen
def test_a_key_shows_who_signed(day: Workspace, cli: Cli, tmp_path: Path) -> None:
    for name in ("lab", "other"):
        words = ["ssh-keygen", "-q", "-t", "ed25519", "-N", "", "-f", str(tmp_path / name)]
        subprocess.run(words, check=True)
    lab, other = tmp_path / "lab", tmp_path / "other.pub"
    signed = cli(*SIGN, "--key", lab)
    assert signed.code == 0
    listed = subprocess.run(
        ["ssh-keygen", "-l", "-f", f"{lab}.pub"], check=True, capture_output=True, text=True
    )
    fingerprint = listed.stdout.split()[1]
    assert fingerprint in signed.out
    assert fingerprint in day.report_html.read_text(encoding="utf-8")
    assert cli("package", "build").code == 0
    unsigned = cli("package", "check", "--trusted-key", f"{lab}.pub")
    assert unsigned.code == 3
    assert "has no signature of its content" in unsigned.out
    assert "package build --key" in unsigned.out
    built = cli("package", "build", "--key", lab)
    assert (built.code, fingerprint in built.out) == (0, True)
    again = cli("package", "build", "--key", lab)
    assert "nothing changed since it was built" in again.out
    assert cli("package", "check", "--trusted-key", f"{lab}.pub").code == 0
    refused = cli("package", "check", "--trusted-key", other)
    assert refused.code == 3
    assert "none of the trusted keys signed" in refused.out
    assert "none of the trusted ones" in refused.out
    run_words = ("render", "--device", "sim", "--yes", "--no-record", "--seconds", "0.3")
    refused = cli(*run_words, "--trusted-key", other)
    assert refused.code == 3
    assert "Nothing was rendered." in refused.err

    path = day.package_path(day.recipe())
    put_manifest(path, lambda manifest: typed_in(manifest, with_digest=True))
    forged = cli("package", "check")
    assert forged.code == 3
    assert "not of this review" in forged.out
    assert "not of this package" in forged.out


@needs_ssh_keygen
def test_another_review_leaves_the_old_signature_out_and_says_so(
    day: Workspace, cli: Cli, tmp_path: Path
) -> None:
    lab = tmp_path / "lab"
    subprocess.run(["ssh-keygen", "-q", "-t", "ed25519", "-N", "", "-f", str(lab)], check=True)
    assert cli("package", "build", "--key", lab).code == 0
    assert cli("package", "build").code == 0
    path = day.package_path(day.recipe())
    assert open_package(path, warn=False).manifest.signature is not None
    assert cli("report", "sign", "--name", "B", "--decision", "accept").code == 0
    built = cli("package", "build")
    assert built.code == 0
    assert "The package's signature was left out" in built.out
    assert open_package(path, warn=False).manifest.signature is None


@needs_ssh_keygen
def test_without_cryptography_no_key_signs_and_none_is_taken_for_checked(
    day: Workspace, cli: Cli, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    lab = tmp_path / "lab"
    subprocess.run(["ssh-keygen", "-q", "-t", "ed25519", "-N", "", "-f", str(lab)], check=True)
    assert cli(*SIGN, "--key", lab).code == 0
    assert cli("package", "build").code == 0
    assert cli("package", "check").code == 0
    monkeypatch.setitem(sys.modules, "cryptography", None)
    for words in ((*SIGN, "--key", lab), ("package", "check", "--trusted-key", f"{lab}.pub")):
        said = cli(*words)
        assert said.code == 2
        assert "needs cryptography, which is not installed" in said.err
        assert "pip install 'scissorcal[keys]'." in said.err
    said = cli("package", "check")
    assert said.code == 3
    assert "is not checked, because cryptography is not installed" in said.out


@needs_ssh_keygen
def test_a_key_that_cannot_be_used_is_a_sentence(day: Workspace, cli: Cli, tmp_path: Path) -> None:
    key = tmp_path / "key"
    said = cli(*SIGN, "--key", key)
    assert (said.code, f"{key} does not exist" in said.err) == (2, True)
    subprocess.run(["ssh-keygen", "-q", "-t", "ed25519", "-N", "", "-f", str(key)], check=True)
    key.chmod(0o644)
    said = cli(*SIGN, "--key", key)
    assert (said.code, "chmod 600" in said.err) == (2, True)
    key.chmod(0o600)
    whole = key.read_bytes()
    for damaged in (whole[:150], b"no key", b"", whole.replace(b"A", b"B")):
        key.write_bytes(damaged)
        assert cli(*SIGN, "--key", key).code == 2
    locked, rsa = tmp_path / "locked", tmp_path / "rsa"
    words = ["ssh-keygen", "-q", "-t", "ed25519", "-N", "secret", "-f", str(locked)]
    subprocess.run(words, check=True)
    said = cli(*SIGN, "--key", locked)
    assert (said.code, "passphrase" in said.err) == (2, True)
    subprocess.run(["ssh-keygen", "-q", "-t", "rsa", "-N", "", "-f", str(rsa)], check=True)
    said = cli(*SIGN, "--key", rsa)
    assert (said.code, "not an Ed25519" in said.err) == (2, True)
    said = cli("package", "check", "--trusted-key", tmp_path / "rsa.pub")
    assert (said.code, "line 1 is not an Ed25519" in said.err) == (2, True)


def test_results_tell_nothing_of_the_disk(day: Workspace, signed_day: Path) -> None:
    """Packages and reports go to others: no folder of the workspace stands in them."""
    folder = str(signed_day).encode()
    with zipfile.ZipFile(day.package_path(day.recipe())) as archive:
        assert not any(folder in archive.read(name) for name in archive.namelist())
    assert folder not in day.report_html.read_bytes()
    assert folder not in day.report_json.read_bytes()
    manifest = open_package(day.package_path(day.recipe()), warn=False).manifest
    assert all(one.startswith("captures/cut-") for one in manifest.provenance.cut.sources)
