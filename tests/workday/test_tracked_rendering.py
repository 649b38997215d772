"""A rendering on a plate that the tracker follows by pictures and taps, while it is moved."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tests.render.conftest import package_for
from tests.workday.carried_plate import Case, run

CASE = Case("hand", speed_mm_per_s=5.0, turn_deg_per_s=2.0)


@pytest.mark.slow
def test_a_tapped_plate_is_rendered_within_the_tolerance_while_it_moves(tmp_path: Path) -> None:
    """Moved by 10 mm and 5 degrees in a second; 0.5, 3.4 and 0.9 % in the middle of four worlds."""
    package = package_for(tmp_path, CASE.recipe, energy=0.52)
    for seed in (0, 3):
        found = run(CASE, seed, package, tmp_path)
        (before, out), (during, _), (after, out_after) = map(found.error, found.windows)
        assert max(before, after) < 0.03
        assert 0.005 < during < 0.07, "it lags, and does not lose the plate"
        assert max(out, out_after) < 0.1
        rms, sd = found.pose_error("after")
        assert rms[4] < 0.1e-3, "the height that the taps told is carried along"
        assert np.all(rms < 4.0 * sd)
        assert found.session.follower.tracker.estimate().counts.restarts == 0
        plate = found.result.plate
        assert plate is not None
        assert plate.lost == plate.leapt == plate.unreachable == 0


@pytest.mark.slow
def test_pictures_alone_leave_more_than_the_tolerance_open(tmp_path: Path) -> None:
    """One moving blade needs the height; the sentence says so and what helps."""
    case = replace(CASE, taps=False)
    package = package_for(tmp_path, case.recipe, energy=0.52)
    found = run(case, 0, package, tmp_path)
    error, out = found.error("before")
    assert np.isnan(error)
    assert out == 1.0
    plate = found.result.plate
    assert plate is not None
    assert plate.uncertain > 500
    assert any("touch the plate with the blades" in said for said in plate.sentences)


@pytest.mark.slow
def test_without_play_the_noise_of_pictures_cuts(tmp_path: Path) -> None:
    """At rest, many times as much error; the scene allows any uncertainty here."""
    wide = replace(CASE, speed_mm_per_s=8.0, turn_deg_per_s=3.0, tolerance_percent=100.0)
    package = package_for(tmp_path, wide.recipe, energy=0.52)
    held = run(wide, 3, package, tmp_path).error("before")[0]
    (tmp_path / "3.mcap").unlink()
    free = run(replace(wide, steady=False), 3, package, tmp_path).error("before")[0]
    assert held < 0.01
    assert free > 0.03
