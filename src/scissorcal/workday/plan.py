"""What a scene requires of the day: the state of every step, in order, and what comes next."""

from dataclasses import dataclass
from typing import TYPE_CHECKING

from scissorcal.recipe.edge import edge_sentence
from scissorcal.recipe.plate_layers import plate_pieces, plate_sentence
from scissorcal.recipe.requirements import (
    CaptureCost,
    CaptureKind,
    Requirement,
    capture_cost,
    requirements,
)
from scissorcal.workday.engine import Engine
from scissorcal.workday.next_step import next_step
from scissorcal.workday.runs.probe import probe_state
from scissorcal.workday.states import StepState
from scissorcal.workday.workspace import Workspace

if TYPE_CHECKING:
    from scissorcal.package.simplest.choice import SceneChoice
    from scissorcal.workday.runs.design import CaptureDesign


@dataclass(frozen=True)
class Plan:
    """All steps in the order of the day, and what the scene does without.

    ``probe`` is what is known of the rig's probe, ``costs`` what each capture of the rig takes that
    is still to be made. ``choice`` says what of the fitted laws the scene needs; None until the
    fits are there and a report or a package was made of them. ``design`` is the list of captures
    that was designed last, if it is for what there is now. ``next_command`` is what comes next
    (`next_step`), None where nothing is left to do.
    """

    recipe: str
    steps: tuple[StepState, ...]
    tables: tuple[Requirement, ...]
    left_out: tuple[Requirement, ...]
    probe: str
    costs: tuple[CaptureCost, ...] = ()
    choice: "SceneChoice | None" = None
    design: "CaptureDesign | None" = None
    edge: str = ""
    plate: str = ""
    next_command: str | None = None

    @property
    def notes(self) -> tuple[str, ...]:
        """What drawn edges and plates are, then sentences on single steps, each once, in order."""
        drawn = filter(None, (self.edge, self.plate))
        return (*drawn, *dict.fromkeys(note for step in self.steps for note in step.notes))


def make_plan(workspace: Workspace) -> Plan:
    """Compare what the recipe requires with what the workspace holds.

    Raises InputError where the recipe is wrong.
    """
    engine = Engine.of(workspace)
    needs = requirements(engine.recipe)
    return Plan(
        engine.recipe.name,
        engine.states(),
        needs.tables,
        needs.left_out,
        probe_state(workspace, engine.recipe),
        _costs(engine),
        _choice(engine),
        _design(engine),
        edge_sentence(engine.recipe.rig.edge, engine.recipe.rig.joint),
        _plate_sentence(engine),
        next_step(engine),
    )


def _plate_sentence(engine: Engine) -> str:
    plate, material = engine.recipe.plate, engine.recipe.material
    pieces = plate_pieces(plate, engine.workspace.root)
    return plate_sentence(plate, material.name, material.thickness_mm, pieces)


def _costs(engine: Engine) -> tuple[CaptureCost, ...]:
    kinds: tuple[CaptureKind, ...] = ("friction", "friction-advance", "cut")
    open_states = ("missing", "stale", "incomplete")
    return tuple(
        capture_cost(engine.recipe, kind)
        for kind in kinds
        if engine.shown(f"capture {kind}") and engine.state(f"capture {kind}").state in open_states
    )


def _choice(engine: Engine) -> "SceneChoice | None":
    if not engine.workspace.scene_choice_path.is_file():
        return None
    from scissorcal.workday.runs.simplest import known_scene_choice

    return known_scene_choice(engine)


def _design(engine: Engine) -> "CaptureDesign | None":
    if not engine.workspace.design_path.is_file():
        return None
    from scissorcal.workday.runs.design import stored_design

    return stored_design(engine)
