"""A build behind the wire, right or with one thing wrong, and what the probe finds of it."""

import math
import struct
from dataclasses import dataclass, replace

from scissorcal.device import Operator, RigSession
from scissorcal.device.probe.probe import probe
from scissorcal.errors import DeviceError
from scissorcal.recipe import builtin_recipe
from scissorcal.recording import ProbeResult

from ..random_rigs.link import RigLink
from ..random_rigs.person import Person
from ..random_rigs.rigs import RigParameters
from ..strange_device import wire
from .parts import Build

CAPABILITIES, FORCE_LIMIT, ADVANCE_RANGE, OPENING, MOTOR_TORQUE, HANDLE_FORCE = (
    2,
    60,
    72,
    12,
    20,
    24,
)
"""Offsets (bytes) in IDENTITY and STATE."""


@dataclass(frozen=True)
class Wrong:
    """What is wrong with a build; by default nothing.

    ``rig`` are fields of RigParameters. ``slips_above`` (rad/s at the blades) is the rate beyond
    which the capstan slips, by half. ``saturates_at`` (N m at the blades) is the end of the current
    sensor's range. ``limit_share`` is the share of the torque limit that the board's table has.
    """

    rig: tuple[tuple[str, float], ...] = ()
    slips_above: float = math.inf
    saturates_at: float = math.inf
    limit_share: float = 1.0


NOTHING = Wrong()


@dataclass(frozen=True)
class Said:
    """What the probe said of a build, its result, and the truth at the blades meanwhile."""

    refusal: str
    result: ProbeResult | None
    rig: RigParameters
    largest_rate: float
    seconds: float


class BuildLink(RigLink):
    """A link to a build: no carriage, a force sensor only where it has one."""

    def __init__(self, build: Build, seed: int, wrong: Wrong = NOTHING) -> None:
        self._build, self._wrong = build, wrong
        self._slip = 0.0
        self._last: float | None = None
        rig = replace(build.rig(seed), **dict(wrong.rig))  # type: ignore[arg-type]
        super().__init__(replace(rig, torque_limit=wrong.limit_share * rig.torque_limit))

    def _identity(self, nonce: int) -> bytes:
        payload = bytearray(super()._identity(nonce))
        (capabilities,) = struct.unpack_from("<H", payload, CAPABILITIES)
        if not self._build.force_sensor:
            struct.pack_into("<H", payload, CAPABILITIES, capabilities & ~wire.FORCE_SENSOR)
        struct.pack_into("<f", payload, FORCE_LIMIT, 0.0)
        struct.pack_into("<ff", payload, ADVANCE_RANGE, 0.0, 0.0)
        return bytes(payload)

    def _state(self, flags: int) -> bytes:
        payload = bytearray(super()._state(flags))
        opening, _, torque, force = struct.unpack_from("<ffff", payload, OPENING)
        step = self.rig.step
        slipped = step * round(self._slipped() / step)
        end = self._wrong.saturates_at
        struct.pack_into("<f", payload, OPENING, opening - slipped)
        struct.pack_into("<f", payload, MOTOR_TORQUE, min(max(torque, -end), end))
        struct.pack_into("<f", payload, HANDLE_FORCE, force if self._build.force_sensor else 0.0)
        return bytes(payload)

    def _slipped(self) -> float:
        """How far the motor's encoder has fallen behind the blades (rad at the blades)."""
        place = self.joint.place
        moved = 0.0 if self._last is None else place - self._last
        self._last = place
        if abs(moved) > self._wrong.slips_above * 1e-6 * self.rig.tick_us:
            self._slip += 0.5 * moved
        return self._slip


def probe_of(build: Build, seed: int, wrong: Wrong = NOTHING) -> Said:
    """Probe a build with a person beside it."""
    refusal, result = "", None
    link = BuildLink(build, seed, wrong)
    recipe = builtin_recipe("paper-80gsm")
    try:
        result = probe(RigSession(link, recipe, Operator(Person(link))))
    except DeviceError as error:
        refusal = str(error)
    return Said(refusal, result, link.rig, link.largest_rate, link.time_s)
