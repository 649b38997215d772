"""Bytes on the wire: CRC-16, frames, messages in frames, and a decoder of streams."""

import re
from collections.abc import Callable
from operator import attrgetter
from typing import Any, NamedTuple, get_type_hints

from scissorcal.kernel._kernel import ffi, lib
from scissorcal.kernel.messages import TYPES, Message

LARGEST_PAYLOAD, _LARGEST_FRAME = int(lib.SC_PAYLOAD_MAX), int(lib.SC_FRAME_MAX)


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
    frame = ffi.new(_PAYLOAD, _LARGEST_FRAME)
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

    Raises ValueError for numbers that their field cannot hold, texts that are not ASCII of at most
    16 characters, and bytes that are longer than their field; shorter ones are padded with 0.

    >>> from scissorcal.kernel import Command
    >>> encode(Command(flags=1, echo_sequence=7, torque=0.25, force=0.0)).hex(" ")
    '02 02 02 01 02 07 01 01 01 01 03 80 3e 01 01 01 03 2f 4e 00'
    """
    known, payload = _IN_C[type(message)], ffi.new(_PAYLOAD, LARGEST_PAYLOAD)
    try:
        values = map(_to_c, message) if known.has_arrays else message
        fields = dict(zip(message._fields, values, strict=True))
        size = known.pack(ffi.new(known.pointer, fields), payload)
    except (OverflowError, TypeError, IndexError, UnicodeEncodeError) as error:
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
    known = _IN_C[kind]
    struct = ffi.new(known.pointer)
    if not known.unpack(ffi.from_buffer(payload), len(payload), struct):
        raise ValueError(f"A {known.name.upper()} does not have {len(payload)} bytes.")
    values = known.read(struct)
    return kind(*(map(_from_c, values, known.hints) if known.has_arrays else values))


def _to_c(value: Any) -> Any:
    """A text or bytes as a list, a number as it is."""
    if isinstance(value, str):
        if len(value) > 16:
            raise OverflowError(f"the text {value!r} is longer than 16 characters")
        value = value.encode("ascii")
    return list(value) if isinstance(value, bytes) else value


def _from_c(value: Any, hint: type) -> Any:
    """A number as it is; an array of bytes whole, or as the text in it."""
    if isinstance(value, int | float):
        return value
    data = bytes(value)
    return data if hint is bytes else data.split(b"\0", 1)[0].decode("ascii", "replace")


class _InC(NamedTuple):
    """A message in C: ``sc_config_echo`` for ConfigEcho; what is looked up once, not per frame."""

    name: str
    pointer: Any
    pack: Callable[..., int]
    unpack: Callable[..., bool]
    read: Callable[[Any], tuple[Any, ...]]
    hints: tuple[type, ...]
    has_arrays: bool

    @classmethod
    def of(cls, kind: type[Message]) -> "_InC":
        name = re.sub(r"(?<=[a-z])(?=[A-Z])", "_", kind.__name__).lower()
        pack, unpack = (getattr(lib, f"sc_{verb}_{name}") for verb in ("pack", "unpack"))
        hints = tuple(get_type_hints(kind).values())
        has_arrays = str in hints or bytes in hints
        pointer = ffi.typeof(f"sc_{name} *")
        read = attrgetter(*kind._fields) if len(kind._fields) > 1 else _only(kind._fields[0])
        return cls(name, pointer, pack, unpack, read, hints, has_arrays)


def _only(field: str) -> Callable[[Any], tuple[Any, ...]]:
    """As ``attrgetter`` of several fields, for a message of one."""
    return lambda struct: (getattr(struct, field),)


_PAYLOAD = ffi.typeof("uint8_t[]")
_IN_C = {kind: _InC.of(kind) for kind in TYPES.values()}
