"""The blade: photographs captured and measured, and its edge fitted."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from scissorcal.aliases import Progress
from scissorcal.calibration.camera.checks import verdict_there
from scissorcal.calibration.camera.result import CameraFit
from scissorcal.calibration.edge.checks import CAMERA, pair_verdicts
from scissorcal.calibration.edge.fit import Blade, fit_blade
from scissorcal.calibration.edge.result import BladeFit, BladeResult, SeenPair
from scissorcal.calibration.fit_pictures import edge_picture
from scissorcal.errors import InputError
from scissorcal.verdicts import Verdict
from scissorcal.vision.blade.photo import BladeLayout, BladePhoto, by_blade, measure_edge
from scissorcal.vision.geometry.camera import Camera
from scissorcal.vision.overlay import write_picture
from scissorcal.vision.photo import Photo, read_photo
from scissorcal.vision.targets.boards import BLADE_MAT
from scissorcal.workday.engine import Engine
from scissorcal.workday.photographs import (
    BladeSetup,
    PhotoCapture,
    Seen,
    Taken,
    photo_captures,
    take_photographs,
)
from scissorcal.workday.runs.fit import Made, Request, load_result
from scissorcal.workday.workspace import Workspace

STREAM = 3


def capture_blade(
    workspace: Workspace,
    paths: Sequence[Path],
    setup: BladeSetup,
    tell: Callable[[str], None],
) -> Taken:
    """Capture photographs of a blade; each is measured at once, while the blade still lies there.

    One that cannot be used is left out with its reason. Raises InputError, and keeps nothing, where
    none is left.
    """
    engine = Engine.of(workspace)
    _refuse_other_setup(photo_captures(workspace, "blade"), setup)

    def look(path: Path, photo: Photo) -> Seen:
        found = _measured(engine, photo, setup)
        if not found.measured:
            raise InputError(
                f"{photo.source}: no open blades: where this is a pair of scissors, it is closed, "
                "and each blade hides the other's edge. Open it by 30 to 80 deg."
            )
        return Seen(found.sentence(), board=BLADE_MAT if setup.mat else None)

    return take_photographs(workspace, "blade", paths, look, tell, blade=setup)


def fit(engine: Engine, request: Request) -> Made:
    """Fit the edge to all photographs of the blade; draw it over each of them.

    Uses the workspace's camera where there is one.
    """
    captures = photo_captures(engine.workspace, "blade")
    seen = _all_measured(engine, captures, request.run.tell)
    fits = _fits(seen, captures, engine, request)
    openings = tuple(_pair(one) for one in seen if one.scissors is not None)
    sources = tuple(one.photo.source for one in seen)
    shared = (*pair_verdicts(openings), *_camera_verdicts(engine, seen))
    result = BladeResult(fits, openings, request.inputs_hash, sources, shared_verdicts=shared)
    return Made(result, lambda folder: _draw(seen, fits, folder))


def _pair(one: BladePhoto) -> SeenPair:
    opening = one.scissors.opening if one.scissors else 0.0
    if one.lengths is None:
        return SeenPair(one.photo.source, opening)
    lengths = one.lengths
    return SeenPair(
        one.photo.source, opening, lengths.log_ratio, lengths.sd, lengths.tilt_deg, one.lamp_deg
    )


def _measured(engine: Engine, photo: Photo, setup: BladeSetup) -> BladePhoto:
    scale = setup.scale_mm_per_px * 1e-3 if setup.scale_mm_per_px else None
    layout = BladeLayout(setup.both, setup.mat, setup.edge_side, scale, setup.pivot_px)
    camera = _camera(engine, photo) if setup.mat else None
    return measure_edge(photo, camera, layout, engine.recipe.fit.blade.priors)


def _camera(engine: Engine, photo: Photo) -> Camera | None:
    """The workspace's camera, where it has one that takes photographs of this size."""
    fitted = _camera_fit(engine)
    return fitted.camera if fitted and fitted.camera.takes(photo.width, photo.height) else None


def _camera_fit(engine: Engine) -> CameraFit | None:
    if not engine.file("fit camera").is_file():
        return None
    fitted: CameraFit = load_result(engine, "camera")
    return fitted


def _camera_verdicts(engine: Engine, seen: Sequence[BladePhoto]) -> tuple[Verdict, ...]:
    """How well the camera is known where the edges were; none where no fitted camera was used."""
    fitted = _camera_fit(engine)
    edges = [(one.photo, own) for one in seen for own in one.measured if own.metric]
    mats = any(capture.index.board for capture in photo_captures(engine.workspace, "blade"))
    if fitted is None or fitted.pixel_map is None or not mats or not edges:
        return ()
    pixels = np.concatenate([photo.whole(own.edge.pixels) for photo, own in edges])
    scale = min(
        float(np.linalg.norm(np.ptp(photo.whole(own.edge.pixels), axis=0)) / np.ptp(own.station))
        for photo, own in edges
    )
    return (verdict_there(CAMERA, fitted.pixel_map, pixels, scale),)


def _refuse_other_setup(before: Sequence[PhotoCapture], setup: BladeSetup) -> None:
    for capture in before:
        held = capture.index.blade
        if held is not None and held.both != setup.both:
            what = "open scissors" if held.both else "one blade"
            raise InputError(
                f"{capture.folder} holds photographs of {what}, and one fit uses one kind: remove "
                "that folder to start again."
            )


def _all_measured(
    engine: Engine, captures: Sequence[PhotoCapture], tell: Progress
) -> tuple[BladePhoto, ...]:
    seen: list[BladePhoto] = []
    count = sum(len(capture.index.photographs) for capture in captures)
    for capture in captures:
        setup = capture.index.blade or BladeSetup()
        for photograph in capture.index.photographs:
            tell(0.6 * len(seen) / count, f"measuring {photograph.source}")
            photo = replace(read_photo(capture.path(photograph)), source=photograph.source)
            seen.append(_measured(engine, photo, setup))
    return tuple(seen)


def _fits(
    seen: Sequence[BladePhoto],
    captures: Sequence[PhotoCapture],
    engine: Engine,
    request: Request,
) -> tuple[BladeFit, ...]:
    lengths = [c.index.blade.length_mm for c in captures if c.index.blade]
    known = next((1e-3 * length for length in lengths if length), None)
    sides = by_blade(seen)
    if not sides:
        raise InputError(
            "The scissors are closed in every photograph, and each blade hides the other's edge: "
            "photograph them open."
        )
    fits = []
    for index, (name, measured) in enumerate(sides.items()):

        def part(done: float, sentence: str, index: int = index, name: str = name) -> None:
            request.run.tell(0.6 + 0.4 * (index + done) / len(sides), f"{name}: {sentence}")

        fits.append(
            fit_blade(
                measured,
                engine.recipe,
                effort=request.effort,
                rng=np.random.default_rng([request.seed, STREAM, index]),
                blade=Blade(name=name, length_m=known),
                progress=part,
            )
        )
    return tuple(fits)


def _draw(seen: Sequence[BladePhoto], fits: Sequence[BladeFit], folder: Path) -> None:
    by_name = {found.name: found for found in fits}
    for number, one in enumerate(seen, start=1):
        name = f"{number:03d}-{Path(one.photo.source).stem}.png"
        write_picture(edge_picture(one, by_name), folder / name)
