"""Messages into frames, and out of payloads. The messages themselves are in `messages`."""

import re
from typing import Any

from scissorcal.kernel._kernel import ffi, lib
from scissorcal.kernel.messages import TYPES, Message
from scissorcal.kernel.wire import encode_frame


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
