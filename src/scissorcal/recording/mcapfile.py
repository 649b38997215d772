"""An MCAP file with one channel of samples of one size, written a block at a time.

The bytes are those of `mcap.writer.Writer`, which writes message by message: at 4 kHz that takes
40 ms of each second, in bursts beside the servo loop. Here a block of samples becomes messages, and
its index entries, in a few operations on arrays. Records other than messages are the library's.
"""

import struct
import zlib
from collections.abc import Iterable, Mapping
from typing import IO, Any

import numpy as np
from numpy.typing import NDArray

from scissorcal.recording import layout
from scissorcal.recording.header import HEAD, MAGIC

_CHANNEL = 1
_SCHEMA = 1
_COMPRESSION = "zstd"
_INDEX_ENTRY = np.dtype([("time", "<u8"), ("offset", "<u8")])
_MESSAGE = np.dtype(
    [
        ("opcode", "u1"),
        ("length", "<u8"),
        ("channel", "<u2"),
        ("sequence", "<u4"),
        ("log_time", "<u8"),
        ("publish_time", "<u8"),
        ("cdr_header", "S4"),
        ("sample", layout.SAMPLE_DTYPE),
    ]
)


class McapFile:
    """Writes into an open file: header, then samples, metadata and attachments, then the index.

    ``chunk_bytes``: a chunk is closed once it is longer, and at :meth:`flush`.
    """

    def __init__(self, stream: IO[bytes], library: str, chunk_bytes: int) -> None:
        from mcap.records import Header

        self._stream = stream
        self._chunk_bytes = chunk_bytes
        self._begun: list[bytes] = []  # of the chunk in progress
        self._size = 0
        self._entries: list[NDArray[np.void]] = []
        self._schema: Any = None
        self._channel: Any = None
        self._chunks: list[Any] = []
        self._attachments: list[Any] = []
        self._metadata: list[Any] = []
        self._count = 0
        self._first = self._last = 0
        stream.write(MAGIC + _bytes_of([Header(layout.PROFILE, library)]))

    def begin_channel(
        self, schema_name: str, encoding: str, schema: bytes, facts: Mapping[str, str]
    ) -> None:
        """State what the samples are; ``facts`` are the channel's metadata."""
        from mcap.records import Channel, Schema

        self._schema = Schema(id=_SCHEMA, data=schema, encoding=encoding, name=schema_name)
        self._channel = Channel(
            id=_CHANNEL,
            topic=layout.TOPIC,
            message_encoding=layout.MESSAGE_ENCODING,
            schema_id=_SCHEMA,
            metadata=dict(facts),
        )
        self._begun = [_bytes_of([self._schema, self._channel])]
        self._size = len(self._begun[0])

    def add_samples(self, samples: NDArray[np.void]) -> None:
        """Add samples, shape (n,) with SAMPLE_DTYPE; their times are their host's, 0 at least."""
        messages = np.zeros(len(samples), dtype=_MESSAGE)
        messages["opcode"] = 0x05
        messages["length"] = _MESSAGE.itemsize - HEAD.size
        messages["channel"] = _CHANNEL
        messages["sequence"] = samples["sequence"]
        messages["log_time"] = np.maximum(samples["host_time_ns"], 0)
        messages["publish_time"] = messages["log_time"]
        messages["cdr_header"] = layout.CDR_HEADER
        messages["sample"] = samples
        while len(messages):
            room = max(self._chunk_bytes - self._size, 0) // _MESSAGE.itemsize + 1
            self._add(messages[:room])
            messages = messages[room:]
            if self._size > self._chunk_bytes:
                self._close_chunk()

    def add_metadata(self, name: str, entries: Mapping[str, str]) -> None:
        """Add a named set of texts, in its place in the file."""
        from mcap.records import Metadata, MetadataIndex

        offset = self._stream.tell()
        length = self._write([Metadata(name=name, metadata=dict(entries))])
        self._metadata.append(MetadataIndex(offset=offset, length=length, name=name))

    def attach(self, log_time: int, name: str, media_type: str, data: bytes) -> None:
        """Add a file, in its place in the file."""
        from mcap.records import Attachment, AttachmentIndex

        offset = self._stream.tell()
        about: dict[str, Any] = {
            "create_time": 0,
            "log_time": log_time,
            "name": name,
            "media_type": media_type,
        }
        length = self._write([Attachment(**about, data=data)])
        index = AttachmentIndex(**about, offset=offset, length=length, data_size=len(data))
        self._attachments.append(index)

    def flush(self) -> None:
        """Close the chunk in progress, if it has samples, and hand all to the operating system."""
        self._close_chunk()
        self._stream.flush()

    def finish(self) -> None:
        """Write the index and the footer."""
        from mcap.records import DataEnd, Footer, Statistics, SummaryOffset

        self._close_chunk()
        self._write([DataEnd(0)])
        start = self._stream.tell()
        statistics = Statistics(
            attachment_count=len(self._attachments),
            channel_count=1,
            channel_message_counts={_CHANNEL: self._count} if self._count else {},
            chunk_count=len(self._chunks),
            message_count=self._count,
            message_end_time=self._last,
            message_start_time=self._first,
            metadata_count=len(self._metadata),
            schema_count=1,
        )
        groups = (
            (0x03, [self._schema]),
            (0x04, [self._channel]),
            (0x0B, [statistics]),
            (0x08, self._chunks),
            (0x0A, self._attachments),
            (0x0D, self._metadata),
        )
        summary = b""
        offsets = []
        for opcode, records in groups:
            data = _bytes_of(records)
            offsets.append(SummaryOffset(opcode, start + len(summary), len(data)))
            summary += data
        offsets_start = start + len(summary)
        summary += _bytes_of(offsets)
        about_end = struct.pack("<BQQQ", 0x02, 20, start, offsets_start)
        footer = Footer(start, offsets_start, zlib.crc32(about_end, zlib.crc32(summary)))
        self._stream.write(summary + _bytes_of([footer]) + MAGIC)

    def _add(self, messages: NDArray[np.void]) -> None:
        entries = np.empty(len(messages), dtype=_INDEX_ENTRY)
        entries["time"] = messages["log_time"]
        entries["offset"] = self._size + _MESSAGE.itemsize * np.arange(len(messages))
        self._entries.append(entries)
        self._begun.append(messages.tobytes())
        self._size += messages.nbytes
        low, high = int(entries["time"].min()), int(entries["time"].max())
        self._first = min(self._first, low) if self._count else low
        self._last = max(self._last, high)
        self._count += len(messages)

    def _close_chunk(self) -> None:
        if not self._entries:
            return
        import zstandard
        from mcap.records import Chunk, ChunkIndex

        data, entries = b"".join(self._begun), np.concatenate(self._entries)
        self._begun, self._size, self._entries = [], 0, []
        packed = zstandard.compress(data)
        span: dict[str, Any] = {
            "message_start_time": int(entries["time"].min()),
            "message_end_time": int(entries["time"].max()),
            "compression": _COMPRESSION,
            "uncompressed_size": len(data),
        }
        start = self._stream.tell()
        length = self._write([Chunk(**span, data=packed, uncompressed_crc=zlib.crc32(data))])
        index = struct.pack("<HI", _CHANNEL, entries.nbytes) + entries.tobytes()
        index = HEAD.pack(0x07, len(index)) + index
        self._stream.write(index)
        self._chunks.append(
            ChunkIndex(
                **span,
                chunk_start_offset=start,
                chunk_length=length,
                message_index_offsets={_CHANNEL: start + length},
                message_index_length=len(index),
                compressed_size=len(packed),
            )
        )

    def _write(self, records: Iterable[Any]) -> int:
        data = _bytes_of(records)
        self._stream.write(data)
        return len(data)


def _bytes_of(records: Iterable[Any]) -> bytes:
    from mcap.data_stream import RecordBuilder

    builder: Any = RecordBuilder()
    for record in records:
        record.write(builder)
    return bytes(builder.end())
