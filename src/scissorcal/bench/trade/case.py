"""What a benchmark starts from: one workspace's scene, recordings and fits, all in memory."""

from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from scissorcal.calibration.result import Effort, FitResult
from scissorcal.model import EdgeDistribution
from scissorcal.package.simplest.law import Law
from scissorcal.package.tables import NumberFormat
from scissorcal.recipe.schema import Recipe
from scissorcal.recording.recording import Recording
from scissorcal.verdicts import Verdict
from scissorcal.vision.geometry.camera import Camera


@dataclass(frozen=True)
class Photographed:
    """Photographs of one capture: image files, and how they were taken.

    ``simulated`` says that they were rendered; ``mat``, ``both`` and ``edge_side`` are as in the
    capture's index (`workday.photographs.BladeSetup`). Of a plate's target only the files count.
    """

    paths: tuple[Path, ...]
    simulated: bool
    mat: bool = True
    both: bool = False
    edge_side: Literal["down", "up"] = "down"
    scale_mm_per_px: float | None = None
    length_mm: float | None = None
    pivot_px: tuple[float, float] | None = None


@dataclass(frozen=True)
class Case:
    """One scene with its data and present fits; it pickles, for processes and clusters.

    ``friction`` and ``cut`` are the recordings that fits use, ``edge`` what photographs gave (None
    where the recipe states the edge). ``friction_fit`` and ``cut_fit`` are the workspace's own,
    None where the scene has no such fit. ``held`` is the law that a package of these fits holds:
    theirs, or a simpler one that is enough for the scene (`models.held_law`); None where nothing
    is rendered. ``effort`` and ``recipe.fit`` are the present settings;
    knobs replace parts of all this. ``photographs`` are of the blade and ``plate`` of the plate,
    both taken by ``camera``. ``simulated`` says that the data come from the virtual rig.
    """

    recipe: Recipe
    friction: tuple[Recording, ...]
    cut: tuple[Recording, ...]
    edge: EdgeDistribution | None
    edge_verdicts: tuple[Verdict, ...]
    friction_fit: FitResult | None
    cut_fit: FitResult | None
    effort: Effort
    seed: int = 0
    simulated: bool = False
    held: Law | None = None
    table_tolerance: float | None = None
    number_format: NumberFormat = "float32"
    photographs: tuple[Photographed, ...] = ()
    camera: Camera | None = None
    plate: Photographed | None = None
