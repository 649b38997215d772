"""What photographs gave, made ready for a report: the fits that the scene requires, as they are."""

import hashlib
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from scissorcal.recipe.requirements import GeometryKind, requirements
from scissorcal.workday.geometry import GeometryState, fit_state, photograph_state
from scissorcal.workday.workspace import Workspace

if TYPE_CHECKING:
    from scissorcal.recipe.schema import Recipe
    from scissorcal.report import Geometry

KINDS: tuple[GeometryKind, ...] = ("camera", "blade", "plate")
_PHOTOGRAPHS: Mapping[GeometryKind, str] = {
    "camera": "board-*.jpg",
    "blade": "blade-*.jpg",
    "plate": "plate-*.jpg",
}


def report_geometry(workspace: Workspace, recipe: "Recipe") -> "Geometry":
    """Load the fits of photographs that the scene requires and that are of what is there now.

    One that is missing, damaged or has fallen behind is named with the command that makes it.
    """
    from scissorcal.calibration import load
    from scissorcal.calibration.camera.result import CameraFit
    from scissorcal.calibration.edge.result import BladeResult
    from scissorcal.calibration.plate.result import PlateFit
    from scissorcal.report import Geometry

    files: dict[GeometryKind, Path] = {}
    missing: dict[GeometryKind, str] = {}
    for kind in KINDS:
        if not requirements(recipe).needs_geometry(kind):
            continue
        state = fit_state(workspace, recipe, kind)
        if state.status == "done":
            files[kind] = state.files[0]
        else:
            missing[kind] = f"The scene requires it: {state.state}. {_how(workspace, kind, state)}"
    return Geometry(
        camera=load(files["camera"], CameraFit) if "camera" in files else None,
        blade=load(files["blade"], BladeResult) if "blade" in files else None,
        plate=load(files["plate"], PlateFit) if "plate" in files else None,
        pictures={
            kind: tuple(sorted(path.with_suffix("").glob("*.png"))) for kind, path in files.items()
        },
        sha256={
            kind: hashlib.sha256(path.read_bytes()).hexdigest() for kind, path in files.items()
        },
        missing=missing,
    )


def _how(workspace: Workspace, kind: GeometryKind, state: GeometryState) -> str:
    fit = f"`scissorcal fit {kind}{' --force' if state.damaged else ''}`"
    if photograph_state(workspace, kind).status == "missing":
        capture = f"`scissorcal capture {kind} --image {_PHOTOGRAPHS[kind]}`"
        return f"Run {capture}, then {fit}."
    return f"Run {fit}."
