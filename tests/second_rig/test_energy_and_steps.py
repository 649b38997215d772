"""The integrator of the second rig: energy is kept, and its step decides nothing."""

from dataclasses import replace

import numpy as np
import pytest

from tests.second_rig import (
    Blades,
    Material,
    Rig,
    Timeline,
    capture_cut,
    capture_friction,
    coarse,
    cotton,
    driven_timeline,
    fine,
    pad,
    paper,
    recipe_for,
    run,
    smooth,
)
from tests.second_rig.simulate import SERVO

SHARE = 2e-6
"""Energy that may appear or vanish, as a share of what the motors and the hand have put in."""


def two_slopes() -> Material:
    return paper(law="two_slopes", knee_m=0.1e-3, knee_ratio=3.0, damping_s_per_m=0.1)


def bent(blades: Blades) -> Blades:
    return replace(blades, curvature_per_m=0.3, cubic_per_m2=2.0)


@pytest.mark.parametrize(
    ("rig", "hand"),
    [
        (fine(), False),
        (coarse(cotton()), False),
        (smooth(fine(paper(correlation="gaussian"))), False),
        (fine(pad()), False),
        (replace(fine(two_slopes()), blades=bent(Blades(moving="upper"))), False),
        (fine(cotton(kappa=0.97)), False),
        (coarse(), True),
    ],
    ids=["fine", "coarse-cotton", "smooth", "pad", "two-slopes-bent-upper", "fine-teeth", "hand"],
)
def test_energy_is_conserved(rig: Rig, hand: bool) -> None:
    recipe = recipe_for(rig, sheets=1)
    _, books = capture_cut(rig, recipe, np.random.default_rng(5), hand=hand)
    rows = books.rows
    put_in = np.abs(np.diff(rows["motor_work"] + rows["hand_work"])).sum()
    assert put_in > 0.02
    assert np.abs(books.imbalance).max() < SHARE * put_in
    cut = rows["cut_work"] + rows["sledge_cut_work"]
    kept = rows["stored"] + rows["fracture"] + rows["arrest"]
    assert np.abs(cut + kept).max() < SHARE * put_in
    for loss in ("sledge_friction_work", "fracture", "arrest", "damping_work"):
        assert np.diff(rows[loss]).min() > -1e-7, loss
    friction = rig.mechanism.friction
    most = np.abs(rows["friction_torque"]).max() * friction.presliding_rad
    lost = rows["friction_work"]
    given_back = np.maximum.accumulate(lost) - lost
    assert given_back.max() < most  # what bristles store, they may give back


def test_empty_sweeps_keep_energy_too() -> None:
    rig = coarse()
    _, books = capture_friction(rig, recipe_for(rig), np.random.default_rng(5))
    put_in = np.abs(np.diff(books.rows["motor_work"])).sum()
    assert np.abs(books.imbalance).max() < SHARE * put_in
    assert not books.rows["cut_torque"].any()


def part_of_a_cut(rig: Rig, ticks: int) -> Timeline:
    from scissorcal.device import cut_plan
    from tests.second_rig import identity_of

    whole = driven_timeline(cut_plan(recipe_for(rig, sheets=1), identity_of(rig)))
    kept = {name: getattr(whole, name)[:ticks] for name in whole.__dataclass_fields__}
    assert np.all(kept["mode"] == SERVO)
    return Timeline(**kept)


def test_the_result_does_not_depend_on_the_step() -> None:
    rig = fine(paper(variation=0.0))
    rig = replace(rig, sensors=replace(rig.sensors, counts_per_turn=10**12, sledge_step_m=0.0))
    timeline = part_of_a_cut(rig, 3500)
    found = {}
    for step_s in (2.5e-4, 1.25e-4, 6.25e-5, 1.5625e-5):
        found[step_s] = run(replace(rig, step_s=step_s), timeline, np.random.default_rng(1))
    exact = found.pop(1.5625e-5)
    errors = []
    for books in found.values():
        assert len(books.jumps) == len(exact.jumps) > 50
        errors.append(np.abs(books.rows["opening"] - exact.rows["opening"]).max())
        assert np.allclose(books.jumps["opening"], exact.jumps["opening"], atol=2e-7)
        assert books.rows["cut_work"][-1] == pytest.approx(exact.rows["cut_work"][-1], rel=1e-4)
    assert errors[0] < 5e-6
    assert errors[0] > 4.0 * errors[1] > 16.0 * errors[2]
