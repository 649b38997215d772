"""A device renders by itself: the package is loaded into it, and this computer watches."""

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from scissorcal.device.loop_verdicts import DEADLINE
from scissorcal.device.motion import Samples
from scissorcal.device.session import RigSession
from scissorcal.device.upload import load_image
from scissorcal.errors import DeviceError
from scissorcal.kernel import ModelTables, ServoConfig, StateFlag
from scissorcal.package import ModelPackage, image_of
from scissorcal.render.result import PASSIVITY
from scissorcal.verdicts import Verdict

SUPERVISOR_MS = 400
"""Without a heartbeat for five times as long the watching stops: the 2 s after which the device
brakes without a COMMAND (FW_RENDER_SILENCE_MS)."""


class Loaded(NamedTuple):
    """What a device holds: bytes of the image and its checksum."""

    size: int
    checksum: int

    @property
    def sentence(self) -> str:
        """For a recording."""
        return (
            f"The device rendered by itself, from {self.size} bytes with the checksum "
            f"{self.checksum:08x}."
        )


def load(
    session: RigSession, package: ModelPackage, config: ServoConfig, tables: ModelTables
) -> Loaded:
    """Have the device hold the package with these limits and admitted tables.

    Raises InputError for a package that no device renders, DeviceError as `load_image`.
    """
    image = image_of(package, config, tables)
    return Loaded(len(image), load_image(session.link, image, session.operator.progress))


def watching(config: ServoConfig) -> ServoConfig:
    """Configure a servo that watches: work is that of the torque that the device states."""
    energy = replace(config.passivity, is_measured=True, most_damping=0.0)
    return replace(config, supervisor_ms=SUPERVISOR_MS, passivity=energy)


def check_renders(samples: Samples) -> None:
    """Raise DeviceError where the device's motors are on and it renders no more."""
    flags = samples["flags"]
    driven = (flags & int(StateFlag.MOTOR_ENABLED)) != 0
    if np.any(driven & ((flags & int(StateFlag.RENDERING)) == 0)):
        raise DeviceError(
            "The device ended its rendering: it latched a fault, as it does after 2 s without a "
            "command of this computer. Close other programs, and start the rendering again."
        )


def watched_verdicts(verdicts: tuple[Verdict, ...]) -> tuple[Verdict, ...]:
    """The verdicts of a rendering, less what a computer that only watches cannot say."""
    return tuple(_watched(verdict) for verdict in verdicts)


def _watched(verdict: Verdict) -> Verdict:
    key = f"{verdict.scope} {verdict.check}"
    if key == DEADLINE["render"].key:
        why = "The device renders by itself: no command of this computer is felt."
        return DEADLINE["render"].not_evaluated(why, threshold=verdict.threshold)
    if key == PASSIVITY.key and verdict.status == "pass":
        why = "The device renders by itself and keeps no books of what the model takes."
        return PASSIVITY.not_evaluated(why, threshold=verdict.threshold)
    return verdict
