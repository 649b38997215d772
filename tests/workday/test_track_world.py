"""Tracks on rendered pictures and a virtual rig's contacts, against the world's truth."""

import numpy as np
import pytest
from scipy.stats import chi2

from scissorcal.workday.tracking.sim_world import SimCamera
from tests.workday.track_world import a_recipe, score, tracked

SEEDS = 6
MOVES = ("speed_mm_per_s = 5", "turn_deg_per_s = 1")


def test_contact_tells_the_height_that_pictures_leave_open() -> None:
    recipe = a_recipe()
    session, world, end = tracked(recipe, 3, 2.6, rig=True, camera=SimCamera(4.0))
    assert session.follower.state == "fused"
    value, error = score(session, world, end)
    assert value < chi2.ppf(0.9999, 6)
    fused = session.follower.tracker.estimate().covariance
    seen = session.follower.pictures[0]
    shared = np.array(session.about.shared)
    assert np.sqrt(fused[4, 4]) < 0.6 * np.sqrt(shared[4, 4]), "the rig's y is the plate's normal"
    assert np.sqrt(fused[5, 5]) > 0.85 * np.sqrt(shared[5, 5]), "contact says nothing along it"
    assert abs(error[4]) < 0.3e-3
    noise = np.diag(seen.covariance)[3:].max()
    assert noise < 1e-2 * np.diag(shared)[3:].max(), "a picture is far better than what all share"


@pytest.mark.slow
@pytest.mark.parametrize("moves", [False, True])
def test_tracks_are_consistent_with_and_without_contact(moves: bool) -> None:
    """Mean NEES of 6 worlds below the 99.9 % quantile of its chi-square; the height better told.

    Each world has a camera and a rig frame of its own, off as their covariances say.
    """
    recipe = a_recipe(*MOVES) if moves else a_recipe()
    heights = {}
    for rig in (False, True):
        runs = []
        for seed in range(SEEDS):
            session, world, end = tracked(recipe, seed, 2.6 if rig else 1.2, rig=rig)
            runs.append(score(session, world, end))
        values = [value for value, _ in runs]
        assert np.mean(values) < chi2.ppf(0.999, 6 * SEEDS) / SEEDS
        if not moves:  # a plate that sways keeps its velocity longer than the filter expects
            assert np.mean(values) > chi2.ppf(0.0005, 6 * SEEDS) / SEEDS
        heights[rig] = np.sqrt(np.mean([error[4] ** 2 for _, error in runs]))
    assert heights[True] < 0.6 * heights[False]
