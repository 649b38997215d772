"""``--axis advance``: capture, fit and verification of the carriage, and what is refused."""

from pathlib import Path

import pytest

from .conftest import Cli

SHORT = """
[capture.friction_advance]
speeds_mm_per_s = [30.0, 80.0]
repeats = 1
excitation_s = 3.0

[fit.friction_advance]
law = "coulomb+viscous"
symmetry = "symmetric"
"""


@pytest.fixture
def quick(workspace: Path) -> Path:
    with (workspace / "recipe.toml").open("a", encoding="utf-8") as file:
        file.write(SHORT)
    return workspace


def test_a_carriage_is_captured_fitted_and_reported(quick: Path, cli: Cli) -> None:
    said = cli("capture", "friction", "--axis", "advance", "--device", "sim", "--json")
    assert said.code == 0, said.err
    result = said.envelope["result"]
    assert result["coverage"]["speeds_m_per_s"] == [0.03, 0.08]
    assert len(result["coverage"]["advance_cells_m"]) == 8
    (path,) = said.envelope["files"]
    assert Path(path).name.startswith("friction-advance-2")
    assert "commanded force" in said.err
    listed = cli("recording", "list")
    assert "forward at 80 mm/s" in listed.out
    assert "ranges of advance" in listed.out
    shown = cli("recording", "show", path)
    assert "friction-advance, rotary joint" in shown.out
    assert "forward" in shown.out
    fitted = cli("fit", "friction", "--axis", "advance", "--effort", "draft", "--json")
    assert fitted.code == 0, fitted.err
    (fit,) = fitted.envelope["result"]["fits"]
    assert fit["what"] == "friction-advance"
    means = {row["name"]: row["mean"] for row in fitted.envelope["result"]["parameters"]}
    assert means["inertia"] == pytest.approx(0.8, rel=0.02)
    assert means["coulomb"] == pytest.approx(0.8, rel=0.02)
    again = cli("fit", "friction", "--axis", "advance", "--effort", "draft")
    assert "friction-advance: nothing changed since the last fit" in again.out
    assert "'scissorcal verify friction --axis advance'" in again.out
    plan = cli("plan")
    assert "fit friction-advance" in plan.out
    assert "on request: the scene does not need it" in plan.out
    assert cli("report").code == 0
    logged = cli("fit", "log", "friction-advance", "--json").envelope["result"]["versions"]
    assert [version["what"] for version in logged] == ["friction-advance"]


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("capture", "friction", "--designed", "--device", "sim"), "--designed"),
        (("capture", "friction", "--until-tolerance", "--device", "sim"), "--until-tolerance"),
        (("verify", "cut"), "--axis advance is of friction"),
        (("verify",), "--axis advance is of friction"),
    ],
)
def test_what_does_not_go_with_the_carriage_is_refused(
    words: tuple[str, ...], said: str, quick: Path, cli: Cli
) -> None:
    found = cli(*words, "--axis", "advance")
    assert found.code == 2
    assert said in found.err


def test_a_fit_without_a_capture_names_it(quick: Path, cli: Cli) -> None:
    found = cli("fit", "friction", "--axis", "advance")
    assert found.code == 5
    assert "scissorcal capture friction --axis advance --device PORT" in found.err


def test_the_days_plan_does_not_ask_for_it(workspace: Path, cli: Cli) -> None:
    assert "advance" not in cli("plan").out
