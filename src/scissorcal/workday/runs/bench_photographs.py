"""What a workspace's photographs give to a benchmark: files, camera, how blades were laid down."""

from dataclasses import replace
from typing import TYPE_CHECKING

from scissorcal.workday.engine import Engine
from scissorcal.workday.photographs import BladeSetup, photo_captures
from scissorcal.workday.runs.fit import available, load_result

if TYPE_CHECKING:
    from scissorcal.bench.trade.case import Case


def with_photographs(case: "Case", engine: Engine) -> "Case":
    """The case with the workspace's photographs of the blade and the plate, and its camera.

    Of the plate only the newest capture counts, as in its fit. A camera counts where its fit is
    current. Raises InputError where a capture's index is damaged.
    """
    from scissorcal.bench.trade.case import Photographed

    blades = []
    for capture in photo_captures(engine.workspace, "blade"):
        setup = capture.index.blade or BladeSetup()
        paths = tuple(capture.path(photograph) for photograph in capture.index.photographs)
        blades.append(Photographed(paths, case.simulated, **setup.model_dump()))
    plate = None
    for capture in photo_captures(engine.workspace, "plate")[-1:]:
        paths = tuple(capture.path(photograph) for photograph in capture.index.photographs)
        plate = Photographed(paths, case.simulated)
    camera = load_result(engine, "camera").camera if available(engine, ["camera"]) else None
    return replace(case, photographs=tuple(blades), camera=camera, plate=plate)
