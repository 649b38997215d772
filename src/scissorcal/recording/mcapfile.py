"""An MCAP file of samples of one size, written a block at a time, and of telemetry beside them.

The bytes are those of `mcap.writer.Writer`, which writes message by message: at 4 kHz that takes
40 ms of each second, in bursts beside the servo loop. Here a block of samples becomes messages, and
its index entries, in a few operations on arrays. Records other than messages are the library's.
"""

import struct
import zlib
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import IO, Any

import numpy as np
import zstandard
from mcap.data_stream import RecordBuilder
from mcap.records import (
    Attachment,
    AttachmentIndex,
    Channel,
    Chunk,
    ChunkIndex,
    DataEnd,
    Footer,
    Header,
    Metadata,
    MetadataIndex,
    Schema,
    Statistics,
    SummaryOffset,
)
from numpy.typing import NDArray

from scissorcal.recording import layout
from scissorcal.recording.header import HEAD, MAGIC, SAMPLE_CHANNEL
from scissorcal.recording.layout import TelemetryChannel

_CHANNEL = SAMPLE_CHANNEL
_COMPRESSION = "zstd"
_INDEX_ENTRY = np.dtype([("time", "<u8"), ("offset", "<u8")])


class McapFile:
    """Writes into an open file: header, then samples, metadata and attachments, then the index.

    ``chunk_bytes``: a chunk is closed once it is longer, and at :meth:`flush`.
    """

    def __init__(self, stream: IO[bytes], library: str, chunk_bytes: int) -> None:
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
        self._counts: dict[int, int] = {}
        self._first = self._last = 0
        self._others: dict[TelemetryChannel, _Other] = {}
        stream.write(MAGIC + _bytes_of([Header(layout.PROFILE, library)]))

    def begin_channel(
        self, schema_name: str, encoding: str, schema: bytes, facts: Mapping[str, str]
    ) -> None:
        """State what the samples are; ``facts`` are the channel's metadata."""
        self._schema = Schema(id=_CHANNEL, data=schema, encoding=encoding, name=schema_name)
        self._channel = _channel(_CHANNEL, layout.TOPIC, facts)
        self._begun = [_bytes_of([self._schema, self._channel])]
        self._size = len(self._begun[0])

    def add_samples(self, samples: NDArray[np.void]) -> None:
        """Add samples, shape (n,) with SAMPLE_DTYPE; their times are their host's, 0 at least."""
        messages = _messages(_CHANNEL, samples, samples["host_time_ns"])
        messages["sequence"] = samples["sequence"]
        while len(messages):
            room = max(self._chunk_bytes - self._size, 0) // messages.itemsize + 1
            self._add(messages[:room])
            messages = messages[room:]
            if self._size > self._chunk_bytes:
                self._close_chunk()

    def add_telemetry(
        self, channel: TelemetryChannel, rows: NDArray[np.void], times_ns: NDArray[np.int64]
    ) -> None:
        """Add rows (n,) of a channel beside the samples, at the host's times; in separate chunks.

        They are written with the samples' next chunk.
        """
        other = self._others.get(channel)
        if other is None:
            other = self._others[channel] = _other(channel, _CHANNEL + 1 + len(self._others))
        messages = _messages(other.channel.id, rows, times_ns)
        counts = "sequence" in (rows.dtype.names or ())
        messages["sequence"] = rows["sequence"] if counts else other.count + np.arange(len(rows))
        other.waiting.append(messages)
        other.count += len(rows)

    def add_metadata(self, name: str, entries: Mapping[str, str]) -> None:
        """Add a named set of texts, in its place in the file."""
        offset = self._stream.tell()
        length = self._write([Metadata(name=name, metadata=dict(entries))])
        self._metadata.append(MetadataIndex(offset=offset, length=length, name=name))

    def attach(self, log_time: int, name: str, media_type: str, data: bytes) -> None:
        """Add a file, in its place in the file."""
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
        self._close_chunk()
        self._write([DataEnd(0)])
        start = self._stream.tell()
        others = list(self._others.values())
        statistics = Statistics(
            attachment_count=len(self._attachments),
            channel_count=1 + len(others),
            channel_message_counts=self._counts,
            chunk_count=len(self._chunks),
            message_count=sum(self._counts.values()),
            message_end_time=self._last,
            message_start_time=self._first,
            metadata_count=len(self._metadata),
            schema_count=1 + len(others),
        )
        groups = (
            (0x03, [self._schema, *(other.schema for other in others)]),
            (0x04, [self._channel, *(other.channel for other in others)]),
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
        self._entries.append(_entries(messages, self._size))
        self._begun.append(messages.tobytes())
        self._size += messages.nbytes

    def _close_chunk(self) -> None:
        if self._entries:
            data, entries = b"".join(self._begun), np.concatenate(self._entries)
            self._begun, self._size, self._entries = [], 0, []
            self._write_chunk(data, entries, _CHANNEL)
        for other in self._others.values():
            if other.waiting:
                messages, other.waiting = np.concatenate(other.waiting), []
                entries = _entries(messages, len(other.head))
                self._write_chunk(other.head + messages.tobytes(), entries, other.channel.id)
                other.head = b""

    def _write_chunk(self, data: bytes, entries: NDArray[np.void], channel: int) -> None:
        low, high = int(entries["time"].min()), int(entries["time"].max())
        self._first = min(self._first, low) if self._counts else low
        self._last = max(self._last, high)
        self._counts[channel] = self._counts.get(channel, 0) + len(entries)
        packed = zstandard.compress(data)
        span: dict[str, Any] = {
            "message_start_time": low,
            "message_end_time": high,
            "compression": _COMPRESSION,
            "uncompressed_size": len(data),
        }
        start = self._stream.tell()
        length = self._write([Chunk(**span, data=packed, uncompressed_crc=zlib.crc32(data))])
        index = struct.pack("<HI", channel, entries.nbytes) + entries.tobytes()
        index = HEAD.pack(0x07, len(index)) + index
        self._stream.write(index)
        self._chunks.append(
            ChunkIndex(
                **span,
                chunk_start_offset=start,
                chunk_length=length,
                message_index_offsets={channel: start + length},
                message_index_length=len(index),
                compressed_size=len(packed),
            )
        )

    def _write(self, records: Iterable[Any]) -> int:
        data = _bytes_of(records)
        self._stream.write(data)
        return len(data)


@dataclass
class _Other:
    """A channel of telemetry: its records, and messages that no chunk has yet.

    ``head`` are the records' bytes, until a chunk has them; ``count`` messages were added.
    """

    schema: Any
    channel: Any
    head: bytes
    waiting: list[NDArray[np.void]]
    count: int = 0


def _other(telemetry: TelemetryChannel, number: int) -> _Other:
    schema = Schema(
        id=number,
        data=telemetry.definition.encode(),
        encoding=layout.SCHEMA_ENCODING,
        name=telemetry.schema_name,
    )
    channel = _channel(number, telemetry.topic, telemetry.units)
    return _Other(schema, channel, _bytes_of([schema, channel]), [])


def _channel(number: int, topic: str, facts: Mapping[str, str]) -> Any:
    """The record of a channel whose schema has the same number."""
    return Channel(
        id=number,
        topic=topic,
        message_encoding=layout.MESSAGE_ENCODING,
        schema_id=number,
        metadata=dict(facts),
    )


def _messages(
    channel: int, rows: NDArray[np.void], times_ns: NDArray[np.int64]
) -> NDArray[np.void]:
    """Message records of rows (n,), without their sequence numbers; their times are 0 at least."""
    messages: NDArray[np.void] = np.zeros(len(rows), dtype=layout.message_dtype(rows.dtype))
    messages["opcode"] = 0x05
    messages["length"] = messages.itemsize - HEAD.size
    messages["channel"] = channel
    messages["log_time"] = messages["publish_time"] = np.maximum(times_ns, 0)
    messages["cdr_header"] = layout.CDR_HEADER
    messages["row"] = rows
    return messages


def _entries(messages: NDArray[np.void], offset: int) -> NDArray[np.void]:
    """Index entries of messages of one size that begin at an offset of their chunk."""
    entries = np.empty(len(messages), dtype=_INDEX_ENTRY)
    entries["time"] = messages["log_time"]
    entries["offset"] = offset + messages.dtype.itemsize * np.arange(len(messages))
    return entries


def _bytes_of(records: Iterable[Any]) -> bytes:
    builder: Any = RecordBuilder()
    for record in records:
        record.write(builder)
    return bytes(builder.end())
