"""What a scene requires: captures to take, fits to run, tables to build, and what is left out."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

from scissorcal.recipe.schema import Recipe

CaptureKind = Literal["friction", "friction-advance", "cut"]
DesignedKind = Literal["friction", "cut"]
"""Captures whose strokes can be chosen by what they are worth to the scene's torque."""
GeometryKind = Literal["camera", "blade", "plate"]

LITTLE = 0.5
"""Of what is recorded: where a fit uses a smaller share of a stroke, that does not count as used;
where it does of a speed's motion, the speed is named."""


@dataclass(frozen=True)
class Requirement:
    """One thing that the scene needs or does without, and the reason in a sentence."""

    name: str
    why: str


@dataclass(frozen=True)
class Requirements:
    """Everything that follows from a scene, in the order in which it is done.

    ``captures`` are of the rig, ``photographs`` of its geometry; ``geometry`` is fitted to the
    latter, ``fits`` to the former. ``left_out`` names what is neither asked for, nor fitted, nor
    shipped.
    """

    captures: tuple[Requirement, ...]
    fits: tuple[Requirement, ...]
    tables: tuple[Requirement, ...]
    left_out: tuple[Requirement, ...]
    photographs: tuple[Requirement, ...] = ()
    geometry: tuple[Requirement, ...] = ()

    def needs_capture(self, name: CaptureKind) -> bool:
        return any(item.name == name for item in self.captures)

    def needs_geometry(self, name: GeometryKind) -> bool:
        return any(item.name == name for item in self.geometry)


def requirements(recipe: Recipe) -> Requirements:
    """Derive from a recipe what has to be captured, fitted and built.

    A scene that renders no friction ships no friction table, and still captures and fits friction:
    what the motor measures while it cuts is cutting *and* friction, so the response of the material
    cannot be separated from the friction of the pivot unless that is known from an empty stroke.
    A scene that only presses needs neither toughness nor fracture. A linear joint carries no
    blades: it has friction and inertia, and nothing is cut with it. Mass and friction of the
    carriage are needed where a force along the cut is rendered with friction.

    >>> from scissorcal.recipe.library import builtin_recipe
    >>> needs = requirements(builtin_recipe("press-only"))
    >>> [item.name for item in needs.tables], [item.name for item in needs.left_out][:2]
    (['edge', 'response', 'friction'], ['fracture', 'translation force'])
    """
    if recipe.rig.joint == "linear":
        return _linear_joint()
    scene = recipe.scene
    verb = "cut" if scene.cut else "pressed"
    why_friction = (
        "rendered, and taken off the torque measured with material between the blades"
        if scene.render_friction
        else "not rendered, but what is measured with material between the blades contains it"
    )
    tables = [
        Requirement("edge", "where the blades touch the plate at each opening"),
        Requirement("response", "force of the plate against indentation"),
    ]
    left_out = []
    if scene.cut:
        tables.append(Requirement("fracture", "when the crack advances (scene.cut = true)"))
    else:
        left_out.append(
            Requirement("fracture", "nothing is cut (scene.cut = false): no toughness, no crack")
        )
    if scene.render_friction:
        why = "rendered (scene.render_friction = true)"
        if set(scene.render) == {"translation_force"}:
            why += (
                ", although a translation force has none: where the handles carry no motor, set it "
                "to false"
            )
        tables.append(Requirement("friction", why))
    else:
        left_out.append(Requirement("friction table", "scene.render_friction = false"))
    if "translation_force" not in scene.render:
        left_out.append(
            Requirement("translation force", 'scene.render does not name "translation_force"')
        )
    advance = _advance(recipe)
    geometry = _geometry(recipe)
    if not any(item.name == "blade" for item in geometry):
        left_out.append(Requirement("blade photographs", 'rig.edge.source = "recipe"'))
    if not any(item.name == "plate" for item in geometry):
        left_out.append(Requirement("plate pose", 'scene.plate_pose = "known"'))
    return Requirements(
        captures=(
            Requirement("friction", why_friction),
            *advance,
            Requirement("cut", f"{recipe.material.name} is {verb} in this scene"),
        ),
        fits=(
            Requirement("friction", why_friction),
            *advance,
            Requirement("cut", "response and toughness" if scene.cut else "response only"),
        ),
        tables=tuple(tables),
        left_out=tuple(left_out),
        photographs=geometry,
        geometry=geometry,
    )


def _advance(recipe: Recipe) -> tuple[Requirement, ...]:
    """Friction of the carriage, where a hand feels it beside a rendered force."""
    scene = recipe.scene
    if "translation_force" not in scene.render or not scene.render_friction:
        return ()
    why = "a force along the cut is rendered with friction, and the carriage's own comes on top"
    return (Requirement("friction-advance", why),)


def _geometry(recipe: Recipe) -> tuple[Requirement, ...]:
    """What photographs are wanted of, in the order in which they are fitted."""
    blade = recipe.rig.edge.source == "photographs"
    plate = recipe.scene.plate_pose == "estimated"
    wanted = []
    if blade or plate:
        wanted.append(Requirement("camera", "photographs are measured through it"))
    if blade:
        why = 'the edge is taken from photographs (rig.edge.source = "photographs")'
        wanted.append(Requirement("blade", why))
    if plate:
        why = 'where the plate stands is estimated (scene.plate_pose = "estimated")'
        wanted.append(Requirement("plate", why))
    return tuple(wanted)


def _linear_joint() -> Requirements:
    why = "friction and inertia of the joint"
    reason = "a linear joint carries no blades (rig.joint = linear)"
    return Requirements(
        captures=(Requirement("friction", why),),
        fits=(Requirement("friction", why),),
        tables=(),
        left_out=tuple(Requirement(name, reason) for name in ("cut", "package")),
    )


def capture_facts(recipe: Recipe, kind: CaptureKind) -> Mapping[str, object]:
    """Return what a capture of one kind recorded, as far as the recipe says it.

    Where these differ between the recipe at capture and the recipe now, the recording is of
    something else and is no longer used. Settings that only say how much to record (speeds,
    repeats, sheets) are not among them: what was recorded stays true.
    """
    rig = recipe.rig
    if kind == "friction-advance":
        return {"rig.joint": rig.joint}
    facts: dict[str, object] = {
        "rig.joint": rig.joint,
        "rig.moving": rig.moving,
        "rig.handle_radius_mm": rig.handle_radius_mm,
    }
    if kind == "cut":
        facts["material.name"] = recipe.material.name
        facts["material.thickness_mm"] = recipe.material.thickness_mm
        facts["scene.cut"] = recipe.scene.cut
    return facts


def command_words(what: str) -> str:
    """What commands call a capture, a fit or a trust check of this name.

    >>> command_words("friction-advance"), command_words("cut")
    ('friction --axis advance', 'cut')
    """
    return {"friction-advance": "friction --axis advance"}.get(what, what)
