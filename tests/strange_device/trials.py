"""What scissorcal says of a strange device: a capture or a rendering with each fault.

Every trial is short and in virtual time: one recording of friction, one sheet, one rendering.
"""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from scissorcal.device import Operator, RigSession, open_writer, unloaded_sentence
from scissorcal.device.capture import capture
from scissorcal.device.probe.probe import probe
from scissorcal.errors import DeviceError, ScissorcalError
from scissorcal.package import ModelPackage
from scissorcal.recipe import Recipe, builtin_recipe
from scissorcal.recording import Recording, read_recording
from scissorcal.render import Rendering, RigFacts, render
from scissorcal.render import open_writer as open_render_writer
from scissorcal.verdicts import failed

from .device import StrangeDevice
from .faults import FAULTS, Faults
from .mechanics import Hand
from .person import Person
from .port import VirtualPort

SEED = 11
RENDER_S = 6.0
STATED = ("clipping", "count scale")
"""Checks of a probe that are stated as not made where the rig or the recipe does not allow them."""
RENDER_ADVANCE_M = -0.02


@dataclass(frozen=True)
class Outcome:
    """What was said, the exit code that a command ends with, and the truth at the device.

    ``stop`` names the servo's stop, empty where it did not stop by itself. ``torque`` (N m) and
    ``rate`` (rad/s) are the largest of motor and blades until the end, ``time_s`` its time since
    the device was switched on, ``recording`` what was kept.
    """

    said: str
    exit_code: int
    stop: str
    torque: float
    rate: float
    time_s: float
    recording: Recording | None


def short_recipe() -> Recipe:
    """Paper, with one speed of each kind and one sheet."""
    whole = builtin_recipe("paper-80gsm")
    friction = {"speeds_rad_per_s": (0.6,), "repeats": 1, "excitation_s": 1.0}
    cut = {"speeds_rad_per_s": (0.6,), "strokes_per_sheet": 2, "sheets": 1}
    facts = whole.model_dump(exclude_unset=True)
    facts["capture"] = {"friction": friction, "cut": cut}
    return Recipe.model_validate(facts)


def probe_trial(name: str) -> Outcome:
    """Probe a device with one fault."""
    device = StrangeDevice(FAULTS[name], seed=SEED)

    def run() -> str:
        found = probe(
            RigSession(VirtualPort(device), builtin_recipe("paper-80gsm"), Operator(Person(device)))
        )
        warned = [v.why for v in found.verdicts if v.status != "pass" and v.check not in STATED]
        return "; ".join(["done", *warned])

    return _outcome(run, device, None)


def capture_trial(name: str, kind: str, folder: Path, faults: Faults | None = None) -> Outcome:
    """Capture ``kind`` ("friction" or "cut") on a device with one fault."""
    device = StrangeDevice(faults or FAULTS[name], seed=SEED)
    recipe = short_recipe()
    path = folder / f"{kind}.mcap"

    def confirm(request: str) -> None:
        if "fresh piece" in request:
            device.load()
        else:
            device.sheet = None

    def run() -> str:
        link = VirtualPort(device)
        with open_writer(
            RigSession(link, recipe), "cut" if kind == "cut" else "friction", path
        ) as writer:
            if kind == "cut":
                report = capture(RigSession(link, recipe, Operator(confirm)), "cut", writer)
            else:
                report = capture(RigSession(link, recipe, Operator(confirm)), "friction", writer)
        tally = report.tally
        found = [f"{tally.lost} frames lost"] if tally.lost else []
        found += [f"{tally.faults} faults"] if tally.faults else []
        found += [unloaded_sentence(stroke) for stroke in report.empty[:1]]
        return "; ".join(["done", *found])

    return _outcome(run, device, path)


def render_trial(
    name: str,
    package: ModelPackage,
    folder: Path,
    faults: Faults | None = None,
    *,
    hand: Hand | None = None,
    rig: RigFacts | None = None,
) -> Outcome:
    """Render on a device with one fault, a hand at the handles; ``rig`` is what is known of it."""
    device = StrangeDevice(faults or FAULTS[name], seed=SEED)
    device.carriage.place = RENDER_ADVANCE_M
    device.blades.place = Hand().high
    path = folder / "render.mcap"

    def run() -> str:
        link = VirtualPort(device)
        with open_render_writer(RigSession(link, package.recipe), package, path) as writer:
            result = render(
                RigSession(
                    link, package.recipe, Operator(lambda request: device.grasp(hand or Hand()))
                ),
                package,
                Rendering(RENDER_S),
                writer=writer,
                rig=rig,
            )
        wrong = failed(result.verdicts)
        still = [warning for warning in result.warnings if "a single count" in warning]
        said = [f"{v.check}: {v.why}" for v in wrong] or ["done", *still]
        return "; ".join(said)

    return _outcome(run, device, path)


def _outcome(run: Callable[[], str], device: StrangeDevice, path: Path | None) -> Outcome:
    stop = ""
    try:
        said = run()
        code = 0 if said.startswith("done") else 3
    except ScissorcalError as error:
        said, code = str(error), error.exit_code
        stop = error.stop if isinstance(error, DeviceError) else ""
    recording = read_recording(path) if path and path.is_file() else None
    torque, rate = device.largest_torque, device.largest_rate
    return Outcome(said, code, stop, torque, rate, device.time_s, recording)
