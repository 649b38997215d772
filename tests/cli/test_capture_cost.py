"""What a capture costs: never less than its plan takes, and refused where nobody can mean it."""

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from scissorcal.device import Plan, advance_plan, cut_plan, friction_plan
from scissorcal.errors import InputError
from scissorcal.recipe import (
    CaptureKind,
    Recipe,
    builtin_recipe,
    capture_cost,
    parse_recipe,
    refuse_long,
)
from scissorcal.workday import nominal_identity

from .conftest import Cli

PLANS = {"friction": friction_plan, "cut": cut_plan, "friction-advance": advance_plan}
NAMES = ("paper-80gsm", "cotton-cloth", "press-only", "paper-photographed")


def planned(recipe: Recipe, kind: CaptureKind) -> Plan:
    return PLANS[kind](recipe, nominal_identity(recipe))


def handling_s(recipe: Recipe, kind: CaptureKind) -> float:
    pieces = recipe.capture.cut.sheets if kind == "cut" and recipe.scene.cut else 1
    return recipe.capture.handling_s * pieces


@pytest.mark.parametrize("kind", PLANS)
@pytest.mark.parametrize("name", NAMES)
def test_a_plan_takes_no_longer_than_its_cost_says(name: str, kind: CaptureKind) -> None:
    recipe = builtin_recipe(name)
    motion_s = 60.0 * capture_cost(recipe, kind).minutes - handling_s(recipe, kind)
    assert planned(recipe, kind).duration_s <= motion_s
    if recipe.scene.cut:
        assert motion_s < 1.5 * planned(recipe, kind).duration_s


@given(
    speeds=st.lists(st.floats(0.02, 3.0), min_size=1, max_size=4),
    repeats=st.integers(1, 4),
    strokes=st.integers(1, 6),
)
def test_no_list_takes_longer_than_its_cost_says(
    speeds: list[float], repeats: int, strokes: int
) -> None:
    recipe = builtin_recipe("paper-80gsm")
    capture = recipe.capture.model_copy(
        update={
            "friction": recipe.capture.friction.model_copy(
                update={"speeds_rad_per_s": tuple(speeds), "repeats": repeats}
            ),
            "cut": recipe.capture.cut.model_copy(
                update={
                    "speeds_rad_per_s": tuple(speeds),
                    "sheets": repeats,
                    "strokes_per_sheet": strokes,
                }
            ),
        }
    )
    changed = recipe.model_copy(update={"capture": capture})
    for kind in ("friction", "cut"):
        cost_s = 60.0 * capture_cost(changed, kind).minutes  # type: ignore[arg-type]
        assert planned(changed, kind).duration_s <= cost_s  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("old", "new", "named"),
    [
        ("speeds_rad_per_s = [0.05, 0.12", "speeds_rad_per_s = [1e-6, 0.12", "30.7 days"),
        ("speeds_rad_per_s = [0.05, 0.12", "speeds_rad_per_s = [1e-300, 0.12", "e+295 days"),
        ("repeats = 2", "repeats = 1000", "1,051 min"),
    ],
)
def test_a_capture_that_nobody_means_is_refused_before_anything_moves(
    workspace: Path, cli: Cli, old: str, new: str, named: str
) -> None:
    path = workspace / "recipe.toml"
    text = path.read_text(encoding="utf-8")
    assert old in text
    path.write_text(text.replace(old, new, 1), encoding="utf-8")
    assert named in cli("plan").out
    said = cli("capture", "friction", "--device", "sim")
    assert said.code == 2
    assert "capture.friction" in said.err
    assert named in said.err
    assert not list((workspace / "captures").glob("*.mcap*"))
    slow = parse_recipe(
        text.replace("\nspeeds_rad_per_s = [0.05", "\nspeeds_rad_per_s = [1e-6", 1), "recipe.toml"
    )
    with pytest.raises(InputError, match="correct the speeds"):
        planned(slow, "friction")


def test_a_long_capture_may_be_meant_and_a_full_disk_is_told() -> None:
    recipe = builtin_recipe("paper-80gsm")
    friction = recipe.capture.friction.model_copy(update={"repeats": 500})
    capture = recipe.capture.model_copy(update={"friction": friction})
    cost = capture_cost(recipe.model_copy(update={"capture": capture}), "friction")
    with pytest.raises(InputError, match="--yes-long"):
        refuse_long(cost, 1e12)
    refuse_long(cost, 1e12, meant=True)
    with pytest.raises(InputError, match=r"1\.0 MB left"):
        refuse_long(cost, 1e6, meant=True)
