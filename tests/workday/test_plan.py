"""The plan names every step in order, and the next command."""

from pathlib import Path

from scissorcal.workday.plan import make_plan
from scissorcal.workday.workspace import create_workspace


def test_a_new_workspace_lacks_everything(tmp_path: Path) -> None:
    plan = make_plan(create_workspace(tmp_path / "work", "paper-80gsm"))
    assert [step.name for step in plan.steps] == [
        "capture friction",
        "capture cut",
        "fit friction",
        "fit cut",
        "verify friction",
        "verify cut",
        "report",
        "report sign",
        "package build",
        "render",
    ]
    assert {step.state for step in plan.steps} == {"missing"}
    assert plan.next_command == "scissorcal capture friction --device PORT"


def test_pressing_asks_for_no_fracture(tmp_path: Path) -> None:
    plan = make_plan(create_workspace(tmp_path / "work", "press-only"))
    assert "fracture" not in [item.name for item in plan.tables]
    assert "fracture" in [item.name for item in plan.left_out]
    cut = next(step for step in plan.steps if step.name == "fit cut")
    assert cut.why == "response only"
