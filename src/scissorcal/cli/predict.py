"""``scissorcal predict``"""

import math
from typing import TYPE_CHECKING

import typer

from scissorcal.cli.opening import open_workspace
from scissorcal.cli.options import Folder, options_of
from scissorcal.cli.output import Answer, command
from scissorcal.cli.progress import progress
from scissorcal.workday.options import PredictOptions

if TYPE_CHECKING:
    from scissorcal.calibration.friction.predict import Band, Prediction


_OPTIONS = {
    "what": typer.Argument(help="What to predict."),
    "motion": typer.Argument(dir_okay=False, help="A recording, or a table of the motion."),
    "level": typer.Option(
        min=0.5, max=0.99, help="Probability with which a measured sample lies in the band."
    ),
    "table": typer.Option(dir_okay=False, help="Write a table here (.csv)."),
    "plot": typer.Option(dir_okay=False, help="Draw it here (.svg or .png)."),
}


@command
@options_of(_OPTIONS)
def predict(options: PredictOptions, folder: Folder = None) -> Answer:
    """Predict the effort of MOTION from the friction fit, with a band for measured samples.

    friction: the effort that drives the empty joint through MOTION. load: the load at the far end
    of a two-ended tool, from torque and motion at the driven end; the law must know load. MOTION is
    a recording, or a table with the columns time_s and opening_rad (opening_m for a linear joint)
    as export writes it; efforts in it are compared and not used, but for the driven end's torque.

    The band is calibrated on strokes (or whole recordings, where there are nine or more) that were
    left out of the fit, and the answer states which, and how much wider it is for a whole new
    recording. Friction at rest is not predicted.

    \b
    Example:
      $ scissorcal predict friction captures/friction-20261122T091500Z.mcap --plot torque.svg
      friction: coulomb + viscous, symmetric, over 21.6 s of motion
      90% band: +- 0.00184 N m
      90% of the samples of a new stroke, recorded like those of the fit, lie in the band: its ...
      new recording: may lie outside; one recording does not show how far
      measured: 93.1% of 4316 samples in the band, rms error 0.00121 N m
      torque.svg
    """
    from scissorcal.workday.runs.predict import predict_workspace

    with progress() as tell:
        prediction, band, fit = predict_workspace(open_workspace(folder), options, tell)
    result = {
        "what": options.what,
        "candidate": fit.candidate,
        "effort_unit": fit.effort_unit,
        "position_unit": fit.position_unit,
        "band": band,
        "promise": band.sentence,
        "share_inside": prediction.share_inside,
        "rms_error": prediction.rms_error,
        "moving_s": _moving_s(prediction),
        "samples": len(prediction.time_s),
    }
    head = f"{options.what}: {fit.candidate}, over {_moving_s(prediction):.1f} s of motion"
    files = [path for path in (options.table, options.plot) if path is not None]
    lines = [head, *_lines(prediction, band, fit.effort_unit), *map(str, files)]
    return Answer(result, "\n".join(lines), files=files)


def _lines(found: "Prediction", band: "Band", unit: str) -> list[str]:
    width = f"{band.level:.0%} band: +- {band.moving:.3g} {unit}"
    if band.resting is not None and band.resting != band.moving:
        width += f", {band.resting:.3g} {unit} near rest"
    lines = [width, band.sentence, _new_recording(band, unit)]
    if math.isnan(found.share_inside):
        return [*lines, "measured: this file holds no effort to compare with"]
    import numpy as np

    count = int(np.count_nonzero(np.isfinite(found.low) & np.isfinite(found.measured)))
    measured = f"measured: {found.share_inside:.1%} of {count} samples in the band"
    return [*lines, f"{measured}, rms error {found.rms_error:.3g} {unit}"]


def _new_recording(band: "Band", unit: str) -> str:
    """What a whole new recording may differ by, beside the band of a new stroke."""
    if band.new_recording is None:
        return "new recording: may lie outside; one recording does not show how far"
    return (
        f"new recording: +- {band.new_recording:.3g} {unit}, by {band.recordings} recordings that "
        "were left out"
    )


def _moving_s(found: "Prediction") -> float:
    """Time that the joint moves, in seconds."""
    import numpy as np

    time = found.time_s
    step = float(np.median(np.diff(time))) if len(time) > 1 else 0.0
    return float(np.count_nonzero(found.moving) * step)
