"""The parts of a recording's bytes: records, chunks, runs of messages, and where a chunk may begin.

Each takes time in proportion to its bytes, whatever they are.
"""

from bisect import bisect_right
from collections.abc import Iterator
from io import BytesIO
from typing import Any

import numpy as np
import zstandard
from mcap.data_stream import ReadDataStream
from mcap.records import Chunk
from mcap.stream_reader import CRCValidationError, get_chunk_data_stream

from scissorcal.recording.header import HEAD

LARGEST_CHUNK = 16_000_000
"""Unpacked bytes of a chunk; scissorcal closes one at 64 kB, the tools of MCAP at 4 MB."""
_FIRST_LOOK = 8
"""Messages that are compared at first for a run of one channel; then twice as many, and so on."""
_ZSTD_FIELD = b"\x04\x00\x00\x00zstd"
_ZSTD_FIELD_AT = HEAD.size + 28


class DamageError(Exception):
    """One record is damaged; the message says how."""


def open_chunk(body: bytes, room: int) -> bytes:
    """Return a chunk's bytes, at most ``room``, after checking its size and checksum."""
    chunk = parse_record(Chunk, body)
    if len(body) != 40 + len(chunk.compression) + len(chunk.data):
        raise DamageError("a chunk whose length is wrong")
    if chunk.uncompressed_size > min(LARGEST_CHUNK, room):
        raise DamageError(f"a chunk that claims {chunk.uncompressed_size} bytes")
    try:
        if chunk.compression == "zstd":
            _check_size(zstandard.get_frame_parameters(chunk.data), chunk.uncompressed_size)
        stream, length = get_chunk_data_stream(chunk, validate_crc=True)
        return stream.read(length)
    except CRCValidationError as error:
        raise DamageError("a chunk whose checksum does not match") from error
    except DamageError:
        raise
    except Exception as error:
        raise DamageError("a chunk that cannot be decompressed") from error


def _check_size(frame: Any, stated: int) -> None:
    if frame.content_size != stated:
        raise DamageError("a chunk whose size is wrong")


def parse_record(record: Any, body: bytes) -> Any:
    """A record of the library ``mcap`` from its bytes; DamageError whatever that raises."""
    try:
        return record.read(ReadDataStream(BytesIO(body)))
    except Exception as error:
        raise DamageError(f"not a whole {record.__name__} record") from error


def run_end(data: bytes, at: int, size: int) -> int:
    """Where a run of messages ends that have the size and the channel of the one at ``at``.

    Each look is twice as long as the one before, so that it takes time in proportion to the run.
    """
    same = HEAD.size + 2
    look, end = _FIRST_LOOK, at + size
    while data[end : end + same] == data[at : at + same]:
        count = min(look, (len(data) - end) // size)
        heads = np.frombuffer(data, np.uint8, count * size, end).reshape(count, size)[:, :same]
        equal = (heads == np.frombuffer(data, np.uint8, same, at)).all(axis=1)
        if not equal.all():
            return end + int(np.argmin(equal)) * size
        end += count * size
        look *= 2
        if not count:
            break
    return end


class ChunkPlaces:
    """Where chunks may begin, by the name of their compression, which has a fixed place in them.

    The file is searched once, when the first place is asked for.
    """

    def __init__(self, data: bytes) -> None:
        self._data = data
        self._found: list[int] | None = None

    def after(self, offset: int) -> int | None:
        """The first place of a chunk behind ``offset``."""
        if self._found is None:
            self._found = list(self._search())
        index = bisect_right(self._found, offset)
        return self._found[index] if index < len(self._found) else None

    def _search(self) -> Iterator[int]:
        data = self._data
        field = data.find(_ZSTD_FIELD, _ZSTD_FIELD_AT)
        while field >= 0:
            offset = field - _ZSTD_FIELD_AT
            opcode, length = HEAD.unpack_from(data, offset)
            if opcode == 6 and offset + HEAD.size + length <= len(data):
                yield offset
            field = data.find(_ZSTD_FIELD, field + 1)
