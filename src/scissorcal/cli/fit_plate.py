"""What ``scissorcal fit plate`` says."""

from typing import TYPE_CHECKING

from scissorcal.cli.output import table

if TYPE_CHECKING:
    from collections.abc import Mapping

    from scissorcal.calibration.plate.result import PlateFit
    from scissorcal.vision.geometry.pose import Pose
    from scissorcal.workday.runs.fit import FitOutcome


def text(outcome: "FitOutcome") -> str:
    """What people read of the fit of a plate's pose."""
    fit: PlateFit = outcome.result
    head = f"plate: {len(fit.views)} photographs of the {fit.target}, rms {fit.rms_px:.2f} px"
    if outcome.cached:
        head = "plate: nothing changed since the last fit"
    poses = {"camera": fit.camera_plate}
    if fit.rig_plate:
        poses["rig"] = fit.rig_plate
    rows = [["frame", "x mm", "y mm", "z mm", "yaw deg", "pitch", "roll", "sd mm", "sd deg"]]
    rows += [_row(name, pose) for name, pose in poses.items()]
    lines = [head, table(rows, right=range(1, 9)), *pose_lines(poses)]
    return "\n".join(lines)


def _row(name: str, pose: "Pose") -> list[str]:
    import numpy as np

    cells = [name, *(f"{1e3 * value:.2f}" for value in pose.translation_m)]
    cells += pose.euler_angles.printed
    if pose.covariance is None:
        return [*cells, "", ""]
    sd = np.sqrt(np.diag(pose.covariance))
    worst = np.degrees(sd[:3].max())
    return [*cells, f"{1e3 * sd[3:].max():.2g}", f"{worst:.2g}"]


def facts(outcome: "FitOutcome") -> dict[str, object]:
    """What ``--json`` prints of the fit of a plate's pose."""
    fit: PlateFit = outcome.result
    return {
        "cached": outcome.cached,
        "target": fit.target,
        "camera_plate": fit.camera_plate,
        "rig_plate": fit.rig_plate,
        "other": fit.other,
        "odds": min(fit.odds, 1e12),
        "views": fit.views,
        "two_halves": fit.halves,
        "rms_px": fit.rms_px,
        "inputs_hash": fit.inputs_hash,
        "pictures": outcome.pictures,
    }


def pose_lines(poses: "Mapping[str, Pose]") -> list[str]:
    """Quaternions of poses by the names of their frames, notes on their angles, the convention."""
    from scissorcal.recipe.euler_angles import CONVENTION, quaternion_words

    lines = [f"quaternion, {name}: {quaternion_words(p.quaternion)}" for name, p in poses.items()]
    notes = {name: pose.euler_angles.note for name, pose in poses.items()}
    lines += [f"note, {name}: {note}" for name, note in notes.items() if note]
    return [*lines, f"yaw, pitch, roll: {CONVENTION}"]
