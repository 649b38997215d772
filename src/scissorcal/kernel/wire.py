"""Bytes on the wire: CRC-16, frames, and a decoder that resynchronises after garbled bytes."""

from scissorcal.kernel._kernel import ffi, lib

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
