"""A specimen whose blade has a wave: the virtual camera says that it cannot draw it."""

from pathlib import Path

import pytest

from scissorcal.device.sim import specimen as specimens
from scissorcal.errors import InputError
from scissorcal.recipe import builtin_recipe
from scissorcal.workday.demo import photographs
from scissorcal.workday.demo.photographs import specimen_blade
from tests.device.sim.build import specimen


def test_a_wave_is_not_photographed_as_a_line(monkeypatch: pytest.MonkeyPatch) -> None:
    wavy = specimen(blade={"wave_mm": [(0, 0), (40, 0.5), (75, 0)]})
    monkeypatch.setattr(photographs, "load_specimen", lambda name: wavy)
    with pytest.raises(InputError, match=r"has a wave \(blade\.wave_mm\)"):
        specimen_blade(builtin_recipe("paper-80gsm"))


def test_a_specimens_file_may_have_a_wave(tmp_path: Path) -> None:
    text = (specimens.specimen_path("office-paper")).read_text(encoding="utf-8")
    wave = "length_mm = 75.0\nwave_mm = [[0, 0], [20, 0.4], [40, 0], [75, -0.2]]"
    path = tmp_path / "wavy.toml"
    path.write_text(text.replace("length_mm = 75.0", wave), encoding="utf-8")
    found = specimens.load_specimen(path).blade.wave
    assert found is not None
    assert found.at(0.02) == pytest.approx((4e-4, found.at(0.02)[1]))
