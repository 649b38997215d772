"""The flashed binary as the device of a day in lockstep: probe, captures, fits, rendering."""

import time
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from scissorcal.device import Faults, LockstepLink, VirtualRig, load_specimen, lockstep
from scissorcal.workday import Engine, Workspace
from scissorcal.workday.demo import day
from scissorcal.workday.runs import fit as fits
from tests.cli.conftest import Cli
from tests.cli.conftest import cli as cli

from .elf import Image
from .side import FirmwareSide
from .test_lockstep import MOST_SDS, SPECIMEN

emulator = pytest.importorskip(
    "tests.firmware.emulator", reason="needs unicorn, of the extra 'dev'", exc_type=ImportError
)


class EmulatedSide(FirmwareSide):
    """The device side whose core runs under the emulator; ``spent_s`` is its processor time."""

    ticks = 0
    spent_s = 0.0

    def __init__(
        self, image: Image, rig: VirtualRig, rng: np.random.Generator, faults: Faults | None
    ) -> None:
        super().__init__(rig, rng, faults)
        self.core = emulator.EmulatedCore(image, self.core.table)

    def tick(self) -> None:
        began = time.process_time()
        super().tick()
        EmulatedSide.ticks += 1
        EmulatedSide.spent_s += time.process_time() - began


@pytest.mark.slow
@pytest.mark.probes
def test_a_day_through_the_flashed_binary(
    stm32f405: Image, cli: Cli, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    class Through(LockstepLink):
        def __init__(self, *words: Any, **options: Any) -> None:
            super().__init__(*words, device=partial(EmulatedSide, stm32f405), **options)

    monkeypatch.setattr(lockstep, "LockstepLink", Through)
    workspace = Workspace(tmp_path / "paper")
    assert cli("init", workspace.root, "--recipe", "paper-80gsm").code == 0
    monkeypatch.chdir(workspace.root)
    for words in (
        ("device", "probe", "--device", "sim"),
        ("capture", "friction", "--device", "sim"),
        ("capture", "cut", "--device", "sim"),
        ("fit",),
        ("report",),
        ("package", "build"),
        ("render", "--device", "sim", "--yes"),
    ):
        before = EmulatedSide.ticks
        said = cli(*words)
        assert said.code == 0, (words, said.out, said.err)
        if words[0] in ("device", "capture", "render"):
            assert EmulatedSide.ticks > before + 1000, words
    (rendered,) = workspace.recordings("render")
    assert rendered.stat().st_size > 0
    assert EmulatedSide.ticks > 10_000
    print(f"{EmulatedSide.ticks} ticks, {EmulatedSide.ticks / EmulatedSide.spent_s:.0f} a second")
    specimen = load_specimen(SPECIMEN)
    for what in ("friction", "cut"):
        for row in day.judge(fits.load_result(Engine.of(workspace), what), specimen):
            if row.truth is not None:
                sd = (row.high - row.low) / 3.29
                print(f"{row.name}: {(row.estimate - row.truth) / sd:+.2f} sd")
                assert abs(row.estimate - row.truth) <= MOST_SDS * sd, row
