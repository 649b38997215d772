"""The wire, once more, in plain Python and by other means: the truth behind the golden vectors."""

import binascii
import struct

LAYOUTS = {
    "STATE": (0x01, "<BBHIIffff"),
    "COMMAND": (0x02, "<BBHIff"),
    "HELLO": (0x10, "<BBHI"),
    "IDENTITY": (0x11, "<BBHIQ16s16sII9f"),
    "CONFIG": (0x12, "<BBHIf"),
    "CONFIG_ECHO": (0x13, "<BBHIf"),
    "LOAD_BEGIN": (0x14, "<BBHIII"),
    "LOAD_CHUNK": (0x15, "<BBHII192s"),
    "LOAD_COMMIT": (0x16, "<BBHI"),
    "LOAD_ECHO": (0x17, "<BBHIIII"),
}


def payload_of(name: str, second: int, *fields: object) -> bytes:
    """A payload from its type's name, its second byte and its other fields in order."""
    kind, layout = LAYOUTS[name]
    return struct.pack(layout, kind, second, *fields)


def with_crc(payload: bytes) -> bytes:
    return payload + struct.pack("<H", binascii.crc_hqx(payload, 0xFFFF))


def stuffed(data: bytes) -> bytes:
    """COBS of less than 254 bytes: each run up to a zero is preceded by its length plus one."""
    return b"".join(bytes([len(run) + 1]) + run for run in data.split(b"\0"))


def unstuffed(data: bytes) -> bytes:
    """Undo :func:`stuffed`; ValueError where a length leads beyond the end."""
    runs = []
    while data:
        length = data[0]
        if length == 0 or length > len(data):
            raise ValueError("not COBS")
        runs.append(data[1:length])
        data = data[length:]
    return b"\0".join(runs)


def frame_of(payload: bytes) -> bytes:
    return stuffed(with_crc(payload)) + b"\0"
