"""Bytes on the wire: CRC-16, frames, messages in frames, and a decoder of streams."""

import re
from typing import Any

from scissorcal.kernel._kernel import ffi, lib
from scissorcal.kernel.messages import TYPES, Message

LARGEST_PAYLOAD = int(lib.SC_PAYLOAD_MAX)


def crc16(data: bytes) -> int:
    """CRC-16/CCITT-FALSE of ``data`` (polynomial 0x1021, start 0xFFFF, not reflected).

    >>> hex(crc16(b"123456789"))
    '0x29b1'
    """
    return int(lib.sc_crc16(ffi.from_buffer(data), len(data)))


def encode_frame(payload: bytes) -> bytes:
    """Wrap a payload of 1 to 250 bytes: COBS(payload + CRC, little-endian) and the delimiter 0.

    >>> encode_frame(bytes([1, 0, 2])).hex(" ")
    '02 01 04 02 ee db 00'
    """
    frame = ffi.new("uint8_t[]", int(lib.SC_FRAME_MAX))
    size = lib.sc_encode_frame(ffi.from_buffer(payload), len(payload), frame, len(frame))
    if size == 0:
        raise ValueError(
            f"A payload of {len(payload)} bytes does not fit a frame: send 1 to {LARGEST_PAYLOAD}."
        )
    return bytes(ffi.buffer(frame, size))


class FrameDecoder:
    """Extracts the payloads with a correct CRC from a stream of bytes; counts the other frames.

    After a lost or garbled byte the decoder is synchronised again at the next delimiter.

    >>> decoder = FrameDecoder()
    >>> decoder.feed(b"noise" + bytes(1) + encode_frame(b"hello"))
    [b'hello']
    >>> decoder.garbled
    1
    """

    def __init__(self) -> None:
        self._decoder = ffi.new("sc_decoder *")
        self._taken = ffi.new("size_t *")
        lib.sc_decoder_init(self._decoder)

    def feed(self, data: bytes) -> list[bytes]:
        """Take bytes as they arrive, in pieces of any size; return the payloads they complete."""
        view = ffi.from_buffer(data)
        self._taken[0] = 0
        payloads = []
        while size := lib.sc_decoder_feed(self._decoder, view, len(data), self._taken):
            payloads.append(bytes(ffi.buffer(self._decoder.buffer, size)))
        return payloads

    @property
    def garbled(self) -> int:
        """Frames discarded: malformed, too long, or with a wrong CRC."""
        return int(self._decoder.garbled)

    @property
    def bytes_received(self) -> int:
        """Bytes fed since the start, valid or not."""
        return int(self._decoder.bytes_received)


def encode(message: Message) -> bytes:
    """Give the whole frame of a message, delimiter included.

    Raises ValueError for numbers that their field cannot hold and texts that are not ASCII of at
    most 16 characters.

    >>> from scissorcal.kernel import Command
    >>> encode(Command(flags=1, echo_sequence=7, torque=0.25, force=0.0)).hex(" ")
    '02 02 02 01 02 07 01 01 01 01 03 80 3e 01 01 01 03 2f 4e 00'
    """
    name, payload = _C_NAMES[type(message)], ffi.new("uint8_t[]", int(lib.SC_PAYLOAD_MAX))
    try:
        fields = {
            field: _text_bytes(value) if isinstance(value, str) else value
            for field, value in message._asdict().items()
        }
        size = getattr(lib, f"sc_pack_{name}")(ffi.new(f"sc_{name} *", fields), payload)
    except (OverflowError, TypeError, UnicodeEncodeError) as error:
        kind = type(message).__name__
        raise ValueError(f"{kind} does not fit its frame: {error}.") from error
    return encode_frame(bytes(ffi.buffer(payload, size)))


def decode(payload: bytes) -> Message:
    """Read a payload (CRC already checked and stripped) back into its message.

    Raises ValueError if its type is unknown or its size is not that type's.
    """
    kind = TYPES.get(payload[0]) if payload else None
    if kind is None:
        first = payload[0] if payload else "none"
        raise ValueError(f"No message has type {first}: the device speaks another protocol.")
    name = _C_NAMES[kind]
    struct = ffi.new(f"sc_{name} *")
    if not getattr(lib, f"sc_unpack_{name}")(ffi.from_buffer(payload), len(payload), struct):
        raise ValueError(f"A {name.upper()} does not have {len(payload)} bytes.")
    return kind(**{field: _value(getattr(struct, field)) for field in kind._fields})


def _text_bytes(text: str) -> list[int]:
    data = text.encode("ascii")
    if len(data) > 16:
        raise OverflowError(f"the text {text!r} is longer than 16 characters")
    return list(data.ljust(16, b"\0"))


def _value(value: Any) -> Any:
    """A number as it is; an array of bytes as the text in it."""
    if isinstance(value, int | float):
        return value
    return bytes(value).split(b"\0", 1)[0].decode("ascii", "replace")


_C_NAMES = {
    kind: re.sub(r"(?<=[a-z])(?=[A-Z])", "_", kind.__name__).lower() for kind in TYPES.values()
}
"""A message's name in C: ``config_echo`` for ConfigEcho."""
