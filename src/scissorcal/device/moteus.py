"""A moteus controller (mjbots) behind a bridge, by the vendor's own Python client.

Position mode with both gains at zero and the torque as feedforward: so the controller gives the
torque alone. Register numbers and modes are those of its reference (docs/reference.md of
github.com/mjbots/moteus). Not yet run on hardware.
"""

import asyncio
import math
import weakref
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from scissorcal.errors import DeviceError, InputError, needs_extra
from scissorcal.kernel import Drive, FirmwareInputs, InputFlag

MODE, POSITION, TORQUE, Q_CURRENT, VOLTAGE, TEMPERATURE, FAULT = 0x0, 0x1, 0x3, 0x4, 0xD, 0xE, 0xF
MODE_FAULT, MODE_TIMEOUT = 1, 11
"""Modes that only a stop ends."""
TWO_PI = 2.0 * math.pi
OPTIONS = ("id", "sign", "zero_rad", "reply_s")


@dataclass
class MoteusController:
    """`scissorcal.device.bridge.Controller` for one moteus; it has no carriage.

    ``client`` is the vendor's Controller. The blades' opening is ``sign`` x 2 pi x position (turns
    of the output, behind the gear that the controller knows) + ``zero_rad``. ``reply_s`` is how
    long an answer may take.
    """

    client: Any
    sign: float = 1.0
    zero_rad: float = 0.0
    torque_limit: float = 1.0
    reply_s: float = 0.01
    watchdog_s: float = 0.01

    def __post_init__(self) -> None:
        self._loop = asyncio.new_event_loop()
        weakref.finalize(self, self._loop.close)
        self._mode = 0

    def exchange(self, torque: float, force: float, drive: Drive) -> FirmwareInputs | None:
        """Send one command with a query; as `Controller.exchange`. ``force`` has no motor."""
        if drive is Drive.DRIVE:
            command = self.client.make_position(
                position=math.nan,
                velocity=0.0,
                feedforward_torque=self.sign * torque,
                kp_scale=0.0,
                kd_scale=0.0,
                ilimit_scale=0.0,
                maximum_torque=self.torque_limit,
                watchdog_timeout=self.watchdog_s,
                ignore_position_bounds=1.0,
                query=True,
            )
        elif drive is Drive.BRAKE and self._mode not in (MODE_FAULT, MODE_TIMEOUT):
            command = self.client.make_brake(query=True)
        else:
            command = self.client.make_stop(query=True)
        try:
            reply = self._loop.run_until_complete(
                asyncio.wait_for(self.client.execute(command), self.reply_s)
            )
        except OSError:  # a timeout is one, too, and so is an adapter that was pulled
            return None
        if reply is None:
            return None
        values = reply.values
        self._mode = int(values[MODE])
        broken = self._mode in (MODE_FAULT, MODE_TIMEOUT)
        return FirmwareInputs(
            0,
            opening=self.sign * TWO_PI * values[POSITION] + self.zero_rad,
            motor_torque=self.sign * values[TORQUE],
            current=self.sign * values[Q_CURRENT],
            supply=values[VOLTAGE],
            temperature=values[TEMPERATURE],
            flags=int(InputFlag.DRIVER_FAULT) if broken else 0,
        )


def open_moteus(torque_limit: float, options: Mapping[str, Any]) -> MoteusController:
    """Open the controller by whatever adapter the vendor's client finds.

    ``options`` may have ``id`` (of the bus, by default 1), ``sign`` (1 or -1), ``zero_rad`` and
    ``reply_s`` of `MoteusController`. Raises InputError for others, and without the extra
    "moteus"; DeviceError where no adapter is found.
    """
    if wrong := sorted(set(options) - set(OPTIONS)):
        raise InputError(
            f"{wrong[0]} is no option of a moteus: the table controller takes {', '.join(OPTIONS)}."
        )
    for name, value in options.items():
        is_number = isinstance(value, int) or (name != "id" and isinstance(value, float))
        if isinstance(value, bool) or not is_number:
            raise InputError(f"The option {name} of a moteus is a number, not {value!r}.")
    known = {name: float(value) for name, value in options.items() if name != "id"}
    if abs(known.get("sign", 1.0)) != 1.0:
        raise InputError("The option sign of a moteus is 1 or -1.")
    try:
        import moteus
    except ImportError as error:
        raise needs_extra("device bridge moteus", "moteus", "moteus") from error
    resolution = moteus.QueryResolution()
    resolution.q_current = resolution.voltage = resolution.temperature = moteus.F32
    try:
        transport = moteus.get_singleton_transport()
    except RuntimeError as error:
        raise DeviceError(
            "No adapter to the bus of a moteus was found: plug it in, and allow this "
            "user to open it (docs/protocol.md has the rule for Linux)."
        ) from error
    client = moteus.Controller(
        id=int(options.get("id", 1)), query_resolution=resolution, transport=transport
    )
    return MoteusController(client, torque_limit=torque_limit, **known)
