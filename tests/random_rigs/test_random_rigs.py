"""No healthy rig is accused, whatever its encoder, tick, delay and friction; wrong ones are named.

Thousands by `python -m tests.random_rigs --healthy 1000 --wrong 200`.
"""

from dataclasses import replace

import pytest

from .rigs import RigParameters, falls, healthy, wrong
from .trial import Trial, trial_of

NAMED_BY_HAND = {
    "encoder reversed": "the encoder is reversed",
    "both reversed": "the encoder is reversed",
    "counts x 2": "its counts per turn or its gear are wrong by a factor 2",
    "counts / 2": "its counts per turn or its gear are wrong by a factor 0.5",
    "zero off": "the zero of the encoder is wrong",
}
STILL = next(seed for seed in range(700, 800) if not falls(healthy(seed)))


def is_fair(trial: Trial) -> bool:
    """Right within four standard deviations, or not determined with what to do."""
    if trial.outcome == "right":
        return abs(trial.z) < 4.0
    return trial.outcome == "not determined"


FEW = [703, *(pytest.param(seed, marks=pytest.mark.slow) for seed in (700, 701, 702))]


@pytest.mark.parametrize("seed", FEW)
def test_a_healthy_rig_is_not_accused(seed: int) -> None:
    trial = trial_of(healthy(seed))
    assert is_fair(trial), trial


@pytest.mark.slow
def test_of_many_healthy_rigs_none_is_accused_and_intervals_hold() -> None:
    """12 rigs whose blades stay where they are left, of other seeds than those of development.

    Where the interval of inertia holds 85 %, fewer than 7 of 12 do in 1 of 200 runs.
    """
    seeds = [seed for seed in range(20_000, 20_060) if not falls(healthy(seed))][:12]
    found = [trial_of(healthy(seed)) for seed in seeds]
    assert not [trial for trial in found if trial.outcome == "named"]
    known = [trial for trial in found if trial.outcome == "right"]
    assert len(known) >= 10
    assert sum(trial.inside for trial in known) >= 0.55 * len(known)


@pytest.mark.parametrize("kind", NAMED_BY_HAND)
def test_what_a_pass_by_hand_shows_is_named_without_a_torque(kind: str) -> None:
    trial = trial_of(wrong(kind, STILL))
    assert NAMED_BY_HAND[kind] in trial.said
    assert trial.largest_rate == 0.0


def test_a_stuck_encoder_is_not_pushed_fast() -> None:
    trial = trial_of(wrong("stuck", STILL))
    assert trial.said
    assert trial.largest_rate <= 1.5


def test_a_reversed_motor_is_named_after_the_encoder_was_seen_right() -> None:
    trial = trial_of(wrong("motor reversed", STILL))
    assert "the motor is reversed (the encoder counts rightly" in trial.said


def test_lost_commands_are_named_at_zero_torque() -> None:
    trial = trial_of(wrong("5 % lost", STILL))
    assert "single commands did not arrive" in trial.said
    assert trial.largest_rate < 1e-3  # what has just been let go of settles


LOOSE = RigParameters(coulomb_opening=2e-3, coulomb_closing=2e-3, gravity=-0.012, seed=1)
"""Blades that fall to their closed stop."""


@pytest.mark.slow
def test_blades_that_fall_are_probed_off_their_stop() -> None:
    trial = trial_of(LOOSE)
    assert trial.outcome == "right"
    assert abs(trial.z) < 4.0
    assert trial.largest_rate <= 1.5


def test_a_reversed_motor_is_named_off_a_stop() -> None:
    assert "the motor is reversed" in trial_of(replace(LOOSE, motor_sign=-1.0)).said


def test_blades_that_nothing_takes_off_their_stop_accuse_nobody() -> None:
    trial = trial_of(replace(LOOSE, motor_gain=0.0))
    assert "Not determined: the blades stand at their closed stop" in trial.said


CREEPING, BOUNCING = 61_001, 61_026
"""Blades that creep under gravity: a fit with a delay below zero and a lag at its bound claimed
-38 %. Blades that stand on a stop after a rebound: one of several modes claimed -73 %."""


@pytest.mark.slow
@pytest.mark.parametrize("seed", [CREEPING, pytest.param(BOUNCING, marks=pytest.mark.slow)])
def test_inertia_far_off_has_no_narrow_interval(seed: int) -> None:
    trial = trial_of(healthy(seed))
    assert trial.outcome == "not determined" or abs(trial.z) < 3.0


SWINGING = 70_092
"""Blades that gravity still moves to and fro after five seconds, by 3 mrad (sd)."""


def test_blades_that_swing_are_no_encoder_that_jitters() -> None:
    trial = trial_of(healthy(SWINGING))
    assert "Not determined: the blades moved by" in trial.said


def test_a_hand_that_holds_the_blades_at_a_stop_feels_no_swing() -> None:
    """It presses with 0.12 N m: no push takes the blades off the stop, and nothing is claimed."""
    trial = trial_of(healthy(STILL), clings=True)
    assert "Not determined: the blades stand at their open stop" in trial.said
    assert "somebody holds them" in trial.said
    assert trial.largest_rate <= 0.3


@pytest.mark.slow
def test_a_person_who_opens_where_asked_to_close_is_asked_again() -> None:
    trial = trial_of(healthy(STILL), swaps=True)
    assert is_fair(trial)


@pytest.mark.slow
def test_a_person_who_does_nothing_leads_to_no_accusation() -> None:
    trial = trial_of(healthy(STILL), follows=False)
    assert is_fair(trial)
