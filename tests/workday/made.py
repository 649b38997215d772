"""A workspace with a made-up friction recording, quick to fit."""

from dataclasses import replace
from pathlib import Path

import numpy as np

from scissorcal.recording import write_recording
from scissorcal.workday.workspace import Workspace, create_workspace
from tests.calibration.truth import Stroke, Truth, make_recording, sweep

QUICK = """
[fit]
effort = "draft"

[fit.friction]
rung = "coulomb+viscous"
symmetry = "symmetric"
"""


def quick_workspace(folder: Path) -> Workspace:
    """Make a workspace for paper whose friction fit tries one rung only, at draft effort."""
    workspace = create_workspace(folder, "paper-80gsm")
    with workspace.recipe_path.open("a", encoding="utf-8") as recipe:
        recipe.write(QUICK)
    return workspace


def record_friction(workspace: Workspace, seed: int = 1, recipe_toml: str | None = None) -> Path:
    """Add a recording of empty sweeps; its recipe is the workspace's unless given."""
    opening, strokes = [], []
    for speed in (0.1, 0.3, 0.8):
        for start, end, kind in ((0.87, 0.2, "closing"), (0.2, 0.87, "opening")):
            strokes.append(Stroke(len(strokes), kind, speed))
            opening.append(sweep(start, end, speed))
    rng = np.random.default_rng(seed)
    places = [0.0] * len(opening)
    made = make_recording("friction", opening, places, strokes, Truth(), rng, False)
    text = workspace.recipe_path.read_text(encoding="utf-8") if recipe_toml is None else recipe_toml
    path = workspace.new_recording("friction")
    write_recording(replace(made, recipe_toml=text), path)
    return path
