"""Figures and verdicts of a track: what is refused, inconsistent, or told by no clock."""

import math
from dataclasses import replace

import numpy as np
import pytest
from benchmarks.control.pose_run import settings_for
from benchmarks.control.world import Scenario

from scissorcal.model import Plane
from scissorcal.tracking.follow import PoseFollower
from scissorcal.tracking.judge import RowCounts, TrackFigures, track_figures, track_verdicts
from scissorcal.tracking.rows import CameraPose, TipContact

COUNTS = RowCounts(used=100, refused=2, late=0, waiting=0, mean_nis=6.1, freedom=6)
NONE = RowCounts(used=0, refused=0, late=0, waiting=0, mean_nis=math.nan, freedom=1)
FIGURES = TrackFigures(COUNTS, NONE, 0, None, None, None, math.nan, math.nan)


def status(figures: TrackFigures) -> dict[str, str]:
    return {verdict.check: verdict.status for verdict in track_verdicts(figures)}


def why(figures: TrackFigures, check: str) -> str:
    return next(v.why for v in track_verdicts(figures) if v.check == check)


def test_what_was_not_given_is_not_judged() -> None:
    assert status(FIGURES) == {
        "clock jumps": "not_evaluated",
        "refused pictures": "pass",
        "refused contacts": "not_evaluated",
        "picture consistency": "pass",
        "contact consistency": "not_evaluated",
    }


def test_many_refused_pictures_name_both_causes() -> None:
    figures = replace(FIGURES, pictures=replace(COUNTS, refused=20))
    assert status(figures)["refused pictures"] == "fail"
    assert "16.7 % of the pictures were refused" in why(figures, "refused pictures")
    assert "speed_mm_per_s" in why(figures, "refused pictures")


def test_contacts_away_from_the_surface_are_told_in_mm_against_their_sd() -> None:
    contacts = RowCounts(used=10, refused=90, late=0, waiting=0, mean_nis=100.0, freedom=1)
    figures = replace(FIGURES, contacts=contacts, away_mm=4.2, away_sd_mm=0.11)
    assert status(figures)["refused contacts"] == "fail"
    text = why(figures, "refused contacts")
    assert "the last was 4.2 mm outside of the surface, where 0.11 mm (sd) were expected" in text
    assert status(figures)["contact consistency"] == "fail"


def test_errors_larger_than_stated_fail_the_consistency() -> None:
    figures = replace(FIGURES, pictures=replace(COUNTS, mean_nis=13.0))
    assert status(figures)["picture consistency"] == "fail"
    assert "The mean NIS is 13, where 6 are expected" in why(figures, "picture consistency")


def test_figures_are_those_of_what_was_given() -> None:
    settings = settings_for(Scenario("fixed"))
    follower = PoseFollower(Plane(), settings, rig=True)
    time = 1e-3 * np.arange(1, 1001)
    follower.samples(5.0 + time, time, *[np.zeros(1000)] * 3)
    rng = np.random.default_rng(0)
    for number in range(60):
        at = number / 30.0
        place = 1e-3 * rng.standard_normal(3)
        doubt = number < 2
        follower.picture(
            CameraPose(at, np.eye(3), place, 1e-6 * np.eye(6), certain=not doubt), at + 0.06
        )
    figures = track_figures(follower)
    assert figures.pictures.used + figures.pictures.refused == 58
    assert figures.pictures.waiting == 2
    assert 2.0 < figures.pictures.mean_nis < 4.0, "turns without errors: half of the numbers"
    follower._contact(TipContact(7.0, np.array([0.0, 0.0, 0.02]), 2.0))
    figures = track_figures(follower)
    assert figures.contacts.refused == 1
    assert figures.away_mm == pytest.approx(20.0, abs=2.0)
    assert figures.rig is not None
    assert "The rig's clock runs" in figures.rig.sentence
    assert "ppm are the limit" in why(figures, "clock jumps")
