"""Take a capture into a workspace: rig, recording, and what is kept when something goes wrong."""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from scissorcal.errors import InputError
from scissorcal.recipe.load import read_text
from scissorcal.recipe.requirements import CaptureKind, requirements
from scissorcal.workday.rigs import line_of, open_rig
from scissorcal.workday.runs.probe import Say, ensure_probed, last_probe
from scissorcal.workday.workspace import Workspace

if TYPE_CHECKING:
    from scissorcal.device.capture import CaptureProgress, CaptureReport
    from scissorcal.device.loading import Confirm
    from scissorcal.kernel import Identity
    from scissorcal.recipe.schema import Recipe


@dataclass(frozen=True)
class Captured:
    """A finished capture: its file, its report, and the rig it was taken from."""

    path: Path
    report: "CaptureReport"
    rig: str


def capture_into(
    workspace: Workspace,
    kind: CaptureKind,
    device: str,
    *,
    hand: bool = False,
    seed: int = 0,
    baud: int | None = None,
    realtime: bool = False,
    progress: "CaptureProgress | None" = None,
    confirm: "Confirm | None" = None,
    say: "Say | None" = None,
) -> Captured:
    """Record friction or cuts from ``device`` into captures/<kind>-<stamp>.mcap.

    ``device`` is a port, or "sim" for a virtual rig with the recipe's specimen, in virtual time
    unless ``realtime``; each of its recordings of one ``seed`` has another noise. ``baud`` takes
    the place of the recipe's rate. ``hand`` (cuts
    only): motors off, a person or the virtual hand moves the handles. ``confirm`` asks a person to
    load material; a virtual rig loads by itself. A rig without a probe that counts is probed first
    (`ensure_probed`), and ``say`` tells so; a hand's capture needs none. Whatever was recorded
    before an error stays in the file.

    Raises InputError where the scene needs no such capture, and what the capture itself raises.
    """
    from scissorcal.device.capture import capture_cut, capture_friction, open_writer

    recipe = workspace.recipe()
    if not requirements(recipe).needs_capture(kind):
        raise InputError(f"{workspace.recipe_path}: this scene needs no capture of {kind}.")
    text = read_text(workspace.recipe_path)
    line = line_of(recipe, baud)
    run = len(workspace.recordings(kind))
    with open_rig(device, recipe.specimen, seed, run=run, realtime=realtime, line=line) as link:
        if hand:
            probe = last_probe(workspace, link)
        else:
            probe = ensure_probed(workspace, link, recipe, confirm=confirm, say=say)
        too_slow = speeds_below_encoder(recipe, link.identity) if kind == "friction" else ""
        if too_slow and say is not None:
            say(too_slow)
        path = workspace.new_recording(kind)
        with open_writer(path, kind, link, recipe, text, hand=hand, probe=probe) as writer:
            if kind == "friction":
                report = capture_friction(
                    link, recipe, writer, progress, confirm=confirm, probe=probe
                )
            else:
                report = capture_cut(link, recipe, writer, hand, progress, confirm, probe)
        return Captured(path, report, f"{link.identity.name} {link.identity.serial}")


def speeds_below_encoder(recipe: "Recipe", identity: "Identity") -> str:
    """Which planned speeds of friction a fit will not use, as a sentence; empty where it uses all.

    Below the rate's floor, which the encoder's step and the fit's cutoff give, the sign of the
    rate is noise.
    """
    from scissorcal.calibration.signals.filtering import rate_floor_of_step
    from scissorcal.calibration.signals.weak_form import RATE_BAND

    band_Hz = RATE_BAND * recipe.fit.friction.cutoff_Hz
    floor = rate_floor_of_step(identity.opening_resolution, band_Hz, 1e6 / identity.tick_us)
    slow = [speed for speed in recipe.capture.friction.speeds_rad_per_s if speed <= floor]
    if not slow:
        return ""
    listed = ", ".join(f"{speed:g}" for speed in slow)
    return (
        f"Sweeps at {listed} rad/s will not be used: an encoder with a step of "
        f"{identity.opening_resolution:.2g} rad tells the sense of motion from {floor:.2g} rad/s "
        "on. Leave them out of capture.friction.speeds_rad_per_s, or lower fit.friction.cutoff_Hz."
    )
