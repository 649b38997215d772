"""Open what a workspace holds, from Python: a workspace, a recording, a fit, a package.

Each function is also an attribute of ``scissorcal`` and loads what it needs when it is called.
"""

from pathlib import Path
from typing import TYPE_CHECKING

from scissorcal.errors import InputError, MissingError

if TYPE_CHECKING:
    from scissorcal.calibration.camera.result import CameraFit
    from scissorcal.calibration.edge.result import BladeResult
    from scissorcal.calibration.plate.result import PlateFit
    from scissorcal.calibration.result import FitResult
    from scissorcal.package import ModelPackage
    from scissorcal.recording import Recording
    from scissorcal.workday.workspace import Workspace


def open_workspace(path: Path | str = ".") -> "Workspace":
    """Open the workspace that the folder ``path`` lies in.

    The workspace names its files: ``recipe()``, ``recordings("friction")`` (all of them, excluded
    ones too), ``fit_path("cut")``.
    Unlike the commands it recovers no interrupted capture. Raises MissingError where there is no
    such folder, or no recipe.toml in it or above it, InputError where it is a file.

    >>> from pathlib import Path
    >>> from scissorcal.recipe.library import recipe_path
    >>> _ = Path("recipe.toml").write_text(recipe_path("paper-80gsm").read_text())
    >>> open_workspace(".").recipe().name
    'paper-80gsm'
    """
    from scissorcal.workday.workspace import find_workspace

    folder = Path(path)
    if folder.is_file():
        raise InputError(f"{path} is a file, not a folder. Name the folder of a workspace.")
    if not folder.is_dir():
        raise MissingError(
            f"There is no folder {folder}. Give the folder of a workspace, or start one with "
            "'scissorcal init NAME --recipe paper-80gsm'."
        )
    return find_workspace(folder)


def open_recording(path: Path | str) -> "Recording":
    """Read a recording (.mcap): samples, strokes, device, notes.

    ``recording.samples`` is a NumPy array, ``recording.to_pandas()`` a table with units in the
    columns' names. Raises MissingError where there is no file, InputError where it is no recording.

    >>> import numpy as np
    >>> from scissorcal.recording import SAMPLE_DTYPE, Recording, write_recording
    >>> samples = np.zeros(3, SAMPLE_DTYPE)
    >>> samples["device_time_us"] = [0, 1000, 2000]
    >>> _ = write_recording(Recording("friction", samples), "captured.mcap")
    >>> open_recording("captured.mcap")
    <friction recording: 3 samples, 0.0 s, 0 strokes, rotary joint, captured.mcap>
    """
    from scissorcal.recording import read_recording

    return read_recording(_existing(path, "Record one with 'scissorcal capture'."))


def open_fit(path: Path | str) -> "FitResult | CameraFit | BladeResult | PlateFit":
    """Read a fit: of friction, of a cut, or of photographs of a camera, a blade or a plate.

    Each has what it is of (``what``), ``verdicts``, ``sources`` and ``notes``; a fit of friction or
    of a cut has ``parameters``, ``draws`` and ``series`` besides. ``arviz.from_netcdf`` reads the
    same file. Raises MissingError where there is no file, InputError where it is no fit of
    scissorcal.

    >>> open_fit("fits/cut.nc")
    Traceback (most recent call last):
    scissorcal.errors.MissingError: There is no file fits/cut.nc. Make it with 'scissorcal fit'.
    """
    from scissorcal.calibration.camera.result import CameraFit
    from scissorcal.calibration.edge.result import BladeResult
    from scissorcal.calibration.plate.result import PlateFit
    from scissorcal.calibration.result import FitResult
    from scissorcal.calibration.store import load, read_header

    file = _existing(path, "Make it with 'scissorcal fit'.")
    kinds = {"camera": CameraFit, "blade": BladeResult, "plate": PlateFit}
    return load(file, kinds.get(read_header(file).what, FitResult))


def open_package(path: Path | str) -> "ModelPackage":
    """Open a package (package/<recipe>.zip) after checking everything in it.

    ``package.torque`` gives the mean torque, ``package.band`` its interval, ``package.kernel()``
    the step that the loop runs. Raises MissingError where there is no file, InputError where it is
    no package or was changed.

    >>> open_package("package/paper-80gsm.zip")
    Traceback (most recent call last):
    scissorcal.errors.MissingError: There is no file package/paper-80gsm.zip. Make it with \
'scissorcal package build'.
    """
    from scissorcal.package import open_package as opened

    return opened(_existing(path, "Make it with 'scissorcal package build'."))


def _existing(path: Path | str, remedy: str) -> Path:
    if Path(path).is_dir():
        raise InputError(f"{path} is a folder, not a file. Name a file in it.")
    if not Path(path).is_file():
        raise MissingError(f"There is no file {path}. {remedy}")
    return Path(path)
