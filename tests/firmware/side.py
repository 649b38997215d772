"""The firmware's core as the device side of a virtual rig: the rig has only mechanics and sensors.

One tick measures what the last drive brought about, takes what the host sent since, decides, drives
the rig for a tick, and sends. What only a simulator has (sheet, hand) is set beside the core.
"""

import math

import numpy as np

from scissorcal.device import Faults, Specimen, VirtualRig
from scissorcal.kernel import (
    Capability,
    Config,
    ConfigEcho,
    ConfigKey,
    ConfigStatus,
    Drive,
    FirmwareBoard,
    FirmwareCore,
    FirmwareInputs,
    FrameDecoder,
    InputFlag,
    decode,
    encode,
    encode_frame,
)

FIRST_SIMULATOR_KEY = 0x8000
TORQUE_PER_A = 0.1
SUPPLY_V = 24.0


def board_of(specimen: Specimen) -> FirmwareBoard:
    """The board that a specimen's motors and sensors would have."""
    mechanism, motor, sensors = specimen.mechanism, specimen.motor, specimen.sensors
    low, high = mechanism.opening_range_deg
    amperes = motor.torque_limit_Nm / TORQUE_PER_A
    return FirmwareBoard(
        name="firmware",
        serial=specimen.name[:16],
        tick_us=1000,
        capabilities=int(
            Capability.HANDLE_FORCE_SENSOR
            | Capability.ADVANCE_MOTOR
            | Capability.TORQUE_MEASURED
            | Capability.SIMULATOR
        ),
        torque_limit=motor.torque_limit_Nm,
        force_limit=motor.force_limit_N,
        opening_min=math.radians(low),
        opening_max=math.radians(high),
        advance_min=mechanism.advance.range_mm[0] * 1e-3,
        advance_max=mechanism.advance.range_mm[1] * 1e-3,
        opening_resolution=sensors.opening_step_rad,
        advance_resolution=sensors.advance_step_um * 1e-6,
        handle_radius=mechanism.handle_radius_mm * 1e-3,
        torque_slew=1e3 * motor.torque_limit_Nm,  # within a tick
        force_slew=1e3 * motor.force_limit_N,
        overspeed=60.0,
        opening_leap=0.12,
        advance_leap=0.01,
        torque_per_A=TORQUE_PER_A,
        resistance=0.9 * SUPPLY_V / amperes,
        current_limit=2.0 * amperes,
        current_continuous=amperes,
        i2t_limit=amperes**2,
        supply_min=0.95 * SUPPLY_V,
        supply_max=1.1 * SUPPLY_V,
        temperature_max=80.0,
    )


class FirmwareSide:
    """What `LockstepLink` takes as its ``device``; ``records`` keeps ticks where asked to."""

    unplugged = False

    def __init__(self, rig: VirtualRig, rng: np.random.Generator, faults: Faults | None) -> None:
        assert faults is None, "the firmware's line has no faults"
        self.rig = rig
        self.core = FirmwareCore(board_of(rig.specimen))
        self.drives: list[Drive] = []
        self._measured = rig.tick(0.0, 0.0, False)
        self._ticks = 0
        self._decoder = FrameDecoder()
        self._received = b""
        self._sent: list[bytes] = []

    @property
    def garbled(self) -> int:
        return self._decoder.garbled

    def receive(self, data: bytes) -> None:
        for payload in self._decoder.feed(data):
            message = decode(payload)
            if isinstance(message, Config) and message.key >= FIRST_SIMULATOR_KEY:
                self._sent.append(encode(self._simulated(message)))
            else:
                self._received += encode_frame(payload)

    def tick(self) -> None:
        self._ticks += 1
        measured = self._measured
        out = self.core.tick(
            FirmwareInputs(
                (1000 * self._ticks) & 0xFFFFFFFF,
                measured.opening,
                measured.advance,
                measured.motor_torque,
                measured.handle_force,
                measured.motor_torque / TORQUE_PER_A,
                SUPPLY_V,
                25.0,
                int(InputFlag.FORCE_SATURATED) if measured.force_saturated else 0,
            ),
            self._received,
        )
        self._received = b""
        self._sent.append(out.sent)
        braking = out.drive is Drive.BRAKE
        self._measured = self.rig.tick(out.torque, out.force, out.drive is Drive.DRIVE, braking)

    def take(self) -> list[bytes]:
        sent, self._sent = self._sent, []
        return sent

    def _simulated(self, config: Config) -> ConfigEcho:
        fits = True
        if config.key == ConfigKey.HAND_SPEED_rad_per_s:
            self.rig.hand.start(config.value, self.rig.opening, self.rig.advance)
        elif config.key == ConfigKey.HAND_STROKES:
            self.rig.hand.strokes = int(config.value)
        elif config.value == 0.0:
            self.rig.remove_material()
        else:
            fits = self.rig.load_sheet()
        status = ConfigStatus.OK if fits else ConfigStatus.VALUE_REFUSED
        return ConfigEcho(status, config.key, config.nonce, config.value if fits else 0.0)
