"""scissorcal recipe show"""

from pathlib import Path

from scissorcal.recipe import builtin_recipe, parse_recipe

from .conftest import Cli


def test_a_recipe_shown_with_its_defaults_is_the_same_recipe(cli: Cli, workspace: Path) -> None:
    said = cli("recipe", "show", "--defaults")
    assert said.code == 0
    assert parse_recipe(said.out) == builtin_recipe("paper-80gsm")
    assert "[fit.friction.priors.rotary]" in said.out
    assert "coulomb_Nm = { median = 0.02, factor_90 = 100.0 }  # default: Coulomb" in said.out
    assert "thickness_mm = 0.1  # recipe, line" in said.out
    (workspace / "recipe.toml").write_text(said.out)
    assert parse_recipe(cli("recipe", "show").out) == builtin_recipe("paper-80gsm")


def test_a_built_in_recipe_or_a_file_is_shown_without_a_workspace(cli: Cli, tmp_path: Path) -> None:
    named = cli("recipe", "show", "cotton-cloth", "--json").envelope["result"]
    assert named["recipe"] == "cotton-cloth"
    assert all(row["given"] for row in named["settings"])
    path = tmp_path / "mine.toml"
    path.write_text(cli("recipe", "show", "cotton-cloth").out)
    said = cli("recipe", "show", path, "--defaults", "--json").envelope["result"]
    rows = {row["key"]: row for row in said["settings"]}
    assert rows["fit.cut.priors.kappa"]["value"] == {"median": 0.7, "odds_factor_90": 5.2}
    assert rows["fit.cut.priors.kappa"]["origin"].startswith(
        "default: share of the fracture energy"
    )
    assert not rows["fit.cut.priors.kappa"]["given"]


def test_an_unknown_prior_is_refused_with_what_was_meant(cli: Cli, workspace: Path) -> None:
    recipe = workspace / "recipe.toml"
    table = "[fit.friction.priors.rotary]\nstribek_Nm = { median = 0.01, factor_90 = 3.0 }\n"
    recipe.write_text(f"{recipe.read_text()}\n{table}")
    said = cli("recipe", "show")
    assert said.code == 2
    assert (
        "fit.friction.priors.rotary.stribek_Nm: unknown key. Did you mean stribeck_Nm?" in said.err
    )
    missing = cli("recipe", "show", "no-such")
    assert missing.code == 2
    assert 'no recipe called "no-such"' in missing.err
