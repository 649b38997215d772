"""What is done with estimates of the plate's pose: judged, placed, told, counted, recorded."""

import csv
import math
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from scissorcal.errors import MissingError
from scissorcal.kernel import SAMPLE_DTYPE, ModelTables, Section
from scissorcal.package import ModelPackage, PoseRecord
from scissorcal.recording import RecordingWriter, read_attachments
from scissorcal.render.pose_placer import (
    BACK_SHARE,
    ROW_NAMES,
    ROWS_A_TABLE,
    PoseLog,
    PosePlacer,
    plate_config,
    pose_placer,
)
from scissorcal.render.pose_section import PoseTorque, pose_section
from scissorcal.tracking import PlatePose
from tests.kernel.zoo import make_tables
from tests.render.plate_motion import FLAT, turned

UPPER = make_tables(moving_blades=1, upper_face=1e-4)
SD = np.array([5e-4, 5e-4, 5e-4, 5e-5, 5e-5, 5e-5])
NO_SAMPLES: NDArray[np.void] = np.zeros(0, dtype=SAMPLE_DTYPE)


class Bench:
    """A follower on a stand that only notes what is placed; time is ours."""

    def __init__(self, tables: ModelTables = UPPER, **options: Any) -> None:
        self.now_s = 100.0
        self.placed: list[tuple[Section, bool, float]] = []
        self.next: PlatePose | None = None
        given = {"tolerance": 0.07, "confidence": 0.95, "torque_limit_Nm": 1.0} | options
        self.follower = PosePlacer(lambda now, samples: self.next, tables, **given)

    def place(self, section: Section, usable: bool, age_s: float) -> None:
        self.placed.append((section, usable, age_s))

    def see(self, estimate: PlatePose | None, after_s: float = 0.01) -> bool:
        """Follow one estimate; whether it was used."""
        self.now_s += after_s
        self.next = estimate
        before = len(self.placed)
        self.follower.follow(self, NO_SAMPLES)
        return len(self.placed) > before and self.placed[-1][1]

    def at(self, x: float = 0.0, y: float = 1e-4, sd: float = 1.0, **changes: Any) -> PlatePose:
        """An estimate of now, at a place and with so many times SD."""
        turn = turned(np.array(changes.pop("turn", (0.0, 0.0, 0.0))))
        covariance = np.diag((sd * SD) ** 2)
        place = np.array([x, y, 0.0])
        return replace(PlatePose(self.now_s + 0.01, turn @ FLAT, place, covariance), **changes)

    @property
    def said(self) -> str:
        return " ".join(self.follower.report(1.0, 0.0).sentences)


def test_an_estimate_is_placed_with_its_age() -> None:
    bench = Bench()
    assert bench.see(replace(bench.at(x=0.01), time=bench.now_s - 0.03))
    section, _, age = bench.placed[-1]
    assert section == Section(0.01, 1e-4)
    assert age == pytest.approx(0.04)
    assert bench.follower.report(1.0, 0.5).estimates == 1
    assert bench.follower.report(1.0, 0.5).out_s == 0.5
    assert bench.said == ""


def test_the_same_estimate_is_placed_once() -> None:
    bench = Bench()
    estimate = bench.at()
    assert bench.see(estimate)
    assert not bench.see(estimate)
    assert len(bench.placed) == 1


def test_a_lost_plate_lets_the_force_fall_and_says_why() -> None:
    bench = Bench()
    bench.see(bench.at())
    assert not bench.see(bench.at(tracked=False, why="a hand hides the target"))
    assert "lost: a hand hides the target. Keep" in bench.said
    assert bench.see(bench.at())
    assert not bench.see(bench.at(tracked=False))
    report = bench.follower.report(1.0, 0.0)
    assert (report.lost, report.falls, len(report.sentences)) == (2, 2, 1)


def test_an_uncertain_pose_is_refused_with_its_figures_and_returns_below_the_tolerance() -> None:
    bench = Bench()
    assert bench.see(bench.at())
    width = bench.follower.report(1.0, 0.0).widest
    wide, near = 1.05 * 0.07 / width, 0.9 * 0.07 / width
    assert 0.0 < width < 0.035
    assert not bench.see(bench.at(sd=wide))
    assert not bench.see(bench.at(sd=near))
    assert bench.see(bench.at(sd=0.95 * BACK_SHARE * 0.07 / width))
    assert bench.see(bench.at(sd=near))
    said = bench.said
    assert f"{wide * 0.05:.2g} mm along the cut" in said
    assert f"{math.degrees(wide * 5e-4):.2g} deg in pitch" in said
    assert "the scene allows 7.0%" in said
    assert "scene.tolerance_percent" in said
    assert bench.follower.report(1.0, 0.0).uncertain == 2


def test_what_contributes_most_is_named() -> None:
    high, tilted = Bench(), Bench()
    only = np.zeros((6, 6))
    only[4, 4] = 1e-3**2
    high.see(high.at(covariance=only))
    assert "Most of it comes from its height" in high.said
    only = np.zeros((6, 6))
    only[2, 2] = 0.05**2
    tilted.see(tilted.at(covariance=only))
    assert "Most of it comes from its pitch" in tilted.said


def test_a_pose_that_leaps_is_waited_for() -> None:
    bench = Bench()
    for _ in range(5):
        assert bench.see(bench.at())
    assert not bench.see(bench.at(x=0.02))
    used = [bench.see(bench.at(x=0.02)) for _ in range(12)]
    assert not any(used[:9])
    assert all(used[11:])
    assert "leapt by 20.0 mm" in bench.said
    assert bench.follower.report(1.0, 0.0).falls == 1


def test_a_plate_that_is_moved_by_hand_does_not_leap() -> None:
    bench = Bench()
    assert all(bench.see(bench.at(x=0.005 * k)) for k in range(20))


def test_silence_is_told_once() -> None:
    bench = Bench()
    bench.see(None)
    bench.see(None, after_s=0.2)
    assert "No estimate of the plate's pose has come" in bench.said
    bench.see(bench.at())
    for _ in range(20):
        bench.see(None, after_s=0.02)
    assert "No new estimate of the plate's pose came for 0.1" in bench.said
    assert len(bench.follower.report(1.0, 0.0).sentences) == 2
    assert not bench.see(replace(bench.at(), time=bench.now_s - 0.15))


def test_a_plate_across_the_blades_is_told() -> None:
    bench = Bench()
    assert not bench.see(bench.at(turn=(0.0, 1.2, 0.0)))
    assert "across the blades" in bench.said
    assert bench.follower.report(1.0, 0.0).unreachable == 1


@pytest.mark.parametrize(
    ("y", "pitch_deg", "used"),
    [
        (5e-5, 0.0, True),
        (0.009, 0.0, True),
        (0.011, 0.0, False),
        (5e-5, 4.0, True),
        (5e-5, 11.0, False),
        (0.008, 4.0, False),
    ],
)
def test_two_blades_hold_a_plate_only_near_their_middle(
    y: float, pitch_deg: float, used: bool
) -> None:
    bench = Bench(make_tables())
    assert bench.see(bench.at(y=y, turn=(0.0, 0.0, math.radians(pitch_deg)))) == used
    assert used or "taken to hold it in their middle" in bench.said
    one = Bench()
    assert one.see(one.at(y=y, turn=(0.0, 0.0, math.radians(min(pitch_deg, 4.0)))))


def drawn_sd(change: Callable[[NDArray[np.float64]], float], sd: NDArray[np.float64]) -> float:
    """Standard deviation of torque over poses drawn from a covariance."""
    rng = np.random.default_rng(11)
    return float(np.std([change(sd * rng.standard_normal(6)) for _ in range(4000)]))


@pytest.mark.parametrize("cuts", [True, False])
def test_the_spread_of_torque_is_that_of_drawn_poses(cuts: bool) -> None:
    """Within 5 %: 4000 draws know a standard deviation to 1.1 %."""
    tables = UPPER if cuts else replace(UPPER, fracture_energy=0.0)
    torque = PoseTorque(tables, 0.95, 10.0)
    rotation = turned(np.array([0.02, 0.03, 0.04])) @ FLAT
    place = np.array([-0.006, 1e-4, 0.003])

    def section(step: NDArray[np.float64]) -> Any:
        found = pose_section(turned(step[:3]) @ rotation, place + step[3:], 1e-4, 1)
        assert found is not None
        return found

    here = section(np.zeros(6))
    covariance = here.slopes @ np.diag(SD**2) @ here.slopes.T
    spread = torque.spread(here.section, covariance, 0.4, -0.02)
    exact = torque._placed
    drawn = drawn_sd(lambda step: exact.torque(section(step).section, 0.4, -0.02, 0.0), SD)
    assert drawn > 1e-4 * spread.torque_Nm > 0.0
    assert spread.sd_Nm == pytest.approx(drawn, rel=0.05)
    assert spread.half_width == pytest.approx(1.96 * spread.sd_Nm / spread.torque_Nm, rel=1e-3)


def test_a_constant_error_along_the_cut_does_not_move_the_torque_of_a_cut() -> None:
    covariance = np.zeros((5, 5))
    covariance[0, 0] = 1e-3**2
    cut = PoseTorque(UPPER, 0.95, 10.0).spread(Section(0.0, 1e-4), covariance, 0.4, -0.02)
    pressed = PoseTorque(replace(UPPER, fracture_energy=0.0), 0.95, 10.0)
    assert cut.sd_Nm < 1e-3 * cut.torque_Nm
    assert pressed.spread(Section(-0.005, 1e-4), covariance, 0.4, -0.02).half_width > 0.1


def test_poses_whose_torque_is_not_defined_are_uncertain() -> None:
    torque = PoseTorque(UPPER, 0.95, 1.0)
    wide = np.diag([0.0, 0.0, 3.0**2, 0.0, 0.0])
    assert torque.spread(Section(0.0, 1e-4), wide, 0.4, -0.02).half_width == math.inf
    bench = Bench()
    assert not bench.see(bench.at(covariance=np.full((6, 6), np.nan)))


def test_faces_over_which_the_release_falls_are_found() -> None:
    config = plate_config(UPPER)
    assert config.is_estimated
    assert config.face_low < UPPER.upper_face < config.face_high


def test_estimates_are_attached_to_the_recording_a_minute_each(tmp_path: Path) -> None:
    path = tmp_path / "r.mcap"
    found = pose_section(FLAT, [0.012, 1e-4, 0.0], 1e-4, 1)
    assert found is not None
    with RecordingWriter(path, "render") as writer:
        record = PoseLog(writer)
        for k in range(ROWS_A_TABLE + 10):
            record.add(0.01 * k, found, k % 2 == 0)
        record.flush()
        record.flush()
        writer.append(np.zeros(1, dtype=SAMPLE_DTYPE))
    first, second = read_attachments(path)
    assert (first.name, second.name) == ("plate-0001.csv", "plate-0002.csv")
    rows = list(csv.DictReader(second.data.decode().splitlines()))
    assert tuple(rows[0]) == ROW_NAMES
    assert len(rows) == 10
    assert float(rows[1]["time_s"]) == pytest.approx(0.01 * (ROWS_A_TABLE + 1))
    assert (float(rows[1]["edge_x_m"]), rows[1]["usable"]) == (0.012, "0")


def test_a_package_with_a_known_pose_follows_nothing(paper: ModelPackage) -> None:
    assert paper.manifest.plate_pose == "known"
    assert pose_placer(paper, lambda now, samples: None, paper.tables, 1.0) is None


def posed(package: ModelPackage, frame: Any) -> ModelPackage:
    """The package with a fitted pose in a frame."""
    rows = tuple(tuple(row) for row in np.diag(SD**2).tolist())
    record = PoseRecord(
        frame=frame,
        quaternion=(math.sqrt(0.5), -math.sqrt(0.5), 0.0, 0.0),
        translation_m=(0.004, 1e-4, 0.012),
        covariance=rows,
        target="plate board",
        inputs_hash="",
    )
    return replace(package, manifest=package.manifest.model_copy(update={"plate": record}))


def test_without_a_tracker_the_fitted_pose_is_followed(upper_paper: ModelPackage) -> None:
    assert upper_paper.manifest.plate_pose == "estimated"
    follower = pose_placer(posed(upper_paper, "rig"), None, upper_paper.tables, 1.0)
    assert follower is not None
    bench = Bench()
    follower.follow(bench, NO_SAMPLES)
    section, usable, age = bench.placed[-1]
    assert (section.edge_x, section.pitch, age) == (0.004, pytest.approx(0.0, abs=1e-9), 0.0)
    assert section.edge_y == pytest.approx(1e-4)
    assert usable


@pytest.mark.parametrize("frame", [None, "camera"])
def test_an_estimated_plate_without_any_pose_is_missing(
    upper_paper: ModelPackage, frame: str | None
) -> None:
    package = posed(upper_paper, frame) if frame else upper_paper
    with pytest.raises(MissingError, match="scissorcal capture plate"):
        pose_placer(package, None, upper_paper.tables, 1.0)
