"""Edge and plate from fewer or coarser photographs of a case."""

import time
from collections.abc import Sequence
from importlib import import_module
from pathlib import Path

import numpy as np

from scissorcal.bench.trade.case import Case, Photographed
from scissorcal.calibration.edge.fit import Blade, fit_blade
from scissorcal.calibration.edge.result import BladeFit
from scissorcal.calibration.plate.fit import fit_plate, plate_target
from scissorcal.calibration.plate.result import PlateFit
from scissorcal.errors import InputError, MissingError
from scissorcal.vision.blade.photo import BladeLayout, BladePhoto, by_blade, measure_edge
from scissorcal.vision.photo import Photo, picture_size, read_photo
from scissorcal.vision.targets.boards import PLATE_BOARD, PLATE_STRIP
from scissorcal.vision.targets.detect import find_any_board

LEAST_WIDTH_PX = 400
LARGEST_FACTOR = 8

Resolution = tuple[int, int]
"""How many photographs, and by which factor each side of them is read more coarsely."""


def factors_of(width: int, height: int) -> tuple[int, ...]:
    """Factors that divide both sides of a photograph and leave 400 pixels of width.

    >>> factors_of(4000, 3000), factors_of(2000, 1500)
    ((1, 2, 4, 5, 8), (1, 2, 4, 5))
    """
    return tuple(
        factor
        for factor in range(1, LARGEST_FACTOR + 1)
        if width % factor == 0 and height % factor == 0 and width >= LEAST_WIDTH_PX * factor
    )


def size_of(photographed: Sequence[Photographed]) -> tuple[int, int]:
    """Width and height in pixels of the first photograph, by its file's header alone."""
    return picture_size(photographed[0].paths[0])


def count_of(photographed: Sequence[Photographed]) -> int:
    """How many photographs there are."""
    return sum(len(one.paths) for one in photographed)


def fit_edge(
    case: Case, resolution: Resolution, rng: np.random.Generator
) -> tuple[BladeFit, float]:
    """The edge from some of the photographs, and the processor seconds that it took.

    Reading the files is not counted. ``rng`` picks the photographs and is that of the fit, which is
    made at the case's effort. Raises what measuring and fitting raise, InputError where too few
    points are left.
    """
    chosen = _picked(case.photographs, resolution, rng)
    photos = [(one, _read(path, resolution, colour=True)) for one, path in chosen]
    _load_libraries()
    began = time.process_time()
    seen = [_measured(one, photo, case) for one, photo in photos]
    sides = by_blade(seen)
    if not sides:
        raise InputError("The scissors are closed in every photograph that was picked.")
    name, measured = next(iter(sides.items()))
    lengths = [one.length_mm for one, _ in chosen if one.length_mm]
    fit = fit_blade(
        measured,
        case.recipe,
        effort=case.effort,
        rng=rng,
        blade=Blade(name=name, length_m=1e-3 * lengths[0] if lengths else None),
    )
    return fit, time.process_time() - began


def locate_plate(
    case: Case, resolution: Resolution, rng: np.random.Generator
) -> tuple[PlateFit, float]:
    """The plate's pose before the camera from some photographs, and the processor seconds.

    Raises what detecting and fitting raise, MissingError without plate or camera.
    """
    if case.plate is None or case.camera is None:
        raise MissingError("There is no photograph of the plate, or no fit of the camera.")
    chosen = _picked((case.plate,), resolution, rng)
    photos = [_read(path, resolution, colour=False) for _, path in chosen]
    _load_libraries()
    began = time.process_time()
    boards = (PLATE_BOARD, PLATE_STRIP)
    found = [find_any_board(photo, boards) for photo in photos]
    fit = fit_plate(
        found,
        case.camera,
        priors=case.recipe.fit.plate.priors,
        plate_target=plate_target(case.recipe),
    )
    return fit, time.process_time() - began


def _picked(
    photographed: Sequence[Photographed], resolution: Resolution, rng: np.random.Generator
) -> list[tuple[Photographed, Path]]:
    every = [(one, path) for one in photographed for path in one.paths]
    rows = np.sort(rng.permutation(len(every))[: resolution[0]])
    return [every[row] for row in rows]


def _read(path: Path, resolution: Resolution, *, colour: bool) -> Photo:
    try:
        return read_photo(path, colour=colour).reduced(resolution[1])
    except ValueError as error:
        raise InputError(f"{path.name} cannot be read more coarsely: {error}.") from error


def _load_libraries() -> None:
    """Load what measuring loads when it is first used, so that no setting pays for it."""
    for name in ("cv2", "scipy.optimize", "scipy.spatial.transform", "scipy.interpolate"):
        import_module(name)


def _measured(one: Photographed, photo: Photo, case: Case) -> BladePhoto:
    scale = one.scale_mm_per_px * 1e-3 if one.scale_mm_per_px else None
    layout = BladeLayout(one.both, one.mat, one.edge_side, scale, one.pivot_px)
    camera = case.camera
    if camera and not (one.mat and camera.takes(photo.width, photo.height)):
        camera = None
    return measure_edge(photo, camera, layout, case.recipe.fit.blade.priors)
