"""Strokes on offer, and the recipe that a designed list becomes."""

import numpy as np
import pytest

from scissorcal.calibration import (
    CaptureList,
    choose_captures,
    expected_cut,
    expected_friction,
    first_captures,
)
from scissorcal.device import cut_plan, friction_plan
from scissorcal.package import torque_knowledge
from scissorcal.recipe import Recipe, builtin_recipe, parse_recipe, with_designed_captures
from scissorcal.workday.stock import (
    capture_stock,
    designed_recipe,
    nominal_identity,
    seconds_at_rig,
)

LIST = CaptureList((1.0, 0.05, 0.3, 1.0), ((0.1, 0.6), (0.6, 0.1), (0.6, 0.6)))


def closing(recipe: Recipe, kind: str) -> list[float]:
    plan = friction_plan if kind == "friction" else cut_plan
    strokes = plan(recipe, nominal_identity(recipe)).strokes
    return [stroke.speed for stroke in strokes if stroke.kind in ("closing", "press")]


def test_a_list_becomes_a_recipe_that_plans_just_these_strokes() -> None:
    recipe = designed_recipe(builtin_recipe("cotton-cloth"), LIST)
    # The second sweep begins in the middle: it closes in two strokes. The fourth opens so.
    assert closing(recipe, "friction") == [0.05, 0.3, 0.3, 1.0, 1.0]
    assert closing(recipe, "cut") == [0.1, 0.6, 0.6, 0.1, 0.6, 0.6]


def test_what_a_list_lacks_stays_as_the_recipe_has_it() -> None:
    recipe = builtin_recipe("cotton-cloth")
    assert designed_recipe(recipe, CaptureList()) == recipe
    only = designed_recipe(recipe, CaptureList(speeds=(0.05, 1.0)))
    assert only.capture.cut == recipe.capture.cut


def test_the_text_of_a_designed_recipe_says_what_it_captures() -> None:
    from scissorcal.recipe import recipe_path

    text = recipe_path("paper-80gsm").read_text(encoding="utf-8")
    recipe = designed_recipe(parse_recipe(text), LIST)
    written = with_designed_captures(recipe, text)
    read = parse_recipe(written)
    assert read.capture.plan == "designed"
    assert read.model_copy(update={"capture": recipe.capture}) == recipe
    assert read.capture.friction == recipe.capture.friction
    assert read.capture.cut == recipe.capture.cut
    assert "sheets = 3  # designed" in written


@pytest.mark.parametrize(
    ("name", "designed"),
    [("cotton-cloth", True), ("press-only", True), ("paper-80gsm", False)],
)
def test_a_recipe_that_lists_its_captures_is_taken_at_its_word(name: str, designed: bool) -> None:
    capture = builtin_recipe(name).capture
    assert capture.designed("friction") is designed
    assert capture.designed("cut") is designed
    assert capture.model_copy(update={"plan": "designed"}).designed("cut")
    assert not capture.model_copy(update={"plan": "listed"}).designed("friction")


@pytest.mark.parametrize(
    "name", ["press-only", pytest.param("cotton-cloth", marks=pytest.mark.slow)]
)
def test_a_designed_list_takes_the_minutes_that_its_plan_takes(name: str) -> None:
    """The stock adds up strokes; the plan has their motion. Both count the same allowances."""
    recipe = builtin_recipe(name)
    friction = expected_friction(recipe)
    cut = expected_cut(recipe, friction)
    identity = nominal_identity(recipe)
    stock = capture_stock(recipe, identity, friction, cut)
    for scores in (one.information.scores for one in stock.sweeps.values()):
        values = np.linalg.eigvalsh(scores)
        assert values.min() > -1e-12 * values.max()
    least = first_captures(stock)
    wanted = designed_recipe(recipe, least)
    planned = sum(
        seconds_at_rig(wanted, plan(wanted, identity)) for plan in (friction_plan, cut_plan)
    )
    assert least.seconds(stock) == pytest.approx(planned, rel=0.1)
    found = choose_captures(torque_knowledge(recipe, friction, cut), stock)
    assert found.now.within < 0.5 < found.expected.within
    assert len(found.captures.speeds) >= 3
    assert len(found.captures.pieces) >= 2
