"""One state, one next step: in the plan, after every command, and on the report's page."""

from collections.abc import Mapping
from pathlib import Path

import pytest

from scissorcal.report import read_twin
from scissorcal.workday.engine import Engine
from scissorcal.workday.next_step import next_command, next_step
from scissorcal.workday.options import FitOptions
from scissorcal.workday.plan import make_plan
from scissorcal.workday.runs.fit import fit_workspace
from scissorcal.workday.runs.package import build_workspace_package, current_verdict
from scissorcal.workday.runs.report import write_workspace_report
from scissorcal.workday.runs.sign import sign_report
from scissorcal.workday.states import State, StepState
from scissorcal.workday.steps import STEPS
from scissorcal.workday.workspace import Workspace
from tests.workday.made import fitted_copy

SIGN = "scissorcal report sign --name NAME --decision accept"
FITTED: Mapping[str, State] = {
    "capture friction": "done",
    "capture cut": "done",
    "fit friction": "unverified",
    "fit cut": "unverified",
}
VERIFIED: Mapping[str, State] = {
    **FITTED,
    "fit friction": "done",
    "fit cut": "done",
    "verify friction": "done",
    "verify cut": "done",
}
REPORTED: Mapping[str, State] = {**VERIFIED, "report": "done"}
PHOTOGRAPHS = ("capture camera", "capture blade", "fit camera", "fit blade")


def states(found: Mapping[str, State], photographs: bool = False) -> tuple[StepState, ...]:
    """The steps of a scene with a cut; what is not named is missing."""
    return tuple(
        StepState(
            step.name,
            found.get(step.name, "missing"),
            "",
            command=step.command,
            optional=step.optional,
        )
        for step in STEPS
        if not step.on_request
        and "plate" not in step.name
        and (photographs or step.name not in PHOTOGRAPHS)
    )


@pytest.mark.parametrize(
    ("found", "command"),
    [
        ({}, "scissorcal capture friction --device PORT"),
        ({"capture friction": "done"}, "scissorcal capture cut --device PORT"),
        ({**FITTED, "fit cut": "missing"}, "scissorcal fit cut"),
        (FITTED, "scissorcal verify"),
        ({**FITTED, "report": "done"}, "scissorcal verify"),
        ({**FITTED, "report": "done", "package build": "done"}, "scissorcal verify"),
        (VERIFIED, "scissorcal report"),
        (REPORTED, SIGN),
        ({**REPORTED, "report sign": "done"}, "scissorcal package build"),
        ({**REPORTED, "report sign": "done", "package build": "done"}, None),
        # who signed an unverified fit decided so: a verification would void that signature
        ({**FITTED, "report": "done", "report sign": "done"}, "scissorcal package build"),
        # a verification in part was the user's choice
        (
            {**FITTED, "verify friction": "incomplete", "verify cut": "incomplete"},
            "scissorcal report",
        ),
    ],
)
def test_the_order_of_the_day(found: Mapping[str, State], command: str | None) -> None:
    assert next_command(states(found)) == command


def test_photographs_that_were_begun_are_finished_first() -> None:
    begun: dict[str, State] = {"capture camera": "done"}
    assert next_command(states({}, photographs=True)) == "scissorcal capture friction --device PORT"
    assert next_command(states(begun, photographs=True)) == (
        "scissorcal capture blade --image blade-*.jpg"
    )
    begun["capture blade"] = "done"
    assert next_command(states(begun, photographs=True)) == "scissorcal fit camera"
    begun |= {"fit camera": "done", "fit blade": "done"}
    assert next_command(states(begun, photographs=True)) == (
        "scissorcal capture friction --device PORT"
    )


def test_a_linear_joint_is_never_asked_to_cut() -> None:
    found: dict[str, State] = {"capture friction": "done"}
    assert next_command(states(found), linear=True) == "scissorcal fit friction"
    found |= {"fit friction": "done", "verify friction": "done", "report": "done"}
    assert next_command(states(found), linear=True) == SIGN
    assert next_command(states({**found, "report sign": "done"}), linear=True) is None


def test_plan_page_signature_and_package_agree(
    tmp_path_factory: pytest.TempPathFactory, tmp_path: Path
) -> None:
    workspace: Workspace = fitted_copy(
        tmp_path_factory, tmp_path_factory.mktemp("next") / "paper", "friction", "cut"
    )
    fit_workspace(workspace, (), FitOptions())

    def following() -> str | None:
        engine = Engine.of(workspace)
        assert make_plan(workspace).next_command == next_step(engine)
        return next_step(engine)

    assert following() == "scissorcal verify"
    write_workspace_report(Engine.of(workspace))
    panel = read_twin(workspace.report_json.read_bytes()).panel("decision-trust")
    assert panel is not None
    assert panel.sentence == f"Next: `{following()}`."
    page = workspace.report_html.read_bytes()
    sign_report(Engine.of(workspace), "A. Reviewer", "accept")
    write_workspace_report(Engine.of(workspace), anew=True)
    assert Engine.of(workspace).state("report sign").state == "done", "the page is what was signed"
    assert workspace.report_html.read_bytes() != page, "it shows the signature"
    assert following() == "scissorcal package build"
    build_workspace_package(Engine.of(workspace))
    assert following() is None


def test_a_package_whose_fits_are_gone_is_not_called_current(
    tmp_path_factory: pytest.TempPathFactory,
) -> None:
    workspace: Workspace = fitted_copy(
        tmp_path_factory, tmp_path_factory.mktemp("gone") / "paper", "friction", "cut"
    )
    build_workspace_package(Engine.of(workspace))
    assert current_verdict(Engine.of(workspace)).status == "pass"
    fit = workspace.fit_path("friction").read_bytes()
    fit_workspace(workspace, ("friction",), FitOptions(seed=7, force=True))
    assert current_verdict(Engine.of(workspace)).status == "fail"
    workspace.fit_path("friction").write_bytes(fit)
    workspace.fit_path("friction").unlink()
    verdict = current_verdict(Engine.of(workspace))
    assert verdict.status == "not_evaluated"
    assert "'scissorcal fit friction'" in verdict.why
    check = workspace.root / "fits" / "friction.verify.json"
    check.write_text("{}", encoding="utf-8")  # a verification without its fit
    assert next_step(Engine.of(workspace)) == "scissorcal fit friction"
