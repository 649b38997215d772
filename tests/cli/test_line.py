"""The recipe's line reaches the device; the option --baud goes before it."""

from unittest.mock import patch

import pytest

from scissorcal.kernel import ConfigKey
from scissorcal.recipe import Line
from scissorcal.workday import line_of, open_rig
from tests.device.in_step import in_step, patient
from tests.device.recipes import changed

from .conftest import Cli


def test_the_option_goes_before_the_recipe() -> None:
    recipe = changed("paper-80gsm", rig__line={"baud": 460800, "brake_after_ms": 25.0})
    assert line_of(recipe, None) == Line(baud=460800, brake_after_ms=25.0)
    assert line_of(recipe, 2_000_000) == Line(baud=2_000_000, brake_after_ms=25.0)


@pytest.mark.parametrize("keys", [{"baud": 300}, {"brake_after_ms": 0.5}, {"brake_after_ms": 2000}])
def test_impossible_lines_are_refused(keys: dict[str, object]) -> None:
    with pytest.raises(ValueError, match="line"):
        changed("paper-80gsm", rig__line=keys)


def test_an_impossible_rate_is_refused_in_a_sentence(cli: Cli) -> None:
    said = cli("device", "doctor", "--device", "sim", "--baud", "5")
    assert said.code == 2
    assert "'--baud': It must be greater than or equal to 9600." in said.err


def test_the_device_is_told_how_long_to_wait(monkeypatch: pytest.MonkeyPatch) -> None:
    patient(monkeypatch)
    told: list[tuple[int, float]] = []

    def note(self: object, key: int, value: float) -> float:
        told.append((key, value))
        return value

    with in_step() as sim:
        with patch("scissorcal.device.link.PortLink.configure", note):
            with open_rig(sim.port, None, line=Line(brake_after_ms=25.0)):
                pass
            with open_rig(sim.port, None):
                pass
        with patch("scissorcal.device.link.open_port", side_effect=ValueError("none")) as opened:
            slow = Line(baud=115200)
            with pytest.raises(ValueError, match="none"), open_rig(sim.port, None, line=slow):
                pass
            assert opened.call_args.args == (sim.port, 115200)
    assert told == [(ConfigKey.BRAKE_AFTER_MS, 25.0)]
