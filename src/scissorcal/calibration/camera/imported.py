"""A camera that was calibrated elsewhere, as a fit without uncertainty."""

from pathlib import Path

import numpy as np

from scissorcal.calibration.camera.result import CameraFit
from scissorcal.identity import file_digest
from scissorcal.verdicts import Check
from scissorcal.vision.camera_files import CameraFile

UNCERTAINTY = Check(
    "fit.camera uncertainty", "lengths measured in photographs: whether their error is known"
)


def imported_camera(read: CameraFile, file: Path) -> CameraFit:
    """The camera of a file that `read_camera_file` read, without draws, views or covariance."""
    why = f"{file.name} ({read.style}) states no uncertainty of the camera."
    return CameraFit(
        camera=read.camera,
        origin="imported",
        board="",
        rung=f"as in {file.name}",
        rungs=(),
        draws=np.empty((0, 9)),
        views=(),
        bulge_mm=(0.0, 0.0),
        noise_px=read.rms_px if read.rms_px is not None else float("nan"),
        stretch=float("nan"),
        region=np.empty((0, 2)),
        region_share=0.0,
        pixel_map=None,
        cross=None,
        verdicts=(UNCERTAINTY.not_evaluated(why),),
        inputs_hash=file_digest(file),
        sources=(file.name,),
        notes=(f"Imported from {file.name} ({read.style}).", *read.notes),
    )
