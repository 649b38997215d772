"""The demo's photographs: rendered, taken in and fitted as a lab's own would be, then judged."""

import math
import tempfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from scissorcal.aliases import Progress
from scissorcal.device.sim.specimen import Specimen, load_specimen
from scissorcal.errors import InputError
from scissorcal.recipe.requirements import requirements
from scissorcal.recipe.schema import Recipe
from scissorcal.recording.probe import NORMAL_90
from scissorcal.vision.geometry.pose import Pose, difference
from scissorcal.vision.sim import BladeShape
from scissorcal.vision.sim.sim_camera import (
    render_blade_photographs,
    render_board_photographs,
    render_card_photographs,
    render_plate_photographs,
    sim_plate_scene,
)
from scissorcal.vision.targets.boards import CAMERA_BOARD
from scissorcal.workday.engine import Engine
from scissorcal.workday.options import FitOptions
from scissorcal.workday.photographs import BladeSetup
from scissorcal.workday.runs.blade import capture_blade
from scissorcal.workday.runs.camera import capture_camera
from scissorcal.workday.runs.fit import FitOutcome, fit_workspace, load_result
from scissorcal.workday.runs.plate import capture_plate
from scissorcal.workday.workspace import Workspace


def specimen_blade(recipe: Recipe) -> BladeShape:
    """Shape of the specimen's blade. Raises InputError where the recipe names no specimen."""
    if recipe.specimen is None:
        raise InputError(
            f'The recipe "{recipe.name}" names no specimen, so there is no virtual blade to '
            'photograph: add specimen = "...", or give photographs with --image.'
        )
    blade = load_specimen(recipe.specimen).blade
    if blade.wave_mm is not None:
        raise InputError(
            f'The blade of the specimen "{recipe.specimen}" has a wave (blade.wave_mm), and the '
            "virtual camera draws lines and arcs only: take it out, or give photographs with "
            "--image."
        )
    taper = math.radians(blade.taper_deg)
    return BladeShape(
        length_m=1e-3 * blade.length_mm,
        offset_m=1e-3 * blade.offset_mm,
        taper_rad=taper,
        curvature_per_m=blade.curvature_per_m,
        back_m=-1e-3 * blade.offset_mm,
        back_slope=-math.tan(taper),
    )


@dataclass(frozen=True)
class Judged:
    """An estimate in ``unit`` with its 90 % interval, of a fit's parameter or of photographs.

    ``truth`` is None where the chosen law has no such thing.
    """

    name: str
    unit: str
    truth: float | None
    estimate: float
    low: float
    high: float

    @property
    def inside(self) -> bool | None:
        """Whether the truth lies in the interval; None where there is no truth."""
        return None if self.truth is None else self.low <= self.truth <= self.high


def photograph(workspace: Workspace, recipe: Recipe, seed: int, progress: Progress) -> None:
    """Render the photographs that the scene requires, and take them in.

    They show the specimen's own blade, and targets at places that only the renderer knows.
    """
    wanted = [item.name for item in requirements(recipe).geometry]
    for index, what in enumerate(wanted):
        share = index / len(wanted)

        def tell(sentence: str, share: float = share) -> None:
            progress(share, sentence.splitlines()[0])

        with tempfile.TemporaryDirectory() as scratch:
            folder = Path(scratch)
            if what == "camera":
                made = render_board_photographs(CAMERA_BOARD, folder, seed, "board")
                capture_camera(workspace, made, CAMERA_BOARD, tell)
            elif what == "blade":
                made = render_blade_photographs(specimen_blade(recipe), folder, seed)
                capture_blade(workspace, made, BladeSetup(), tell)
            else:
                made = render_plate_photographs(recipe, folder, seed)
                capture_plate(workspace, made, tell)
                card = render_card_photographs(recipe, folder, seed)
                positions = {path.name: position for path, position in card.items()}
                capture_plate(workspace, list(card), tell, positions=positions)


def fit_photographs(
    workspace: Workspace, recipe: Recipe, seed: int, progress: Progress
) -> tuple[FitOutcome, ...]:
    """Fit what the scene requires of its photographs, in order."""
    wanted = [item.name for item in requirements(recipe).geometry]
    options = FitOptions(seed=seed)
    return fit_workspace(workspace, wanted, options, progress=progress) if wanted else ()


def judge_photographs(
    workspace: Workspace, recipe: Recipe, specimen: Specimen, seed: int
) -> tuple[Judged, ...]:
    """Put the edge's height and slope and the plate's place beside what was rendered.

    The edge is judged where it is used: its offset and taper at a quarter, half and three
    quarters of the blade.
    """
    rows: list[Judged] = []
    if requirements(recipe).needs_geometry("blade"):
        rows += _judge_edge(workspace, specimen)
    if requirements(recipe).needs_geometry("plate"):
        rows += _judge_plate(workspace, recipe, seed)
    return tuple(rows)


def _judge_edge(workspace: Workspace, specimen: Specimen) -> list[Judged]:
    fit = load_result(Engine.of(workspace), "blade").blades[0]
    edges = fit.edge_posterior.with_values(fit.draws)
    blade, length = specimen.blade, fit.edge_posterior.edge.length_m
    rows = []
    for share in (0.25, 0.5, 0.75):
        s = share * length
        offset = np.asarray(edges.offset_at(np.array([s]))).ravel() * 1e3
        taper = np.degrees(np.arctan(np.asarray(edges.slope_at(np.array([s]))).ravel()))
        slope = np.tan(np.radians(blade.taper_deg)) + blade.curvature_per_m * s
        true = blade.offset_mm + 1e3 * s * (
            np.tan(np.radians(blade.taper_deg)) + 0.5 * blade.curvature_per_m * s
        )
        place = f"at {1e3 * s:.0f} mm"
        rows += [
            _row(f"edge offset {place}", "mm", float(true), offset.mean(), offset.std()),
            _row(
                f"edge taper {place}",
                "deg",
                float(np.degrees(np.arctan(slope))),
                taper.mean(),
                taper.std(),
            ),
        ]
    return rows


def _judge_plate(workspace: Workspace, recipe: Recipe, seed: int) -> list[Judged]:
    fit = load_result(Engine.of(workspace), "plate")
    rendered = sim_plate_scene(recipe, seed).rig_plate
    truth = Pose.from_matrix(rendered.rotation, rendered.shift_m)
    if fit.rig_plate is None or fit.rig_plate.covariance is None:
        return []
    away = difference(fit.rig_plate, truth)
    sd = np.sqrt(np.diag(fit.rig_plate.covariance))
    rows = []
    for index, axis in enumerate("xyz"):
        place = 1e3 * truth.translation_m[index]
        off = 1e3 * away[3 + index]
        rows.append(_row(f"plate {axis}", "mm", place, place + off, 1e3 * sd[3 + index]))
    for index, axis in enumerate("xyz"):
        off = np.degrees(away[index])
        rows.append(_row(f"plate turn {axis}", "deg", 0.0, off, np.degrees(sd[index])))
    return rows


def _row(name: str, unit: str, truth: float, estimate: float, sd: float) -> Judged:
    reach = NORMAL_90 * sd
    return Judged(
        name, unit, float(truth), float(estimate), float(estimate - reach), float(estimate + reach)
    )
