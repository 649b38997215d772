"""The library's first functions: open what a workspace holds, and fit recordings without one.

Each function is also an attribute of ``scissorcal`` and loads what it needs when it is called.
"""

import logging
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Literal

from scissorcal.errors import InputError, MissingError

if TYPE_CHECKING:
    from scissorcal.aliases import Progress
    from scissorcal.calibration.camera.result import CameraFit
    from scissorcal.calibration.edge.result import BladeResult
    from scissorcal.calibration.plate.result import PlateFit
    from scissorcal.calibration.result import FitResult
    from scissorcal.calibration.verify.result import VerifyResult
    from scissorcal.model import ResponseLaw
    from scissorcal.package import ModelPackage
    from scissorcal.recipe import Recipe
    from scissorcal.recording import Recording
    from scissorcal.workday.workspace import Workspace

Effort = Literal["draft", "standard", "thorough"]
LOG = logging.getLogger("scissorcal")


def create_workspace(path: Path | str, recipe: Path | str = "paper-80gsm") -> "Workspace":
    """Make a workspace: the folder ``path`` with a copy of a recipe, as 'scissorcal init' does.

    ``recipe`` is a built-in one's name or a file. Raises InputError where the folder has a recipe
    already, or the recipe is wrong.

    >>> create_workspace("my-paper").recipe().name
    'paper-80gsm'
    """
    from scissorcal.workday.workspace import create_workspace as created

    return created(Path(path), str(recipe))


def open_workspace(path: Path | str = ".") -> "Workspace":
    """Open the workspace that the folder ``path`` lies in.

    The workspace names its files: ``recipe()``, ``recordings("friction")`` (all of them, excluded
    ones too), ``fit_path("cut")``.
    Unlike the commands it recovers no interrupted capture. Raises MissingError where there is no
    such folder, or no recipe.toml in it or above it, InputError where it is a file.

    >>> from pathlib import Path
    >>> from scissorcal.recipe.load import recipe_path
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
    of a cut has ``summary()``, ``fit["kappa"]`` and ``plot`` besides. The same file is read by
    ``arviz.from_netcdf``. Raises MissingError where there is no file, InputError where it is no fit
    of scissorcal.

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


def fit_friction(
    recordings: "Recording | Path | str | Sequence[Recording | Path | str]",
    *,
    recipe: "Recipe | Path | str | None" = None,
    effort: Effort = "standard",
    seed: int = 0,
    progress: "Progress | None" = None,
) -> "FitResult":
    """Fit inertia and friction to one recording of empty motion, or to several of one joint.

    Recordings may be files (.mcap). ``recipe`` (one of your own, its file, or a built-in one's
    name) has the priors and settings, which are the usual ones without it. ``effort`` is "draft"
    (quick, one law, intervals unchecked), "standard" or "thorough". Equal recordings, recipe and
    ``seed`` give equal draws, those of 'scissorcal fit friction' in a new workspace.

    Raises InputError where there is too little motion, a value is no measurement, or there is no
    such recipe, and UnknownNameError for an effort that there is not.

    >>> from scissorcal import examples
    >>> fit = fit_friction(examples.load("friction"), effort="draft")
    >>> print(f"{1e6 * fit['inertia'].mean:.0f} kg mm^2")
    190 kg mm^2
    """
    import numpy as np

    from scissorcal.calibration import FrictionRun, check_effort
    from scissorcal.calibration import fit_friction as fitted
    from scissorcal.recipe import FitFriction
    from scissorcal.workday.runs.friction import STREAM

    check_effort(effort)
    settings, run = FitFriction(), FrictionRun(progress=_with_log(progress))
    if recipe is not None:
        chosen = _recipe(recipe)
        tolerance = 0.01 * chosen.scene.tolerance_percent
        settings, run = chosen.fit.friction, FrictionRun(run.progress, tolerance=tolerance)
    used = _recordings(recordings, "friction")
    rng = np.random.default_rng([seed, STREAM])
    return fitted(used, settings, effort=effort, rng=rng, run=run)


def fit_cut(
    recordings: "Recording | Path | str | Sequence[Recording | Path | str]",
    recipe: "Recipe | Path | str",
    friction: "FitResult | Path | str",
    *,
    law: "ResponseLaw | None" = None,
    effort: Effort = "standard",
    seed: int = 0,
    progress: "Progress | None" = None,
) -> "FitResult":
    """Fit a material's response and fracture to recordings of cuts (or presses).

    ``recipe`` has blades, scene and priors; ``friction`` is the fit of empty motion, or its file.
    ``law`` is a response of your own (`ResponseLaw`) in the place of the recipe's families. The
    rest is as in `fit_friction`. The edge is the recipe's: one of photographs needs a
    workspace. Raises InputError where the blades hardly touched the material, or ``friction`` is
    another fit.

    >>> fit_cut("cut.mcap", "paper-80gsm", "friction.nc")
    Traceback (most recent call last):
    scissorcal.errors.MissingError: There is no file cut.mcap. Record one with 'scissorcal capture'.
    """
    import numpy as np

    from scissorcal.calibration import CutRun, check_effort
    from scissorcal.calibration import fit_cut as fitted
    from scissorcal.workday.runs.cut import STREAM

    check_effort(effort)
    used, chosen, known = _recordings(recordings, "cut"), _recipe(recipe), _friction(friction)
    rng = np.random.default_rng([seed, STREAM])
    run = CutRun(progress=_with_log(progress), own_law=law)
    return fitted(used, chosen, known, effort=effort, rng=rng, run=run)


def verify_fit(
    fit: "FitResult | Path | str",
    recordings: "Recording | Path | str | Sequence[Recording | Path | str]",
    recipe: "Recipe | Path | str | None" = None,
    friction: "FitResult | Path | str | None" = None,
    *,
    law: "ResponseLaw | None" = None,
    fits: int = 100,
    seed: int = 0,
    progress: "Progress | None" = None,
) -> "VerifyResult":
    """Check whether the intervals of a fit of `fit_friction` or `fit_cut` hold, in this process.

    Recordings, recipe, friction and ``law`` are those that the fit was made of. ``fits`` to
    simulated data are made (simulation-based calibration), and the checks of 'scissorcal verify';
    look at the result's ``verdicts`` and ``calibration``. Workspaces check theirs in several
    processes (`Workspace.verify`). Raises InputError where a cut comes without recipe or friction,
    a fit with a law of your own without that, for recordings that the fit was not made of, for a
    fit of anything else, and without any fit to make.
    """
    from scissorcal.calibration import FitResult
    from scissorcal.calibration.verify.check import StudySettings
    from scissorcal.calibration.verify.of_fit import check_fit, known_cut, known_friction
    from scissorcal.recipe import FitFriction

    if fits < 1:
        raise InputError(f"fits={fits} simulates nothing: give 20 at least, or 100.")
    checked = fit if isinstance(fit, FitResult) else open_fit(fit)
    if not isinstance(checked, FitResult):
        raise InputError(
            f"A fit of {checked.what} has no intervals that simulations check: give a fit of "
            "friction or of a cut."
        )
    if checked.what == "friction-advance":
        raise InputError(
            "A fit of the carriage's friction is checked in its workspace: 'scissorcal verify "
            "friction --axis advance'."
        )
    used = _recordings(recordings, checked.what)
    chosen = None if recipe is None else _recipe(recipe)
    if checked.what == "friction":
        known = known_friction(used, chosen.fit.friction if chosen else FitFriction(), checked)
    elif chosen is None or friction is None:
        raise InputError(
            "A fit of a cut is checked with its recipe and its fit of friction: give both "
            "(recipe=, friction=)."
        )
    else:
        known = known_cut(used, chosen, _friction(friction), checked, law=law)
    return check_fit(known, StudySettings(seed=seed), fits, _with_log(progress))


def _friction(given: "FitResult | Path | str") -> "FitResult":
    from scissorcal.calibration import FitResult

    known = given if isinstance(given, FitResult) else open_fit(given)
    if not isinstance(known, FitResult) or known.what != "friction":
        raise InputError(
            f"A fit of a cut builds on a fit of friction, and this one is of {known.what}: give "
            "the fit of fit_friction(), or fits/friction.nc."
        )
    return known


def _recordings(
    given: "Recording | Path | str | Sequence[Recording | Path | str]", kind: str
) -> "tuple[Recording, ...]":
    """The recordings that were given, those of files read; InputError for one of another kind."""
    from scissorcal.recording import Recording

    alone = isinstance(given, Recording | Path | str)
    items: Sequence[Recording | Path | str] = [given] if alone else given  # type: ignore[assignment,list-item]
    found = tuple(one if isinstance(one, Recording) else open_recording(one) for one in items)
    if not found:
        raise InputError("There is no recording to fit: give one, or a list of them.")
    for recording in found:
        if recording.kind != kind:
            raise InputError(
                f"{recording.source or 'The recording'} is of {recording.kind}, not of {kind}."
            )
    return found


def _recipe(given: "Recipe | Path | str") -> "Recipe":
    from scissorcal.recipe import Recipe
    from scissorcal.recipe.load import load_recipe, recipe_file

    return given if isinstance(given, Recipe) else load_recipe(recipe_file(str(given)))


def _with_log(progress: "Progress | None") -> "Progress":
    """Tell each new stage to the log, and everything to who follows."""
    last = ""

    def tell(done: float, sentence: str, /) -> None:
        nonlocal last
        stage = sentence.partition(" (")[0]
        if stage != last:
            LOG.info("%s", sentence)
            last = stage
        if progress is not None:
            progress(done, sentence)

    return tell


def _existing(path: Path | str, remedy: str) -> Path:
    if Path(path).is_dir():
        raise InputError(f"{path} is a folder, not a file. Name a file in it.")
    if not Path(path).is_file():
        raise MissingError(f"There is no file {path}. {remedy}")
    return Path(path)
