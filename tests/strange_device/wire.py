"""Frames and messages as docs/protocol.md states them; written for this device alone."""

import binascii
import hashlib
import json
import struct
from pathlib import Path

STATE, COMMAND, HELLO, IDENTITY, CONFIG, CONFIG_ECHO = 0x01, 0x02, 0x10, 0x11, 0x12, 0x13
MOTOR_ENABLED, FAULT_LATCHED, COMMANDS_LOST, AT_STOP = 1, 2, 4, 8
TORQUE_SATURATED, FORCE_SATURATED, ENCODER_FAULT = 16, 32, 64
ENABLE, CLEAR_FAULT = 1, 2
FORCE_SENSOR, ADVANCE_MOTOR = 1, 2
STREAM, BRAKE_AFTER_MS, HOME = 1, 2, 3
NOT_HOMED, HOMING = 128, 256
HOME_STOPPED, HOME_TIMED_OUT, HOME_FAULT = 66, 67, 69
TORQUE_MEASURED, HOMES = 4, 8
WATCHDOG, ENCODER = 1, 2
MOST_BYTES = 253


def schema_hash(wire_json: Path, version: int = 2) -> int:
    """First 8 bytes of SHA-256 over wire.json without spaces and with sorted keys.

    That of version 1 is the one that its devices were built with.
    """
    if version == 1:
        return 0xB09FB42A7F073F64
    wire = json.loads(wire_json.read_text(encoding="utf-8"))
    text = json.dumps(wire, sort_keys=True, separators=(",", ":"))
    return int.from_bytes(hashlib.sha256(text.encode()).digest()[:8], "little")


def frame(payload: bytes) -> bytes:
    """COBS of payload and CRC, and the zero at its end."""
    data = payload + struct.pack("<H", binascii.crc_hqx(payload, 0xFFFF))
    pieces = data.split(b"\0")
    return b"".join(bytes([len(piece) + 1]) + piece for piece in pieces) + b"\0"


def payload_of(coded: bytes) -> bytes | None:
    """The payload of a frame without its zero, None where it is garbled."""
    pieces = []
    at = 0
    while at < len(coded):
        length = coded[at]
        if length == 0xFF or at + length > len(coded):
            return None
        pieces.append(coded[at + 1 : at + length])
        at += length
    data = b"\0".join(pieces)
    if len(data) < 3:
        return None
    payload, crc = data[:-2], struct.unpack("<H", data[-2:])[0]
    return payload if binascii.crc_hqx(payload, 0xFFFF) == crc else None


class Splitter:
    """Collects bytes into payloads; a garbled frame is dropped and counted."""

    def __init__(self) -> None:
        self.garbled = 0
        self._kept = b""

    def payloads(self, data: bytes) -> list[bytes]:
        """Valid payloads that these bytes end."""
        *frames, self._kept = (self._kept + data).split(b"\0")
        found = []
        for coded in frames:
            payload = payload_of(coded) if len(coded) <= MOST_BYTES else None
            if payload is not None:
                found.append(payload)
            elif coded:
                self.garbled += 1
        if len(self._kept) > MOST_BYTES:
            self._kept = b"\xff" * (MOST_BYTES + 1)
        return found
