"""The choice of a capture's parts from fits: how it begins, and what it says of its end."""

from dataclasses import replace

import numpy as np
import pytest

from scissorcal.calibration import expected_band
from scissorcal.device import Part
from scissorcal.package import torque_knowledge
from scissorcal.recipe import Recipe, builtin_recipe
from scissorcal.recording import Joint, Recording, Stroke, UntilMark, empty_samples
from scissorcal.workday.stock import EXCITATION_S
from scissorcal.workday.until import (
    NO_FIT,
    Earlier,
    Limits,
    UntilTolerance,
    largest_cause,
    shares_used,
)
from tests.calibration.design.test_choice import known, tells
from tests.device.conftest import IDENTITY

RECIPE = builtin_recipe("paper-80gsm")
NOTHING = Recording("friction", empty_samples(1), joint=Joint())


def test_friction_begins_with_three_speeds_and_an_excitation() -> None:
    choose = UntilTolerance("friction", RECIPE, IDENTITY, Earlier(), Limits(4.0))
    part = choose(NOTHING, 0.0)
    assert part is not None
    ways = ["closing", "opening"] * 2 + ["closing"] + ["closing", "opening"]
    assert [stroke.kind for stroke in part.strokes] == [*ways, "excitation"], (
        "the second turns midway"
    )
    speeds = [stroke.speed for stroke in part.strokes if stroke.kind == "closing"]
    assert speeds == sorted(speeds)
    assert set(speeds) <= set(choose.recipe.capture.friction.speeds_rad_per_s)
    excited = np.count_nonzero(part.segment.reference.stroke == 7)
    assert excited == pytest.approx(1000 * EXCITATION_S, rel=0.01)
    (mark,) = choose.marks
    assert (mark.strokes, mark.within, mark.ended) == (0, None, "")


def test_no_sweep_is_slower_than_the_rig_makes_steadily() -> None:
    choose = UntilTolerance(
        "friction", RECIPE, IDENTITY, Earlier(), Limits(4.0, slowest_sweep=0.083)
    )
    assert min(choose.recipe.capture.friction.speeds_rad_per_s) == 0.083
    part = choose(NOTHING, 0.0)
    assert part is not None
    assert min(stroke.speed for stroke in part.strokes if np.isfinite(stroke.speed)) == 0.083


def test_strokes_that_cannot_be_fitted_use_up_their_minutes_and_say_why() -> None:
    """Samples without motion: the fit refuses them, and the capture goes on until its limit."""
    choose = UntilTolerance("friction", RECIPE, IDENTITY, Earlier(), Limits(1.0))
    recorded, parts = NOTHING, 0
    while (part := choose(recorded, 0.0)) is not None:
        parts += 1
        recorded = replace(recorded, strokes=(*recorded.strokes, *part.strokes))
    last = choose.marks[-1]
    assert last.ended == "time"
    assert last.within is None
    assert "cannot be fitted" in last.why
    assert parts < 10


def scene(**changed: object) -> Recipe:
    return RECIPE.model_copy(update={"scene": RECIPE.scene.model_copy(update=changed)})


def after_a_failed_fit(recipe: Recipe) -> tuple[UntilMark, Part | None]:
    """What follows sweeps that were fitted, and one more with which they cannot be."""
    choose = UntilTolerance("friction", recipe, IDENTITY, Earlier(), Limits(60.0))
    part = choose(NOTHING, 0.0)
    assert part is not None
    told = [offer.information for offer in choose._stock.sweeps.values()]
    knowledge = choose._friction.knowledge.plus(sum(told[1:], told[0]))
    choose._friction = replace(choose._friction, knowledge=knowledge)
    following = choose(replace(NOTHING, strokes=part.strokes), 0.0)
    return choose.marks[-1], following


def test_a_failed_fit_within_the_tolerance_ends_the_capture_and_says_why() -> None:
    mark, following = after_a_failed_fit(scene(tolerance_percent=50.0))
    assert following is None
    assert mark.ended == "no fit"
    assert not mark.reached
    assert mark.why.startswith("The strokes so far cannot be fitted")
    assert len(mark.why) > len(NO_FIT) + 10


def test_after_a_failed_fit_nothing_is_said_to_be_out_of_reach() -> None:
    """Its band is that of fewer strokes; further ones are taken."""
    mark, following = after_a_failed_fit(scene(tolerance_percent=0.01))
    assert mark.ended == ""
    assert following is not None


def test_friction_that_is_not_rendered_is_judged_by_what_was_measured() -> None:
    """The cut's offsets change no torque before a cut is known: friction's own level counts."""
    recipe = scene(render_friction=False)
    choose = UntilTolerance("friction", recipe, IDENTITY, Earlier(), Limits(4.0))
    known = torque_knowledge(recipe, choose._friction, choose._cut)
    assert not choose._judge(known).reached
    told = [offer.information for offer in choose._stock.sweeps.values()]
    assert choose._judge(known.plus(sum(told[1:], told[0]))).reached


def test_sweeps_count_by_what_the_fit_used_of_them() -> None:
    samples = empty_samples(100)
    samples["stroke"][:40], samples["stroke"][40:60], samples["stroke"][60:80] = 0, 1, 2
    strokes = (Stroke(0, "closing", 0.1), Stroke(1, "opening", 0.1), Stroke(2, "closing", 0.5))
    recorded = Recording("friction", samples, (*strokes, Stroke(3, "excitation")))
    spans = np.array([[0, 10], [45, 50], [60, 80], [90, 100]])
    assert shares_used(recorded, spans) == {0.1: 0.25, 0.5: 1.0}


def test_the_largest_cause_is_named_with_the_command_that_lowers_it() -> None:
    friction = known(tolerance=0.05).plus(tells(9.0), tells(1e8, 3))
    assert "scissorcal capture friction" in largest_cause(friction)
    law = replace(tells(1e8, 3), errors={"loading": np.array([1e8, 0.0, 0.0])})
    told = known(tolerance=0.05).plus(tells(1e8), law)
    told = replace(told, cut=replace(told.cut, error_shares={"loading": 0.1}))
    assert "fit.cut.lack_of_fit_percent" in largest_cause(told)
    few = known(tolerance=0.05).plus(tells(1e8), tells(9.0, 3))
    assert not expected_band(few).reached
    assert "fresh pieces" in largest_cause(few)
