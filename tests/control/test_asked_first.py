"""A plate that is tracked is put in before it is looked for, and looked for again."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from scissorcal.device import LockstepLink
from scissorcal.errors import DeviceError
from scissorcal.kernel import Capability, ConfigKey
from scissorcal.tracking import PlatePose, level_plate
from tests.control.virtual import Run, go, points, prepare, specimen

MATERIAL = 2.0


def tracked(monkeypatch: pytest.MonkeyPatch, source: Any, **plate: Any) -> Run:
    """A rig that says that it is real, its plate in place, on which a source looks for it."""
    link = LockstepLink(specimen(**plate), np.random.default_rng(1))
    real = int(link.identity.capabilities) & ~int(Capability.SIMULATOR)
    link.identity = link.identity._replace(capabilities=real)
    run = prepare(points(20.0, 40.0), link=link)
    run.job = replace(run.job, source=lambda now_s, samples: source(run, now_s), tracked=True)
    link.configure(ConfigKey.MATERIAL, MATERIAL)
    return run


def at(x_mm: float, now_s: float, sd_mm: float = 0.0, why: str = "") -> PlatePose:
    covariance = (1e-3 * sd_mm) ** 2 * np.eye(6)
    return PlatePose(now_s, *level_plate((x_mm, 10.0, 0.0)), covariance, tracked=not why, why=why)


def test_the_tip_is_lowered_where_the_plate_is_by_then(monkeypatch: pytest.MonkeyPatch) -> None:
    """It was 12 mm away when it was first seen."""
    places: list[float] = []

    def source(run: Run, now_s: float) -> PlatePose:
        places.append(run.link.rig.advance)
        return at(32.0 if len(places) == 1 else 20.0, now_s)

    run = go(tracked(monkeypatch, source), monkeypatch)
    assert run.result is not None
    over_old, over_new = places[1], places[2]
    assert over_old - over_new == pytest.approx(0.012, abs=1e-3)
    assert run.result.figures.reached_share == 1.0


@pytest.mark.parametrize(
    ("later", "words"),
    [
        (lambda now_s: at(20.0, now_s, why="hidden by a hand"), "hidden by a hand"),
        (lambda now_s: at(20.0, now_s, sd_mm=2.0), r"uncertain by .* was not lowered"),
        (lambda now_s: None, "the tip was not lowered"),
    ],
)
def test_a_plate_that_was_lost_meanwhile_is_not_touched(
    later: Any, words: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked: list[float] = []

    def source(run: Run, now_s: float) -> PlatePose | None:
        asked.append(now_s)
        return at(20.0, now_s) if len(asked) == 1 else later(now_s)

    run = tracked(monkeypatch, source)
    with pytest.raises(DeviceError, match=words):
        go(run, monkeypatch)
    assert len(asked) == 2
    assert max(run.truth.normal_N) == 0.0
