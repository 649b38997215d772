"""A scene is asked for what it needs and for nothing else."""

from scissorcal.recipe.load import builtin_recipe, parse_recipe, recipe_path
from scissorcal.recipe.requirements import Requirement, requirements

PAPER = recipe_path("paper-80gsm").read_text(encoding="utf-8")


def names(items: tuple[Requirement, ...]) -> list[str]:
    return [item.name for item in items]


def test_a_cutting_scene_needs_all_tables() -> None:
    needs = requirements(builtin_recipe("paper-80gsm"))
    assert names(needs.captures) == ["friction", "cut"]
    assert names(needs.fits) == ["friction", "cut"]
    assert names(needs.tables) == ["edge", "response", "fracture", "friction"]


def test_pressing_needs_neither_toughness_nor_fracture() -> None:
    recipe = builtin_recipe("press-only")
    needs = requirements(recipe)
    assert recipe.fit.cut.toughness_J_per_m2 is None
    assert "fracture" not in names(needs.tables)
    assert "fracture" in names(needs.left_out)
    assert "cut" in names(needs.fits)
    assert all("toughness" not in item.why for item in needs.fits)


def test_friction_that_is_not_rendered_is_fitted_but_not_shipped() -> None:
    recipe = parse_recipe(PAPER.replace("render_friction = true", "render_friction = false"))
    needs = requirements(recipe)
    assert needs.needs_capture("friction")
    assert "friction" in names(needs.fits)
    assert "friction" not in names(needs.tables)
    assert "friction table" in names(needs.left_out)


def test_a_linear_joint_has_friction_only() -> None:
    recipe = parse_recipe(PAPER.replace("[rig]", '[rig]\njoint = "linear"'))
    needs = requirements(recipe)
    assert names(needs.captures) == names(needs.fits) == ["friction"]
    assert not needs.tables
