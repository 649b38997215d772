"""What the rig measures, encoder steps and autocorrelated noise, and the faults it can be given."""

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from scissorcal.device.sim.specimen import Sensors
from scissorcal.errors import InputError
from scissorcal.kernel import PROTOCOL_VERSION, FaultCause

BLOCK = 4096


class Measured(NamedTuple):
    """One tick as the device reports it: SI units in the order of STATE, and three flags.

    ``opening`` (rad), ``advance`` (m), ``motor_torque`` (N m, positive opens the blades),
    ``handle_force`` (N, positive pushes the handles closed).
    """

    opening: float
    advance: float
    motor_torque: float
    handle_force: float
    at_stop: bool
    torque_saturated: bool
    force_saturated: bool


class NoiseChannel:
    """White noise plus a first-order autoregressive part, one number per tick."""

    __slots__ = ("_drawn", "_gain", "_keep", "_slow", "_white")

    def __init__(
        self, white: float, slow: float, time_ms: float, tick_ms: float, drawn: Iterator[float]
    ) -> None:
        """``white`` and ``slow`` are standard deviations, ``drawn`` gives standard normals."""
        self._keep = math.exp(-tick_ms / time_ms)
        self._gain = slow * math.sqrt(1.0 - self._keep * self._keep)
        self._white = white
        self._drawn = drawn
        self._slow = slow * next(drawn)

    def next(self) -> float:
        """Noise of the next tick."""
        self._slow = self._keep * self._slow + self._gain * next(self._drawn)
        return self._slow + self._white * next(self._drawn)


class SensorSet:
    """All sensors of one rig, with one stream of random numbers."""

    __slots__ = (
        "_advance_step",
        "_force",
        "_force_limit",
        "_force_zero",
        "_opening_step",
        "_torque",
        "_torque_zero",
    )

    def __init__(self, sensors: Sensors, tick_s: float, rng: np.random.Generator) -> None:
        drawn = standard_normals(rng)
        tick_ms = tick_s * 1e3
        self._opening_step = sensors.opening_step_rad
        self._advance_step = sensors.advance_step_um * 1e-6
        self._force_limit = sensors.handle_force_limit_N
        self._torque_zero = sensors.torque_zero_Nm
        self._force_zero = sensors.force_zero_N
        self._torque = NoiseChannel(
            sensors.torque_white_Nm, sensors.torque_slow_Nm, sensors.noise_time_ms, tick_ms, drawn
        )
        self._force = NoiseChannel(
            sensors.force_white_N, sensors.force_slow_N, sensors.noise_time_ms, tick_ms, drawn
        )

    def read(
        self,
        opening: float,
        advance: float,
        motor_torque: float,
        handle_force: float,
        at_stop: bool,
        torque_saturated: bool,
    ) -> Measured:
        """Turn true values into measured ones."""
        force = handle_force + self._force_zero + self._force.next()
        limit = self._force_limit
        saturated = not -limit < force < limit
        if saturated:
            force = limit if force > 0.0 else -limit
        return Measured(
            self._opening_step * math.floor(opening / self._opening_step + 0.5),
            self._advance_step * math.floor(advance / self._advance_step + 0.5),
            motor_torque + self._torque_zero + self._torque.next(),
            force,
            at_stop,
            torque_saturated,
            saturated,
        )


def standard_normals(rng: np.random.Generator) -> Iterator[float]:
    """Infinite standard normals as plain floats, drawn in blocks."""
    while True:
        yield from rng.standard_normal(BLOCK).tolist()


_KINDS = {
    "drop": "drop_share",
    "garble": "garble_share",
    "delay": "delay_ms",
    "unplug": "unplug_s",
    "stuck-encoder": "stuck_encoder_s",
    "protocol": "protocol_version",
    "not-homed": "not_homed",
    "unmeasured-torque": "unmeasured_torque",
}
_CAUSES = {
    cause.name.lower().replace("_", "-"): cause
    for cause in FaultCause
    if cause not in (FaultCause.NONE, FaultCause.WATCHDOG, FaultCause.ENCODER)
}
_HIGHEST = {"drop": 1, "garble": 1, "protocol": PROTOCOL_VERSION}
_HIGHEST |= dict.fromkeys(("not-homed", "unmeasured-torque"), 1)
_MEANINGS = (
    "drop=P and garble=P (a share from 0 to 1 of all frames), delay=MS (milliseconds), "
    f"unplug=S, stuck-encoder=S, {'=S, '.join(_CAUSES)}=S (seconds after streaming begins), "
    "protocol=1, not-homed=1 and unmeasured-torque=1"
)


@dataclass(frozen=True)
class Faults:
    """Which faults a virtual rig has; none by default.

    ``drop_share`` and ``garble_share`` (0 to 1) are probabilities per frame, either way on the
    line. ``delay_ms`` holds back every frame to the host, as an adapter with a long latency timer
    does. ``unplug_s``, ``stuck_encoder_s`` and ``cause_s`` count from the first STREAM; at
    ``cause_s`` the device latches a fault of ``cause``, which lasts. ``protocol_version`` is that
    of the device, ``not_homed`` one whose encoder has no zero at power-on, ``unmeasured_torque``
    one that states its command as ``motor_torque``.
    """

    drop_share: float = 0.0
    garble_share: float = 0.0
    delay_ms: float = 0.0
    unplug_s: float | None = None
    stuck_encoder_s: float | None = None
    cause: FaultCause = FaultCause.NONE
    cause_s: float | None = None
    protocol_version: int = PROTOCOL_VERSION
    not_homed: bool = False
    unmeasured_torque: bool = False


def parse_faults(options: Iterable[str]) -> Faults:
    """Read faults from words such as ``drop=0.01``; InputError where one is not valid.

    >>> faults = parse_faults(["drop=0.01", "heat=2.5"])
    >>> faults.drop_share, faults.cause.name, faults.cause_s
    (0.01, 'HEAT', 2.5)
    """
    values: dict[str, Any] = {}
    for option in options:
        kind, equals, number = option.partition("=")
        name = "cause_s" if kind in _CAUSES else _KINDS.get(kind)
        if name is None or not equals:
            raise InputError(f"The fault {option!r} is not known. Give {_MEANINGS}.")
        if name in values:
            raise InputError(f"The fault {kind} is given twice: give it once.")
        try:
            value = float(number)
        except ValueError:
            value = math.nan
        highest = _HIGHEST.get(kind, 1e6)
        if not 0.0 <= value <= highest:
            raise InputError(
                f"The fault {option!r} needs a number from 0 to {highest:g} after the equals sign: "
                f"give {_MEANINGS}."
            )
        values[name] = value
        if kind in _CAUSES:
            values["cause"] = _CAUSES[kind]
    if values.get("protocol_version", 1) not in (1, PROTOCOL_VERSION):
        raise InputError("The protocol of a virtual rig is 1 or 2: give protocol=1 or protocol=2.")
    for name, kind_of in (
        ("protocol_version", int),
        ("not_homed", bool),
        ("unmeasured_torque", bool),
    ):
        if name in values:
            values[name] = kind_of(values[name])
    return Faults(**values)


class FaultyLine:
    """A serial line that drops and garbles frames at random."""

    def __init__(self, faults: Faults, rng: np.random.Generator) -> None:
        self._faults = faults
        self._rng = rng

    def drops(self) -> bool:
        """Whether the next frame is lost."""
        share = self._faults.drop_share
        return share > 0.0 and bool(self._rng.random() < share)

    def garbled(self, data: bytes) -> bytes:
        """The bytes as they arrive: at random with one of them changed."""
        share = self._faults.garble_share
        if not data or share == 0.0 or self._rng.random() >= share:
            return data
        place = int(self._rng.integers(len(data)))
        changed = data[place] ^ int(self._rng.integers(1, 256))
        return data[:place] + bytes([changed]) + data[place + 1 :]
