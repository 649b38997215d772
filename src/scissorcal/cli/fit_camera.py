"""What ``scissorcal fit camera`` says."""

from typing import TYPE_CHECKING

from scissorcal.cli.output import table

if TYPE_CHECKING:
    from scissorcal.calibration.camera.result import CameraFit
    from scissorcal.workday.runs.fit import FitOutcome

_WORST = 3


def camera_table(fit: "CameraFit") -> str:
    """Set out a camera's parameters for people."""
    import numpy as np

    from scissorcal.vision.geometry.camera import PARAMETERS

    camera = fit.camera
    values = (camera.fx, camera.fy, camera.cx, camera.cy, *camera.distortion[:5])
    known = camera.covariance
    rows = [["parameter", "unit", "mean", "sd"]]
    for index, (name, value) in enumerate(zip(PARAMETERS, values, strict=True)):
        unit = "px" if index < 4 else "1"
        digits = f"{value:.2f}" if index < 4 else f"{value:.5f}"
        sd = "" if known is None else f"{float(np.sqrt(known[index, index])):.2g}"
        held = known is not None and known[index, index] == 0.0
        rows.append([name, unit, digits, "held" if held else sd])
    return table(rows, right=(2, 3))


def text(outcome: "FitOutcome") -> str:
    """What people read of the fit of a camera."""
    fit: CameraFit = outcome.result
    camera = fit.camera
    size = f"{camera.width} x {camera.height}"
    if fit.origin == "imported":
        return f"camera: {size}, {' '.join(fit.notes)}\n{camera_table(fit)}"
    head = f"camera: {size}, {len(fit.views)} photographs of the {fit.board}, {fit.candidate}"
    if outcome.cached:
        head = f"camera: nothing changed since the last fit; {fit.candidate} is as it was"
    lines = [head, camera_table(fit)]
    together = (
        f"those of one photograph go together: intervals are {fit.stretch:.1f} times as wide for it"
        if fit.stretch > 1.05
        else "independently of one another"
    )
    lines.append(f"corners are found to {fit.noise_px:.2f} px, {together}")
    bulge = max(fit.bulge_mm, key=abs)
    lines.append(f"the board's middle stands {abs(bulge):.2f} mm out of its plane")
    worst = sorted(fit.views, key=lambda view: -view.rms_px)[:_WORST]
    rows = [["worst photographs", "rms px", "worst px", "px a square", "tilt deg"]]
    rows += [
        [
            view.name,
            f"{view.rms_px:.2f}",
            f"{view.worst_px:.2f}",
            f"{view.square_px:.0f}",
            f"{view.tilt_deg:.0f}",
        ]
        for view in worst
    ]
    lines.append(table(rows, right=range(1, 5)))
    lines += [*fit.notes, *outcome.notes]
    return "\n".join(lines)


def facts(outcome: "FitOutcome") -> dict[str, object]:
    """What ``--json`` prints of the fit of a camera."""
    fit: CameraFit = outcome.result
    camera = fit.camera
    return {
        "camera": camera,
        "origin": fit.origin,
        "cached": outcome.cached,
        "board": fit.board,
        "candidate": fit.candidate,
        "candidates": fit.candidates,
        "views": fit.views,
        "noise_px": fit.noise_px,
        "stretch": fit.stretch,
        "bulge_mm": fit.bulge_mm,
        "region_share": fit.region_share,
        "notes": [*fit.notes, *outcome.notes],
        "two_halves": fit.cross,
        "inputs_hash": fit.inputs_hash,
        "pictures": outcome.pictures,
    }
