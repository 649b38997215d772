"""A workspace with a made-up friction recording, quick to fit."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any, Literal

import numpy as np
import pytest

from scissorcal.recording import write_recording
from scissorcal.workday.options import FitOptions
from scissorcal.workday.runs.fit import fit_workspace
from scissorcal.workday.workspace import Workspace
from tests.calibration.truth import Stroke, Truth, make_recording, sweep
from tests.made_once import copied, made_once

Kind = Literal["friction", "cut"]

RECIPE = """
format = "scissorcal-recipe/1"
name = "made-up"
description = "For tests: few choices, quick to fit."
specimen = "office-paper"

[rig]
handle_radius_mm = 60.0

[rig.edge]
offset_mm = -8.0
taper_deg = 2.0
length_mm = 75.0

[material]
name = "paper"
thickness_mm = 0.10

[scene]
opening_deg = [12.0, 50.0]
opening_rate_rad_per_s = [0.05, 1.0]
contact_mm = [15.0, 60.0]
tolerance_percent = 7.0

[capture.friction]
speeds_rad_per_s = [0.1, 0.3, 0.8]

[fit]
effort = "draft"

[fit.friction]
law = "coulomb+viscous"
symmetry = "symmetric"

[fit.cut]
response = "power"
fracture = "smooth"
reference_indentation_mm = 0.15
toughness_J_per_m2 = { median = 5000.0, factor_90 = 10.0 }
"""


def quick_workspace(folder: Path) -> Workspace:
    """Make a workspace whose fits try one candidate only, at draft effort."""
    folder.mkdir(parents=True)
    workspace = Workspace(folder)
    workspace.recipe_path.write_text(RECIPE, encoding="utf-8")
    return workspace


def fitted_workspace(folder: Path, *kinds: Kind, **how: Any) -> Workspace:
    """A quick workspace with recordings of these kinds, and with fits of them all."""
    workspace = quick_workspace(folder)
    for kind in kinds:
        RECORD[kind](workspace)
    fit_workspace(workspace, kinds, FitOptions(**how))
    return workspace


def fitted_copy(factory: pytest.TempPathFactory, target: Path, *kinds: Kind) -> Workspace:
    """The same, fitted once in a run of the tests, as a copy at ``target``."""
    made = made_once(
        factory,
        f"quick workspace with fits of {' and '.join(kinds)}",
        lambda folder: fitted_workspace(folder / "paper", *kinds),
    )
    return Workspace(copied(made / "paper", target))


def record_friction(
    workspace: Workspace,
    seed: int = 1,
    recipe_toml: str | None = None,
    truth: Truth | None = None,
) -> Path:
    """Add a recording of empty sweeps; its recipe is the workspace's unless given."""
    opening, strokes = [], []
    for speed in (0.1, 0.3, 0.8):
        for start, end, kind in ((0.87, 0.2, "closing"), (0.2, 0.87, "opening")):
            strokes.append(Stroke(len(strokes), kind, speed))
            opening.append(sweep(start, end, speed))
    rng = np.random.default_rng(seed)
    places = [0.0] * len(opening)
    made = make_recording("friction", opening, places, strokes, truth or Truth(), rng, False)
    text = workspace.recipe_path.read_text(encoding="utf-8") if recipe_toml is None else recipe_toml
    path = workspace.new_recording("friction")
    write_recording(replace(made, recipe_toml=text), path)
    return path


def record_cut(workspace: Workspace, seed: int = 3) -> Path:
    """Add a recording of two strokes through a sheet."""
    opening, advance, strokes = [], [], []
    for place, speed in ((-0.018, 0.6), (0.016, 0.9)):
        for start, end, kind, rate in ((0.85, 0.22, "closing", speed), (0.22, 0.85, "opening", 1)):
            strokes.append(Stroke(len(strokes), kind, rate, 0))
            opening.append(sweep(start, end, rate))
            advance.append(place)
    rng = np.random.default_rng(seed)
    made = make_recording("cut", opening, advance, strokes, Truth(), rng, True)
    path = workspace.new_recording("cut")
    text = workspace.recipe_path.read_text(encoding="utf-8")
    write_recording(replace(made, recipe_toml=text), path)
    return path


RECORD: dict[Kind, Callable[[Workspace], Path]] = {
    "friction": record_friction,
    "cut": record_cut,
}
