"""The firmware's core in lockstep with the virtual rig's mechanics: a probe, and a whole day."""

from functools import partial
from pathlib import Path

import numpy as np
import pytest

from scissorcal.device import LockstepLink, RigSession, VirtualRig, load_specimen, lockstep
from scissorcal.device.probe.probe import probe
from scissorcal.recipe import builtin_recipe
from scissorcal.workday import Engine, Workspace
from scissorcal.workday.demo import day
from scissorcal.workday.runs import fit as fits
from tests.cli.conftest import Cli
from tests.cli.conftest import cli as cli

from .side import FirmwareSide

SPECIMEN = "office-paper"
NOT_FOR_SIMULATORS = {"count scale", "clock by host", "clipping"}
"""What a probe does not check on a virtual rig, or on one whose limit would throw the blades."""
MOST_SDS = 3.0


def test_the_probe_finds_nothing_wrong_with_the_firmware() -> None:
    sides: list[FirmwareSide] = []

    def make(rig: VirtualRig, rng: np.random.Generator, faults: object) -> FirmwareSide:
        sides.append(FirmwareSide(rig, rng, None))
        return sides[0]

    with LockstepLink(SPECIMEN, np.random.default_rng(3), device=make) as link:
        found = probe(RigSession(link, builtin_recipe("paper-80gsm")))
    statuses = {verdict.check: verdict.status for verdict in found.verdicts}
    assert {check for check, status in statuses.items() if status != "pass"} <= NOT_FOR_SIMULATORS
    assert statuses["watchdog"] == statuses["fault clears"] == "pass"
    assert found.device == f"firmware {SPECIMEN}"
    assert found.delay_s is not None
    assert found.delay_s.mean == pytest.approx(2e-3, abs=5e-4), "one tick more than the rig's own"


@pytest.mark.slow
@pytest.mark.probes
def test_a_day_with_the_firmware(cli: Cli, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    through = partial(LockstepLink, device=FirmwareSide)
    monkeypatch.setattr(lockstep, "LockstepLink", through)
    workspace = Workspace(tmp_path / "paper")
    assert cli("init", workspace.root, "--recipe", "paper-80gsm").code == 0
    monkeypatch.chdir(workspace.root)
    for words in (
        ("device", "probe", "--device", "sim"),
        ("capture", "friction", "--device", "sim"),
        ("capture", "cut", "--device", "sim"),
        ("fit",),
    ):
        said = cli(*words)
        assert said.code == 0, (words, said.out, said.err)
    specimen = load_specimen(SPECIMEN)
    for what in ("friction", "cut"):
        fit = fits.load_result(Engine.of(workspace), what)
        for row in day.judge(fit, specimen):
            if row.truth is not None:
                sd = (row.high - row.low) / 3.29
                print(f"{row.name}: {(row.estimate - row.truth) / sd:+.2f} sd")
                assert abs(row.estimate - row.truth) <= MOST_SDS * sd, row
