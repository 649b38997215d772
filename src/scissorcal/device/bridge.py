"""A bridge: a device for scissorcal in front of a motor controller with another protocol.

The firmware's core runs in this process. Each tick makes one exchange with the controller: what the
last tick decided goes there, what it measures comes back. A lab writes the class for its own
controller: one method (docs/bridge.md).
"""

import time
import tomllib
from collections.abc import Callable
from dataclasses import fields
from pathlib import Path
from typing import Any, Protocol

from scissorcal.device.sim.server import ServeReport, serve_side
from scissorcal.errors import InputError
from scissorcal.kernel import Drive, FirmwareBoard, FirmwareCore, FirmwareInputs, InputFlag

CONTROLLER = "controller"
"""Table of a board's file that holds what the controller's class takes."""
TEXT_BYTES = 16
"""Of name and serial in an IDENTITY."""


class Controller(Protocol):
    """What a lab writes for a controller.

    ``watchdog_s`` is set by the bridge before each exchange: after that time without one the
    controller shall brake by itself, which holds the blades if this process or its cable dies.
    """

    watchdog_s: float

    def exchange(self, torque: float, force: float, drive: Drive) -> FirmwareInputs | None:
        """Have the motors do this until the next exchange, and return what is measured.

        ``torque`` is in N m at the blades, positive opens; ``force`` in N along the cut. They are 0
        unless ``drive`` is Drive.DRIVE. ``device_us`` of what is returned may be 0: the bridge
        stamps it. None where no answer came: a fault of the driver until one does.
        """


def clock_us() -> int:
    """Microseconds of this computer's clock, for stamps."""
    return time.monotonic_ns() // 1000


class Bridge:
    """The device side of a bridge: serve it with `serve_bridge`, or drive it in lockstep."""

    unplugged = False

    def __init__(
        self, board: FirmwareBoard, controller: Controller, clock: Callable[[], int] = clock_us
    ) -> None:
        """Start released. Raises ValueError where the board's table is impossible."""
        self._core = FirmwareCore(board)
        self._controller = controller
        self._clock = clock
        self._torque = self._force = 0.0
        self._drive = Drive.RELEASE
        self._last = FirmwareInputs(0, 0.0, supply=board.supply_min)  # silence is no lack of supply
        self._received = b""
        self._sent: list[bytes] = []

    @property
    def garbled(self) -> int:
        """Frames from the host that were discarded."""
        return self._core.garbled

    def receive(self, data: bytes) -> None:
        """Take bytes from the host, in pieces of any size."""
        self._received += data

    def tick(self) -> None:
        """Exchange, decide, send: a command acts with the exchange of the next tick."""
        self._controller.watchdog_s = 1e-3 * self._core.brake_after_ms
        asked_us = self._clock()
        inputs = self._controller.exchange(self._torque, self._force, self._drive)
        if inputs is None:
            inputs = self._last._replace(flags=self._last.flags | int(InputFlag.DRIVER_FAULT))
        else:
            self._last = inputs
        stamp_us = (asked_us + self._clock()) // 2  # the controller measures in between
        out = self._core.tick(inputs._replace(device_us=stamp_us & 0xFFFFFFFF), self._received)
        self._received = b""
        self._torque, self._force, self._drive = out.torque, out.force, out.drive
        self._sent.append(out.sent)

    def take(self) -> list[bytes]:
        """Bytes for the host, oldest first."""
        sent, self._sent = self._sent, []
        return sent


def serve_bridge(
    board: FirmwareBoard,
    controller: Controller,
    announce: Callable[[str], None] = print,
    should_stop: Callable[[], bool] = lambda: False,
) -> ServeReport:
    """Serve a controller as a device on a new pseudo-terminal until stopped; the motors end free.

    ``announce`` and ``should_stop`` are as those of `scissorcal.device.sim.server.serve`.
    """
    try:
        return serve_side(Bridge(board, controller), 1e-6 * board.tick_us, announce, should_stop)
    finally:
        controller.exchange(0.0, 0.0, Drive.RELEASE)


def read_board(path: Path) -> tuple[FirmwareBoard, dict[str, Any]]:
    """Read a board's TOML file: the constants of `FirmwareBoard`, and the table ``controller``.

    Raises InputError where it cannot be read, has an unknown or lacks a needed constant, has one of
    the wrong kind, or states an impossible board.
    """
    try:
        table = tomllib.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise InputError(f"The board's file {path} cannot be read: {error}.") from error
    options = table.pop(CONTROLLER, {})
    if not isinstance(options, dict):
        raise InputError(f"{path}: {CONTROLLER} is a table: see docs/bridge.md.")
    kinds = {field.name: field.type for field in fields(FirmwareBoard)}
    if unknown := sorted(set(table) - set(kinds)):
        raise InputError(f"{path}: {unknown[0]} is no constant of a board: see docs/bridge.md.")
    for name, value in table.items():
        wanted = (int, float) if kinds[name] is float else kinds[name]
        if isinstance(value, bool) or not isinstance(value, wanted):  # type: ignore[arg-type]
            raise InputError(
                f"{path}: {name} = {value!r} is of the wrong kind: see docs/bridge.md."
            )
        if isinstance(value, str) and not (value.isascii() and len(value) <= TEXT_BYTES):
            raise InputError(
                f"{path}: {name} = {value!r} does not fit an identity: it has at most {TEXT_BYTES} "
                "ASCII characters."
            )
    try:
        board = FirmwareBoard(**table)
        FirmwareCore(board)
    except TypeError as error:
        raise InputError(f"{path}: constants are missing: {error}. See docs/bridge.md.") from error
    except (ValueError, OverflowError) as error:
        raise InputError(f"{path}: {error}") from error
    return board, options
