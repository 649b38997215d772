"""Commands that speak to a rig: in virtual time, and through a real pseudo-terminal."""

import os
import pty
import re
from pathlib import Path

import numpy as np
import pytest

from scissorcal.device import Examination, Faults, LockstepLink, PortLink, SimProcess, diagnose
from tests.device.in_step import in_step, patient
from tests.device.test_doctor import SOUND
from tests.strange_device import Faults as StrangeFaults
from tests.strange_device import StrangeDevice, serve_on_pty

from .conftest import Cli, Said


@pytest.fixture
def quick(workspace: Path) -> Path:
    """The workspace, with a recipe that records little."""
    recipe = workspace / "recipe.toml"
    text = recipe.read_text()
    text = re.sub(r"speeds_rad_per_s = \[.*\]", "speeds_rad_per_s = [1.0]", text)
    text = text.replace("repeats = 2", "repeats = 1").replace(
        "excitation_s = 10.0", "excitation_s = 1.0"
    )
    text = text.replace("strokes_per_sheet = 4", "strokes_per_sheet = 1").replace(
        "sheets = 3", "sheets = 1"
    )
    recipe.write_text(text)
    return workspace


def test_captures_on_the_virtual_rig_fill_the_plan(quick: Path, cli: Cli) -> None:
    said = cli("capture", "friction", "--device", "sim", "--seed", "3", "--json")
    assert said.code == 0, said.err
    result = said.envelope["result"]
    assert result["samples"] > 2000
    assert result["coverage"]["share"] > 0
    (path,) = said.envelope["files"]
    assert Path(path).parent == quick / "captures"
    said = cli("capture", "cut", "--device", "sim")
    assert said.code == 0, said.err
    assert "cells filled" in said.out
    steps = cli("plan", "--json").envelope["result"]["steps"]
    assert [step["state"] for step in steps[:3]] == ["done", "done", "missing"]


def test_unplugged_while_capturing_keeps_what_was_recorded(
    quick: Path, cli: Cli, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert cli("device", "probe", "--device", "sim").code == 0

    class Unplugged(LockstepLink):
        def __init__(self, specimen: str, rng: np.random.Generator) -> None:
            super().__init__(specimen, rng, Faults(unplug_s=1.5))

    monkeypatch.setattr("scissorcal.device.lockstep.LockstepLink", Unplugged)
    assert_kept(cli("capture", "friction", "--device", "sim", "--json"), quick, cli)


def assert_kept(said: Said, folder: Path, cli: Cli) -> None:
    """A capture ended with a fault of the device, and says where its samples are."""
    assert said.code == 4
    kept = re.search(r"kept in (captures/friction-\S+\.mcap)\.", said.err)
    assert kept, said.err
    assert said.envelope["files"] == [str(folder / kept[1])]
    shown = cli("recording", "show", folder / kept[1], "--json").envelope["result"]["recording"]
    assert shown["samples"] > 500


@pytest.mark.realtime
def test_a_port_unplugged_while_capturing_keeps_what_was_recorded(quick: Path, cli: Cli) -> None:
    assert cli("device", "probe", "--device", "sim", "--realtime").code == 0
    with SimProcess("office-paper", faults=["unplug=1.5"]) as sim:
        said = cli("capture", "friction", "--device", sim.port, "--json")
    assert_kept(said, quick, cli)


@pytest.mark.parametrize("words", [["capture", "friction"], ["device", "doctor"], ["render"]])
def test_a_missing_port_is_a_device_fault(words: list[str], quick: Path, cli: Cli) -> None:
    said = cli(*words, "--device", "/dev/ttyNOWHERE", "--json")
    if words == ["render"]:
        assert said.code == 5
        assert "scissorcal package build" in said.err
        return
    assert said.code == 4
    assert "/dev/ttyNOWHERE" in said.envelope["result"]["error"]
    assert not list(quick.glob("captures/*.mcap*"))


def test_a_port_that_speaks_something_else_is_said_to(quick: Path, cli: Cli) -> None:
    master, slave = pty.openpty()
    try:
        os.write(master, b"login: \r\npassword: \r\n" * 20)
        said = cli("device", "doctor", "--device", os.ttyname(slave))
    finally:
        os.close(master)
        os.close(slave)
    assert said.code == 4
    assert "Traceback" not in said.err


def test_the_doctor_tells_what_it_measured(cli: Cli, monkeypatch: pytest.MonkeyPatch) -> None:
    patient(monkeypatch)
    examined: list[tuple[str, float]] = []

    def examine(link: PortLink, seconds: float, progress: object = None) -> Examination:
        examined.append((link.identity.serial, seconds))
        return Examination(SOUND, diagnose(SOUND, link.name))

    monkeypatch.setattr("scissorcal.device.doctor.examine", examine)
    monkeypatch.setattr("scissorcal.device.sim.process.SimProcess", in_step)
    said = cli("device", "doctor", "--device", "sim", "--seconds", "0.5", "--json")
    assert said.code == 0, said.err
    assert examined == [("office-paper", 0.5)]
    assert said.envelope["result"]["identity"]["name"] == "scissorcal-sim"
    assert {verdict["check"] for verdict in said.envelope["verdicts"]} >= {"round trip", "drift"}


@pytest.mark.realtime
def test_the_doctor_examines_the_virtual_rig(cli: Cli) -> None:
    said = cli("device", "doctor", "--device", "sim", "--seconds", "0.5", "--json")
    assert said.code in (0, 3)
    assert said.envelope["result"]["identity"]["name"] == "scissorcal-sim"
    assert said.envelope["verdicts"]


def test_a_rig_is_homed_by_command(cli: Cli) -> None:
    said = cli("device", "home", "--device", "sim", "--json")
    assert said.code == 0, said.err
    result = said.envelope["result"]
    assert result["homed"] is True
    assert result["seconds"] > 1.0


@pytest.mark.parametrize("words", [("device", "probe"), ("capture", "friction")])
def test_a_rig_that_is_not_homed_is_refused_with_the_command_that_homes(
    words: tuple[str, ...], quick: Path, cli: Cli, monkeypatch: pytest.MonkeyPatch
) -> None:
    class NotHomed(LockstepLink):
        def __init__(self, specimen: str, rng: np.random.Generator) -> None:
            super().__init__(specimen, rng, Faults(not_homed=True))

    monkeypatch.setattr("scissorcal.device.lockstep.LockstepLink", NotHomed)
    said = cli(*words, "--device", "sim")
    assert said.code == 4
    assert "scissorcal device home" in said.err
    assert cli("device", "home", "--device", "sim").code == 0


def test_homing_of_a_real_rig_asks_first(cli: Cli) -> None:
    device = StrangeDevice(StrangeFaults(not_homed=True), version=2)
    with serve_on_pty(device) as port:
        said = cli("device", "home", "--device", port)
        assert said.code == 2
        assert "Clear the space between the blades" in said.err
        assert not device._homed
        assert cli("device", "home", "--device", port, "--yes").code == 0
        assert device._homed


def test_ports_are_listed(cli: Cli) -> None:
    assert "sim" in cli("device", "list").out


def test_an_unknown_specimen_or_fault_is_named(cli: Cli) -> None:
    assert cli("device", "simulate", "granite").code == 2
    assert cli("device", "simulate", "--fault", "lightning=1").code == 2
