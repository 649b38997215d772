"""A plate that is moved while it is rendered: torque against that of the true plate."""

import csv
import math
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from scissorcal.aliases import Array
from scissorcal.device import LockstepLink, RigSession
from scissorcal.errors import MissingError
from scissorcal.kernel import SampleFlag
from scissorcal.package import ModelPackage
from scissorcal.recording import read_attachments, read_recording
from scissorcal.render import Rendering, RenderResult, VirtualStrokes, open_writer, render
from scissorcal.render.admission import rendered_tables
from scissorcal.render.pose_placer import FALL_S, STALE_S
from tests.render.plate_motion import Move, Tracker, true_torque

STROKES = VirtualStrokes(count=3, rate_rad_per_s=0.5)
BEGINS_S, TAKES_S = 7.0, 0.8
"""Within the third closing stroke, while the crack runs."""
GONE_S = (4.9, 5.25)
"""Within the second closing stroke."""
CLAIMED = np.array([6e-4, 6e-4, 6e-4, 1e-4, 1e-4, 1e-4])
BIAS = np.array([5e-4, 5e-4, 5e-4, 1e-4, 1e-4, 1e-4])
NOISE = np.array([1e-4, 1e-4, 1e-4, 1e-5, 1e-5, 1e-5])


def moved_plate(package: ModelPackage) -> Move:
    """By 10 mm along the cut and 5 degrees of pitch, about a point between the blades."""
    return Move(
        start_m=(0.0, package.tables.upper_face, 0.012),
        by_m=(-0.01, 0.0, 0.0),
        turn_rad=(0.0, 0.0, math.radians(5.0)),
        about_m=(0.06, 0.0, 0.0),
        begins_s=BEGINS_S,
        takes_s=TAKES_S,
    )


@dataclass(frozen=True)
class Run:
    """A rendering with its recording, and the torque that it should have had."""

    result: RenderResult
    samples: NDArray[np.void]
    true: Array

    @property
    def time(self) -> Array:
        return np.asarray(self.samples["host_time_ns"] * 1e-9)

    def error(self, from_s: float, to_s: float) -> float:
        """Relative rms error of the command while the blades close on material that they cut."""
        rate = np.gradient(self.samples["opening"], self.time)
        chosen = np.isfinite(self.true) & (self.true > 0.01) & (rate < -0.05)
        chosen &= (self.time >= from_s) & (self.time < to_s)
        assert np.sum(chosen) > 20
        off = self.samples["torque_command"][chosen] - self.true[chosen]
        return float(np.linalg.norm(off) / np.linalg.norm(self.true[chosen]))

    @property
    def errors(self) -> tuple[float, float, float]:
        """Before, during and after the move; the first stroke is ramped in."""
        ends = BEGINS_S + TAKES_S
        return self.error(4.0, BEGINS_S), self.error(BEGINS_S, ends), self.error(ends, 20.0)


def run(package: ModelPackage, tracker: Tracker, folder: Path, **options: Any) -> Run:
    """Render on the virtual rig; the truth is of the tracker's own plate unless ``truth`` is."""
    truth = options.pop("truth", tracker.move)
    path = folder / "r.mcap"
    link = LockstepLink("office-paper", np.random.default_rng(1))
    seconds, plate = options.pop("seconds", 20.0), options.pop("plate", tracker)
    session = RigSession(link, package.recipe, recipe_toml="# a recipe")
    with open_writer(session, package, path) as writer:
        how = Rendering(seconds, STROKES)
        result = render(session, package, how, writer=writer, plate=plate, **options)
    samples = read_recording(path).samples
    true = true_torque(rendered_tables(package.tables, result.admission), truth, samples, 8)
    return Run(result, samples, true)


def tracker_of(package: ModelPackage, **errors: Any) -> Tracker:
    return Tracker(moved_plate(package), np.random.default_rng(3), claimed=CLAIMED, **errors)


def test_the_torque_follows_a_plate_that_is_moved(
    upper_paper: ModelPackage, tmp_path: Path
) -> None:
    """A tracker without errors: exact at rest, behind by the 15 ms of the way while it moves."""
    found = run(upper_paper, tracker_of(upper_paper), tmp_path)
    before, during, after = found.errors
    assert max(before, after) < 2e-4
    assert 1e-3 < during < 0.02
    plate = found.result.plate
    assert plate is not None
    assert (plate.falls, plate.out_s, plate.sentences) == (0, 0.0, ())
    assert plate.estimates == pytest.approx(100 * found.result.seconds, rel=0.03)
    assert found.result.ledger.plate_J > 1e-3
    assert abs(found.result.ledger.unbooked_J) < 2e-3 * found.result.ledger.absorbed_J
    passive = next(v for v in found.result.verdicts if v.check == "passivity")
    assert passive.status == "pass"
    followed = next(v for v in found.result.verdicts if v.check == "plate pose")
    assert (followed.status, followed.value) == ("pass", 0.0)


def test_a_late_noisy_biased_tracker_keeps_the_tolerance(
    upper_paper: ModelPackage, tmp_path: Path
) -> None:
    """20 ms late, 10 um and 0.006 deg of white noise, 0.1 mm and 0.03 deg of bias."""
    tracker = tracker_of(upper_paper, late_s=0.02, sd=NOISE, bias=BIAS)
    found = run(upper_paper, tracker, tmp_path)
    assert all(error < 0.07 for error in found.errors)
    assert found.result.plate is not None
    assert found.result.plate.falls == 0
    assert found.result.plate.widest < 0.07
    slew = found.result.limits.torque_slew_Nm_per_s
    assert np.abs(np.diff(found.samples["torque_command"])).max() <= 1.001e-3 * slew


@pytest.mark.slow
def test_a_plate_that_is_taken_to_rest_is_wrong_by_half_of_the_torque(
    upper_paper: ModelPackage, tmp_path: Path
) -> None:
    """What the two tests above would find if the pose did not reach the torque."""
    still = replace(moved_plate(upper_paper), by_m=(0.0, 0.0, 0.0), turn_rad=(0.0, 0.0, 0.0))
    blind = Tracker(still, np.random.default_rng(3), claimed=CLAIMED)
    found = run(upper_paper, blind, tmp_path, truth=moved_plate(upper_paper))
    before, during, after = found.errors
    assert before < 2e-4
    assert min(during, after) > 0.3


def test_between_two_blades_the_edge_along_the_cut_is_followed(
    both_paper: ModelPackage, tmp_path: Path
) -> None:
    found = run(both_paper, tracker_of(both_paper, late_s=0.02, sd=NOISE, bias=BIAS), tmp_path)
    before, during, after = found.errors
    assert max(before, during, after) < 2e-3
    assert found.result.plate is not None
    assert found.result.plate.falls == 0


@pytest.mark.parametrize("how", ["lost", "silent"])
def test_a_plate_that_is_lost_lets_the_force_fall_in_time_and_return_by_ramp(
    how: str, upper_paper: ModelPackage, tmp_path: Path
) -> None:
    """Lost while the blades cut: no force after 0.1 s, or 0.2 s without any news."""
    begins, ends = GONE_S

    def gone(now_s: float) -> bool:
        return GONE_S[0] <= now_s < GONE_S[1]

    tracker = tracker_of(upper_paper, **{how: gone})
    found = run(upper_paper, tracker, tmp_path)
    late_s = STALE_S if how == "silent" else 0.0
    fallen_s = late_s + FALL_S + 0.015
    torque, time = found.samples["torque_command"], found.time
    out = (time > begins + fallen_s) & (time < ends)
    assert np.abs(torque[(time > begins - 0.1) & (time < begins)]).min() > 0.01
    assert np.sum(out) > 50
    assert np.all(torque[out] == 0.0)
    assert np.all((found.samples["flags"][out] & int(SampleFlag.PLATE_OUT)) != 0)
    ramp = found.result.limits.engagement_ramp_s
    back = (time > ends) & (time < ends + ramp)
    full = np.nanmax(found.true[(time > begins) & (time < 6.0)])
    share = (time[back] - ends + 0.015) / ramp
    assert np.all(np.abs(torque[back]) <= share * full)
    assert np.abs(torque[back]).max() > 0.1 * full
    falling = (time > begins - 0.05) & (time < begins + fallen_s)
    assert np.abs(np.diff(torque[falling])).max() < 0.03 * full
    assert found.error(BEGINS_S + TAKES_S, 20.0) < 2e-4
    plate = found.result.plate
    assert plate is not None
    assert plate.falls == 1
    assert plate.out_s == pytest.approx(ends - begins + ramp - late_s, abs=0.04)
    said = "the target is hidden" if how == "lost" else "No new estimate of the plate's pose"
    assert len(plate.sentences) == 1
    assert said in plate.sentences[0]
    assert plate.sentences[0] in found.result.warnings
    assert abs(found.result.ledger.unbooked_J) < 5e-3 * found.result.ledger.absorbed_J


def test_a_pose_that_is_too_uncertain_is_not_rendered(
    upper_paper: ModelPackage, tmp_path: Path
) -> None:
    tracker = Tracker(moved_plate(upper_paper), np.random.default_rng(3), claimed=8.0 * CLAIMED)
    path = tmp_path / "r.mcap"
    link = LockstepLink("office-paper", np.random.default_rng(1))
    with open_writer(RigSession(link, upper_paper.recipe), upper_paper, path) as writer:
        result = render(
            RigSession(link, upper_paper.recipe),
            upper_paper,
            Rendering(3.0, strokes=STROKES),
            writer=writer,
            plate=tracker,
        )
    assert not read_recording(path).samples["torque_command"].any()
    assert result.plate is not None
    assert result.plate.uncertain == result.plate.estimates > 250
    verdict = next(v for v in result.verdicts if v.check == "plate pose")
    assert verdict.status == "fail"
    assert "the scene allows 7.0%" in verdict.why
    assert any("the scene allows 7.0%" in note for note in read_recording(path).notes)


def test_what_was_placed_is_in_the_recording(upper_paper: ModelPackage, tmp_path: Path) -> None:
    tracker = tracker_of(upper_paper)
    run(upper_paper, tracker, tmp_path, seconds=2.0)
    attached = {each.name: each for each in read_attachments(tmp_path / "r.mcap")}
    rows = list(csv.DictReader(attached["plate-0001.csv"].data.decode().splitlines()))
    assert len(rows) == pytest.approx(205, abs=10)
    assert {row["usable"] for row in rows} == {"1"}
    assert float(rows[0]["edge_y_m"]) == pytest.approx(upper_paper.tables.upper_face, rel=1e-6)
    assert tracker.samples >= 1990


def test_a_known_plate_asks_no_tracker(silent_paper: ModelPackage) -> None:
    tracker = Tracker(Move((0.5, 0.5, 0.0)), np.random.default_rng(1))
    link = LockstepLink("office-paper", np.random.default_rng(1))
    result = render(
        RigSession(link, silent_paper.recipe),
        silent_paper,
        Rendering(1.0, strokes=STROKES),
        plate=tracker,
    )
    assert tracker.asked == 0
    assert result.plate is None


def test_no_pose_at_all_is_refused_before_anything_moves(upper_paper: ModelPackage) -> None:
    link = LockstepLink("office-paper", np.random.default_rng(1))
    with pytest.raises(MissingError, match="or give the pose of a tracker"):
        render(RigSession(link, upper_paper.recipe), upper_paper, Rendering(1.0))
    assert link.virtual_time < 0.1
