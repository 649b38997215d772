"""scissorcal verify: what it prints, refuses, and how it ends."""

import dataclasses
from pathlib import Path

import pytest

from scissorcal.workday import Engine, Workspace
from tests.calibration.truth import Truth
from tests.workday.made import fitted_copy, quick_workspace, record_friction

from .conftest import Cli


@pytest.fixture(scope="module")
def fitted(tmp_path_factory: pytest.TempPathFactory) -> Workspace:
    return fitted_copy(tmp_path_factory, tmp_path_factory.mktemp("verify") / "paper", "friction")


def test_it_prints_tables_and_verdicts(
    fitted: Workspace, cli: Cli, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(fitted.captures_dir)
    said = cli("verify", "friction", "--fits", "3", "--workers", "1", "-v")
    assert said.code == 0, said.out
    assert "FAIL  " not in said.out
    for words in (
        "3 fits to data simulated from known values",
        "(a normal distribution around the posterior, 3 times as wide",
        "; white ",
        "effort_rms",
        "they do not share (whole strokes of a kind, alternating by speed).",
        "Verification: prior sensitivity",
        "----  verify.friction  calibration",
        "pass  verify.friction  halves-effort",
    ):
        assert words in said.out, words
    assert "friction: making ready" in said.err
    envelope = cli("verify", "--checks", "prior", "--workers", "1", "--json").envelope
    (check,) = envelope["result"]["checks"]
    assert check["what"] == "friction"
    assert check["calibration"] is None
    assert envelope["files"] == [str(Engine.of(fitted).file("verify friction"))]


def test_a_rig_that_changed_ends_with_three(
    cli: Cli, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The joint rubs half as much again in the second recording: the fit itself says so.

    Its intervals take the difference up, so that halves by recording agree with what they claim.
    """
    workspace = quick_workspace(tmp_path / "changed")
    record_friction(workspace, seed=1)
    stiffer = dataclasses.replace(Truth(), coulomb_pos=0.0195, coulomb_neg=0.024)
    record_friction(workspace, seed=2, truth=stiffer)
    monkeypatch.chdir(workspace.root)
    said = cli("fit", "friction")
    assert said.code == 3
    assert "FAIL  fit.friction  recordings" in said.out
    assert "The rig changed between recordings" in said.out
    said = cli("verify", "friction", "--checks", "halves", "--workers", "1")
    assert "(whole recordings, 1 of 2 in one half)" in said.out


def test_wrong_words_and_a_missing_fit_are_refused(
    cli: Cli, workspace: Path, fitted: Workspace
) -> None:
    said = cli("verify", "--checks", "sbc,luck")
    assert said.code == 2
    assert "luck is not a check; choose from sbc, halves, prior" in said.err
    assert cli("verify", "--fits", "0").code == 2
    said = cli("verify", "--workers", "2", "--cluster", "tcp://here:1")
    assert said.code == 2
    assert "Give --workers or --cluster" in said.err
    said = cli("verify")
    assert said.code == 5
    assert "run 'scissorcal fit' first" in said.err
    said = cli("verify", "friction", "--cluster", "nonsense://1", "-w", fitted.root)
    assert said.code == 2
    assert "nonsense://1" in said.err
