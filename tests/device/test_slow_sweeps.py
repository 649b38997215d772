"""Slow sweeps on the virtual rig and a second one of other construction: made, or told as stuck."""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from scissorcal.calibration import steadiness
from scissorcal.device.capture import capture, open_writer
from scissorcal.device.capture_gains import Probed, capture_gains
from scissorcal.device.control import Axis, Gains, greatest_fall
from scissorcal.device.control_design import StribeckFall
from scissorcal.device.lockstep import LockstepLink
from scissorcal.device.probe.probe import probe
from scissorcal.device.session import RigSession
from scissorcal.recipe import Recipe
from scissorcal.recording import Recording, read_recording
from scissorcal.workday import with_usable_sweeps
from tests.device.recipes import changed
from tests.second_rig import Rig, draw_truth, fine, recipe_for
from tests.second_rig import capture_friction as capture_on_second_rig
from tests.second_rig.capture import identity_of
from tests.second_rig.parameters import Motor, Servo

SLOW = 0.05
SHORT = {"speeds_rad_per_s": (SLOW, 0.3), "repeats": 1, "excitation_s": 1.0}
TOML = 'format = "scissorcal-recipe/1"\n'
AS_STROKES = "cut"
"""Gains for strokes of a cut, which follow best and stand the least fall of friction."""


def at_rest(recording: Recording) -> float:
    return steadiness((recording,)).rows[0].at_rest


def spread_of_rate(recording: Recording, window_s: float = 0.02) -> float:
    """Standard deviation of the rate in the slowest sweeps, over their mean."""
    found = []
    slowest = min(stroke.speed for stroke in recording.strokes)
    for stroke in recording.strokes:
        if stroke.speed == slowest:
            opening = recording.samples["opening"][recording.samples["stroke"] == stroke.index]
            apart = round(window_s * 1e3)
            rate = (opening[apart:] - opening[:-apart]) / window_s
            inner = rate[len(rate) // 10 : -len(rate) // 10]
            found.append(float(inner.std() / slowest))
    return max(found)


def swept(folder: Path, recipe: Recipe, gains_of: str) -> Recording:
    """The recipe's sweeps on the virtual rig by a probe's gains, as the command captures them."""
    assert recipe.specimen is not None
    found = probe(RigSession(LockstepLink(recipe.specimen, np.random.default_rng(3)), recipe))
    link = LockstepLink(recipe.specimen, np.random.default_rng(4))
    if gains_of == AS_STROKES:
        gains = capture_gains(recipe, link.identity, "cut", Probed.of(found)).opening
        control = {
            "opening_kp_Nm_per_rad": gains.kp,
            "opening_kd_Nm_s_per_rad": gains.kd,
            "opening_ki_Nm_per_rad_s": gains.ki,
        }
        recipe = changed("paper-80gsm", capture__friction=SHORT, rig__control=control)
    else:
        recipe, _ = with_usable_sweeps(recipe, link.identity, found)
    with open_writer(
        RigSession(link, recipe, recipe_toml=TOML), "friction", folder / f"{gains_of}.mcap"
    ) as writer:
        capture(RigSession(link, recipe, probe=found), "friction", writer)
    return read_recording(folder / f"{gains_of}.mcap")


@pytest.mark.slow
def test_the_slowest_usable_sweeps_slide_where_slower_ones_stick(tmp_path: Path) -> None:
    recipe = changed("paper-80gsm", capture__friction=SHORT)
    stuck, slid = (swept(tmp_path, recipe, kind) for kind in (AS_STROKES, "friction"))
    assert at_rest(stuck) > 0.1
    assert spread_of_rate(stuck) > 0.4
    assert steadiness((stuck,)).steady_from == 0.3
    assert min(stroke.speed for stroke in slid.strokes) <= 2.0 * SLOW
    assert at_rest(slid) < 0.01
    assert spread_of_rate(slid) < 0.25
    assert steadiness((slid,)).verdict().status == "pass"


def servo_of(gains: Gains) -> Servo:
    """The second rig's cascade with the gains of a PID, nothing known of the mechanism beforehand.

    kd (rate wanted + p e - rate) and I times its integral are kp = kd p + I and ki = I p; an
    integral that no such p has is lowered to the largest that one has.
    """
    integral = min(gains.ki, 0.2499 * gains.kp**2 / gains.kd)
    position = (gains.kp + math.sqrt(gains.kp**2 - 4.0 * gains.kd * integral)) / (2.0 * gains.kd)
    return Servo(
        rate_gain=gains.kd,
        position_gain=position,
        integral_gain=integral / position,
        feed_inertia_kg_m2=0.0,
        feed_coulomb_Nm=0.0,
        feed_viscous_Nm_s_per_rad=0.0,
    )


def second_rig(seed: int) -> tuple[Rig, Recipe, Probed]:
    """A rig that answers 1.5 ms late, and what a probe would find of it."""
    late = replace(fine(), motor=Motor(delay_ticks=1.1, lag_ticks=0.4))
    rig = draw_truth(late, np.random.default_rng(seed), 0.2)
    friction, inertia = rig.mechanism.friction, rig.mechanism.inertia_kg_m2
    recipe = recipe_for(rig)
    listed = recipe.capture.friction.model_copy(update=SHORT)
    recipe = recipe.model_copy(
        update={"capture": recipe.capture.model_copy(update={"friction": listed})}
    )
    breakaway = (
        0.5 * (friction.coulomb_opening_Nm + friction.coulomb_closing_Nm) + friction.stribeck_Nm
    )
    probed = Probed(inertia, 0.03 * inertia, 2e-3, breakaway, 1.5e-3, (), 1e-4)
    return rig, recipe, probed


@pytest.mark.parametrize("seed", [401, pytest.param(402, marks=pytest.mark.slow)])
def test_the_second_rig_slides_as_the_greatest_fall_says(seed: int) -> None:
    rig, recipe, probed = second_rig(seed)
    friction = rig.mechanism.friction
    fall = StribeckFall(friction.stribeck_Nm, friction.stribeck_rate_rad_per_s)
    spread, stands = {}, {}
    for kind in (AS_STROKES, "friction"):
        gains = capture_gains(recipe, identity_of(rig), kind, probed)  # type: ignore[arg-type]
        servo = servo_of(gains.opening)
        recording, _ = capture_on_second_rig(
            replace(rig, servo=servo), recipe, np.random.default_rng(seed)
        )
        axis = Axis(
            probed.inertia_kg_m2,
            probed.viscous_Nm_s_per_rad,
            probed.coulomb_Nm,
            probed.latest_s,
            1e-3,
            identity_of(rig).opening_resolution,
            gains.rate_cutoff_Hz,
            1.0,
            probed.inertia_factor,
        )
        stands[kind] = fall.steepest <= greatest_fall(axis, gains.opening)
        spread[kind] = spread_of_rate(recording)
    assert stands == {AS_STROKES: False, "friction": True}
    assert spread[AS_STROKES] > 0.3
    assert spread["friction"] < 0.1
