"""The filter in the second world: consistent where statements hold, not without its parts."""

from dataclasses import replace

import numpy as np
import pytest
from benchmarks.consistency import mean_band, share_held
from benchmarks.second_world import ROWS, SURFACES, follow, judge, runs, settings_of

from . import SHAPES, Scene, draw_world

RUNS = 16
SEEDS = range(500_000, 500_000 + RUNS)
MOST = {"fixed": 0.5, "carried by hand": 0.2, "on springs": 0.2}
"""Contact's median error along the normal over vision's: some twice what 50 runs gave."""


@pytest.mark.slow
@pytest.mark.parametrize(
    "case",
    [("plane", name) for name in MOST] + [("sphere 30 mm", "fixed")],
    ids=", ".join,
)
def test_the_filter_is_consistent_in_a_world_it_was_not_made_in(case: tuple[str, str]):
    """Mean NEES over 16 runs in the band that holds a consistent filter with 99.9 %.

    False alarms: 0.1 % a mean, 0.8 % over all eight. A hand moves more smoothly than the filter's
    process, which makes the filter cautious there, so that its lower edge is not asked.
    """
    both = runs(case, SEEDS)
    low, high = mean_band(RUNS, share=0.999)
    for part in both:
        mean = float(np.mean([run.nees for run in part]))
        assert mean < high
        assert mean > low or case[1] == "carried by hand"
    vision, contact = (float(np.median([abs(run.normal_m) for run in part])) for part in both)
    assert contact < MOST[case[1]] * vision


@pytest.mark.slow
def test_without_the_rigs_bias_the_filter_claims_too_much():
    """Mean NEES over 10 runs of 20 s on a ball: 14.9 without, 7.4 with, in worlds drawn before.

    A consistent filter is above the first limit once in 1,000 times. The ball's rig errs by more
    than a constant, so that 1.5 times that limit is asked of the whole filter.
    """
    scene = Scene(seconds=20.0)
    whole = settings_of(scene)
    none = replace(whole.contact, turn_bias_rad=0.0, place_bias_m=0.0)
    scores: dict[bool, list[float]] = {False: [], True: []}
    for seed in range(510_000, 510_010):
        world = draw_world(scene, SHAPES["sphere 30 mm"], np.random.default_rng(seed))
        for told in scores:
            settings = whole if told else replace(whole, contact=none)
            tracker = follow(world, SURFACES["sphere 30 mm"], settings, contacts=True)
            scores[told].append(judge(world, tracker).nees)
    _, high = mean_band(10, share=0.998)
    assert np.mean(scores[False]) > high
    assert np.mean(scores[True]) < min(1.5 * high, 0.8 * np.mean(scores[False]))
    assert share_held(scores[True]) > share_held(scores[False])


def test_a_run_gives_a_pose_and_the_same_again():
    scene = replace(ROWS["carried by hand"], seconds=1.0)
    world = draw_world(scene, SHAPES["plane"], np.random.default_rng(8))
    first, second = (
        judge(world, follow(world, SURFACES["plane"], settings_of(scene), contacts=True))
        for _ in range(2)
    )
    assert first == second
    assert abs(first.normal_m) < 1e-3
