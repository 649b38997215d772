"""What a workspace's friction fit predicts of a motion, with a band, as table and plot."""

import csv
from dataclasses import replace
from importlib.util import find_spec
from pathlib import Path

import numpy as np

from scissorcal.aliases import Progress
from scissorcal.calibration import friction_experiment
from scissorcal.calibration.friction.predict import (
    Band,
    Prediction,
    effort_band,
    load_band,
    predict_effort,
    predict_far_load,
)
from scissorcal.calibration.result import FitResult
from scissorcal.errors import InputError, needs_extra
from scissorcal.files import replacing
from scissorcal.foreign import open_foreign, reading
from scissorcal.foreign.formats import LOG
from scissorcal.recording import ImportOptions, Joint, Recording, import_table, read_recording
from scissorcal.recording.layout import column_name
from scissorcal.workday.engine import Engine
from scissorcal.workday.options import PredictOptions
from scissorcal.workday.recordings import used_recordings
from scissorcal.workday.runs.fit import load_result
from scissorcal.workday.workspace import Workspace

CHANNELS = ("opening", "motor_torque", "handle_force", "torque_command", "force_command")
_LONGEST_HEADING = 100_000
TABLES = (".csv", ".parquet")
PLOTS = (".svg", ".png")
MOST_POINTS = 4000


def predict_workspace(
    workspace: Workspace, options: PredictOptions, progress: Progress | None = None
) -> tuple[Prediction, Band, FitResult]:
    """Predict the effort of empty motion, or the load at a tool's far end, for one file.

    Gives the prediction, its band and the fit that made it. The band is calibrated on the friction
    recordings of the workspace. Raises MissingError where the fit is missing or stale, InputError
    for files that are no motion.
    """
    tell = progress or (lambda done, sentence: None)
    level, table, plot = options.level, options.table, options.plot
    _refuse_files(table, plot)
    engine = Engine.of(workspace)
    recipe = engine.recipe
    fit = load_result(engine, "friction")
    settings = recipe.fit.friction
    tell(0.0, "prediction: reading recordings")
    own = used_recordings(workspace, recipe, "friction", engine.index)
    given = _read_motion(options.motion, own[0].joint, own[0].handle_radius_m)
    tell(0.2, "prediction: calibrating the band on what the fit had not seen")
    design = friction_experiment(own, settings, fit)
    if options.what == "load":
        band = load_band(design, fit, own, settings.cutoff_Hz, level)
        tell(0.8, "prediction: solving for the load")
        found = predict_far_load(fit, band, (given,), settings.cutoff_Hz)
    else:
        band = effort_band(design, fit, level)
        tell(0.8, "prediction: weighing the motion")
        found = predict_effort(fit, band, (given,), settings.cutoff_Hz)
    if table is not None:
        _write_table(found, table, fit.position_unit, fit.effort_unit)
    if plot is not None:
        _write_plot(found, band, plot, fit.effort_unit)
    tell(1.0, "prediction: done")
    return found, band, fit


def _read_motion(path: Path, joint: Joint, handle_radius_m: float) -> Recording:
    """Read a recording, or a table of motion with units in its headings.

    Raises InputError where columns are missing, or the joint is of another kind than ``joint``.
    """
    if not path.is_file():
        raise InputError(f"{path} does not exist: name a recording (.mcap) or a table of motion.")
    if path.suffix.lower() not in TABLES:
        read = read_recording(path)
    else:
        read = _read_table(path, joint, handle_radius_m)
    if read.joint.kind != joint.kind:
        raise InputError(
            f"{path} is of a {read.joint.kind} joint and the fit of a {joint.kind} one: name a "
            "recording of the same rig."
        )
    return read


def _read_table(path: Path, joint: Joint, handle_radius_m: float) -> Recording:
    headings = _headings(path)
    opening = column_name("opening", joint)
    missing = [name for name in ("time_s", opening) if name not in headings]
    if missing:
        raise InputError(
            f"{path} has no column {' and none '.join(missing)}. A table of motion has time_s and "
            f"{opening}, as 'scissorcal export' writes them; bring others in with 'scissorcal "
            "import' and name the recording."
        )
    columns: dict[str, str | int] = {"time": "time_s"}
    for channel in CHANNELS:
        name = column_name(channel, joint)
        usable = channel != "handle_force" or handle_radius_m > 0
        if name in headings and usable:
            columns[channel] = name
    read = import_table(
        path,
        columns=columns,
        options=ImportOptions(
            joint=joint,
            handle_radius_m=handle_radius_m if "handle_force" in columns else float("nan"),
            motion_only=True,
        ),
    )
    return replace(read, source=str(path))


def _headings(path: Path) -> list[str]:
    if path.suffix.lower() == ".parquet":
        from scissorcal.recording.table_file import parquet_headings

        return parquet_headings(path)

    with open_foreign(path, LOG) as file:
        first = file.readline(_LONGEST_HEADING)
    with reading(path, LOG):
        row = next(csv.reader([first.decode("utf-8-sig", errors="replace")]), [])
        return [cell.strip() for cell in row]


def _refuse_files(table: Path | None, plot: Path | None) -> None:
    """Refuse before any work what could not be written after it."""
    for path, endings in ((table, (".csv",)), (plot, PLOTS)):
        if path is None:
            continue
        if path.suffix.lower() not in endings:
            raise InputError(f"{path}: give the name the ending {' or '.join(endings)}.")
        if not path.parent.is_dir():
            raise InputError(f"{path.parent} is no folder. Make it first, or choose another.")
    if plot is not None and find_spec("matplotlib") is None:
        raise needs_extra("--plot", "matplotlib", "plots", "give --table FILE.csv")


def _write_table(found: Prediction, path: Path, position: str, effort: str) -> None:
    unit = effort.replace(" ", "")
    head = ["time_s", f"opening_{position}", f"opening_rate_{position}_per_s", "moving"]
    head += [f"{name}_{unit}" for name in ("measured", "predicted", "low", "high")]
    arrays = (found.time_s, found.opening, found.rate, found.moving.astype(int))
    numbers = (*arrays, found.measured, found.predicted, found.low, found.high)
    with replacing(path) as part, part.open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(head)
        for row in zip(*(array.tolist() for array in numbers), strict=True):
            writer.writerow(["" if value != value else value for value in row])


def _write_plot(found: Prediction, band: Band, path: Path, unit: str) -> None:
    from matplotlib.figure import Figure

    thin = slice(None, None, max(1, -(-len(found.time_s) // MOST_POINTS)))
    time = found.time_s[thin]
    known = np.isfinite(found.low)[thin]
    predicted = np.where(known, found.predicted[thin], np.nan)
    figure = Figure(figsize=(9.0, 4.0), layout="constrained")
    axes = figure.add_subplot()
    low, high = np.where(known, found.low[thin], np.nan), np.where(known, found.high[thin], np.nan)
    axes.fill_between(time, low, high, color="#56b4e9", alpha=0.4, lw=0, label=f"{band.level:.0%}")
    if np.any(np.isfinite(found.measured)):
        axes.plot(time, found.measured[thin], color="#333333", lw=0.7, label="measured")
    axes.plot(time, predicted, color="#d55e00", lw=1.0, ls="--", label="predicted")
    axes.set_xlabel("time / s")
    axes.set_ylabel(f"effort / ({unit})")
    axes.legend(loc="upper right", ncols=3, fontsize="small")
    kind = path.suffix.lower()[1:]
    with replacing(path) as part:
        figure.savefig(part, format=kind, metadata={"Date": None} if kind == "svg" else None)
