"""The captures that are worth most for their time: designed for a workspace, kept, read back."""

import json
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any, Literal

from scissorcal.errors import InputError
from scissorcal.files import replacing
from scissorcal.foreign import read_foreign, reading
from scissorcal.foreign.formats import STATE
from scissorcal.identity import digest
from scissorcal.recipe.friction import as_first_named
from scissorcal.recipe.requirements import DesignedKind
from scissorcal.workday.engine import Engine
from scissorcal.workday.recordings import used_recordings
from scissorcal.workday.runs.fit import available, load_result
from scissorcal.workday.workspace import Workspace

if TYPE_CHECKING:
    from scissorcal.calibration.design import CaptureList, Stock, TorqueKnowledge
    from scissorcal.kernel import Identity
    from scissorcal.recipe.schema import Recipe

FORMAT: Literal["scissorcal-capture-design/1"] = "scissorcal-capture-design/1"
ASSUMED_RIG = (
    "No rig is known yet: assumed are travel for the whole scene, samples at 1 kHz and an encoder "
    "of 17 bits."
)
ASSUMED_FRICTION = (
    "Friction is not fitted yet: the recipe's priors at their medians are assumed for it and for "
    "the sensors' noise."
)
ASSUMED_CUT = (
    "The material is not fitted yet: the recipe's priors at their medians are assumed for it. "
    "Captures begin with three speeds of empty sweeps and two pieces whatever is expected."
)


@dataclass(frozen=True)
class DesignRow:
    """One addition to the list (or one thing left out), and what it is expected to do.

    ``within`` are shares of the places that can be felt whose band is within the tolerance,
    ``band`` half-widths at the median place, as shares of the torque; before and after.
    ``gain_per_min`` is by how many e-folds a minute the mean excess over the tolerance falls, both
    bands widened by 10 %. What is left out has negative ``minutes``: what the excess rises by per
    minute spared.
    """

    capture: str
    what: str
    minutes: float
    total_minutes: float
    within: tuple[float, float]
    band: tuple[float, float]
    worst: tuple[float, float]
    gain_per_min: float


@dataclass(frozen=True)
class CaptureDesign:
    """A designed list, what it is expected to reach, and what was assumed.

    ``speeds_rad_per_s`` are those of empty sweeps, each both ways (none where friction is known
    well enough); ``pieces`` have the speed of each stroke. ``listed_minutes`` and
    ``listed_within`` are of the recipe's own speeds and numbers, its defaults where it gives none.
    """

    format: Literal["scissorcal-capture-design/1"]
    inputs: str
    tolerance: float
    confidence: float
    rows: tuple[DesignRow, ...]
    speeds_rad_per_s: tuple[float, ...]
    pieces: tuple[tuple[float, ...], ...]
    minutes: float
    within_now: float
    within_expected: float
    listed_minutes: float
    listed_within: float
    sentence: str
    assumed: tuple[str, ...]


def design_captures(workspace: Workspace, identity: "Identity | None" = None) -> CaptureDesign:
    """Design the captures that are worth most now, and keep the list in the workspace.

    It rests on the fits that are current, with their recordings; before them on the recipe's
    priors. ``identity`` is the rig's; without one that of the last recording. Raises InputError for
    a linear joint, which no capture drives, and what planning raises.
    """
    from scissorcal.calibration.design import choose_captures, expected_band, knowledge_after
    from scissorcal.workday.stock import capture_stock, listed_captures

    engine = Engine.of(workspace)
    recipe = engine.recipe
    known, states, assumed = _known(engine)
    rig = identity or _last_identity(workspace)
    if rig is None:
        rig, assumed = _assumed_rig(recipe), (ASSUMED_RIG, *assumed)
    stock = capture_stock(recipe, rig, *states)
    found = choose_captures(known, stock)
    information, listed_s = listed_captures(recipe, rig, *states)
    listed = expected_band(known.plus(*information, new_recording=True))
    design = CaptureDesign(
        format=FORMAT,
        inputs=_inputs_of(engine),
        tolerance=0.01 * recipe.scene.tolerance_percent,
        confidence=0.01 * recipe.scene.confidence_percent,
        rows=tuple(
            DesignRow(
                step.capture,
                step.what,
                step.minutes,
                step.total_minutes,
                (step.before.within, step.after.within),
                (step.before.typical, step.after.typical),
                (step.before.worst, step.after.worst),
                step.gain,
            )
            for step in found.steps
        ),
        speeds_rad_per_s=found.captures.speeds,
        pieces=found.captures.pieces,
        minutes=found.minutes,
        within_now=found.now.within,
        within_expected=expected_band(knowledge_after(known, stock, found.captures)).within,
        listed_minutes=listed_s / 60.0,
        listed_within=listed.within,
        sentence=found.sentence,
        assumed=assumed,
    )
    workspace.design_path.parent.mkdir(exist_ok=True)
    with replacing(workspace.design_path) as part:
        part.write_text(json.dumps(asdict(design), indent=1) + "\n", encoding="utf-8")
    return design


def designed_for(
    workspace: Workspace, kind: DesignedKind, identity: "Identity"
) -> tuple["Recipe", str]:
    """The recipe whose captures are designed for a rig, and a sentence about the list.

    Where nothing more is worth capturing of this kind, the smallest list is taken that stands by
    itself: a person who captures all the same wants a recording.
    """
    from scissorcal.calibration.design.choice import first_captures
    from scissorcal.workday.stock import capture_stock, designed_recipe

    engine = Engine.of(workspace)
    known, states, _ = _known(engine)
    stock = capture_stock(engine.recipe, identity, *states)
    captures, sentence = _chosen(known, stock)
    least = first_captures(stock)
    wanted = captures.speeds if kind == "friction" else captures.pieces
    if not wanted:
        sentence = f"{sentence} The smallest list is captured that stands by itself."
        captures = least
    return designed_recipe(engine.recipe, captures), sentence


def stored_design(engine: Engine) -> CaptureDesign | None:
    """The list that was designed last, if it is for the recipe and the fits as they are now."""
    path = engine.workspace.design_path
    if not path.is_file():
        return None
    from pydantic import TypeAdapter

    try:
        with reading(path, STATE):
            found = TypeAdapter(CaptureDesign).validate_json(read_foreign(path, STATE))
    except InputError:
        return None  # of another version, or damaged: 'plan --explain' designs it again
    return found if found.inputs == _inputs_of(engine) else None


def _inputs_of(engine: Engine) -> str:
    """Identity of what a design is made from: the recipe, and the fits that are there."""
    fits = {what: engine.state(f"fit {what}").content for what in ("friction", "cut")}
    recipe = as_first_named(engine.recipe.model_dump())
    return digest({"format": FORMAT, "recipe": recipe, "fits": fits})


def _chosen(known: "TorqueKnowledge", stock: "Stock") -> tuple["CaptureList", str]:
    from scissorcal.calibration.design import choose_captures

    found = choose_captures(known, stock)
    return found.captures, found.sentence


def _known(engine: Engine) -> tuple["TorqueKnowledge", Any, tuple[str, ...]]:
    """What is known of the torque, the states of friction and cut, and what was assumed."""
    from scissorcal.calibration.design.state import (
        expected_cut,
        expected_friction,
        fitted_cut,
        fitted_friction,
    )
    from scissorcal.package.scene_slopes import torque_knowledge
    from scissorcal.workday.runs.cut import edge_of_photographs

    recipe = engine.recipe
    if recipe.rig.joint == "linear":
        raise InputError(
            'rig.joint = "linear": no capture drives a linear joint, so none is designed.'
        )
    there = available(engine, ("friction", "cut", "blade"))
    edge, _ = edge_of_photographs(engine) if "blade" in there else (None, ())
    if "friction" not in there:
        friction = expected_friction(recipe)
        cut = expected_cut(recipe, friction, edge)
        return (
            torque_knowledge(recipe, friction, cut),
            (friction, cut),
            (
                ASSUMED_FRICTION,
                ASSUMED_CUT,
            ),
        )
    fit = load_result(engine, "friction")
    recordings = used_recordings(engine.workspace, recipe, "friction", engine.index)
    friction = fitted_friction(recordings, recipe, fit)
    if "cut" not in there:
        cut = expected_cut(recipe, friction, edge)
        return torque_knowledge(recipe, friction, cut), (friction, cut), (ASSUMED_CUT,)
    cuts = used_recordings(engine.workspace, recipe, "cut", engine.index)
    cut = fitted_cut(cuts, recipe, fit, load_result(engine, "cut"), edge)
    return torque_knowledge(recipe, friction, cut), (friction, cut), ()


def _last_identity(workspace: Workspace) -> "Identity | None":
    """The identity that the last recording's rig stated; None where there is none."""
    from scissorcal.device.session import identity_of
    from scissorcal.recording import read_header

    paths = [path for kind in ("friction", "cut") for path in workspace.recordings(kind)]
    # a name is its kind and its stamp: by the whole name every friction sorts after every cut
    for path in sorted(paths, key=lambda one: one.stem.partition("-")[2], reverse=True):
        device = read_header(path).device
        if device:
            return identity_of(device, str(path))
    return None


def _assumed_rig(recipe: "Recipe") -> "Identity":
    from scissorcal.workday.stock import nominal_identity

    return nominal_identity(recipe)
