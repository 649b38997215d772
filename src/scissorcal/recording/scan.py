"""Read the bytes of a recording and keep every complete part, whatever happened to the rest."""

import struct
from collections.abc import Iterator
from dataclasses import dataclass, field
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from scissorcal.errors import InputError
from scissorcal.identity import bytes_digest
from scissorcal.recording import layout
from scissorcal.recording.channels import CHANNELS
from scissorcal.recording.foreign import refuse_other_formats
from scissorcal.recording.header import HEAD, MAGIC, METADATA_NAME, NOTE_NAME
from scissorcal.recording.schema import RecordingMetadata, from_entries
from scissorcal.recording.telemetry import TelemetryChannel, rows_of

LARGEST_CHUNK = 64 * 1024 * 1024
_ZSTD_FIELD = b"\x04\x00\x00\x00zstd"
_ZSTD_FIELD_AT = HEAD.size + 28
_MESSAGE_BODY = layout.MESSAGE_DTYPE.itemsize - HEAD.size


@dataclass(frozen=True)
class Attachment:
    """A file kept within a recording."""

    name: str
    media_type: str
    data: bytes


@dataclass(frozen=True)
class Note:
    """A sentence that the writer left."""

    sentence: str


@dataclass(frozen=True)
class Sheet:
    """This sheet of material is loaded from here on."""

    number: int


@dataclass(frozen=True)
class Mark:
    """A fact about the samples until here, such as the stop that ended them."""

    name: str
    value: str


@dataclass(frozen=True, eq=False)
class Telemetry:
    """Messages of a channel beside the samples, shape (n,) with its message_dtype."""

    channel: TelemetryChannel
    messages: NDArray[np.void]


Event = NDArray[np.void] | Note | Sheet | Mark | Attachment | Telemetry


@dataclass
class Scan:
    """What a file holds: ``events`` in the order they were written, and what is damaged."""

    path: Path
    content_hash: str
    metadata: RecordingMetadata
    events: list[Event] = field(default_factory=list)
    damage: list[str] = field(default_factory=list)
    finished: bool = False

    def samples(self) -> NDArray[np.void]:
        """All samples in one array, shape (N,)."""
        blocks = [event for event in self.events if isinstance(event, np.ndarray)]
        return np.concatenate(blocks) if blocks else layout.empty_samples()

    def telemetry(self, channel: TelemetryChannel) -> NDArray[np.void]:
        """All rows of a channel beside the samples, shape (N,), each with its ``host_time_ns``."""
        found = [e for e in self.events if isinstance(e, Telemetry) and e.channel == channel]
        blocks = [rows_of(channel, event.messages) for event in found]
        none = rows_of(channel, np.zeros(0, dtype=channel.message_dtype))
        return np.concatenate([none, *blocks])

    def telemetry_rows(self) -> dict[str, int]:
        """How many rows each channel beside the samples has, by its topic."""
        found: dict[str, int] = {}
        for event in self.events:
            if isinstance(event, Telemetry):
                topic = event.channel.topic
                found[topic] = found.get(topic, 0) + len(event.messages)
        return found

    def notes(self) -> tuple[str, ...]:
        """The sentences that the writer left."""
        return tuple(event.sentence for event in self.events if isinstance(event, Note))

    def marks(self) -> tuple[tuple[str, str], ...]:
        """Facts by name, in order; a name may come more than once."""
        return tuple((event.name, event.value) for event in self.events if isinstance(event, Mark))


def scan_file(path: Path) -> Scan:
    """Read a whole file, complete, cut off or damaged; InputError if it is no recording."""
    data = read_bytes(path)
    refuse_other_formats(path, data)
    walk = _Walk()
    for offset, opcode, body in _records(data, walk):
        try:
            walk.take(offset, opcode, body)
        except _DamageError as damage:
            walk.damage.append(f"The bytes from {offset} on are damaged ({damage}); left out.")
    if walk.metadata is None:
        raise InputError(_why_no_recording(path, walk))
    if walk.finished:
        found = sum(len(event) for event in walk.events if isinstance(event, np.ndarray))
        if walk.stated_count is not None and walk.stated_count != found:
            walk.damage.append(
                f"{walk.stated_count - found} of {walk.stated_count} samples cannot be read."
            )
    return Scan(
        path,
        bytes_digest(data),
        walk.metadata,
        walk.events,
        walk.damage,
        walk.finished,
    )


def read_bytes(path: Path) -> bytes:
    """Return a file's bytes; InputError with the reason if it cannot be read or is empty."""
    try:
        data = path.read_bytes()
    except FileNotFoundError:
        raise InputError(f"{path} does not exist. Check the name and the folder.") from None
    except OSError as error:
        raise InputError(
            f"{path} cannot be read: {error.strerror}. Name a file that you may read."
        ) from error
    if not data:
        raise InputError(f"{path} is empty (0 bytes). Capture again.")
    return data


class _DamageError(Exception):
    """One record is damaged; the message says how."""


@dataclass
class _Walk:
    """State while walking: what was found so far."""

    metadata: RecordingMetadata | None = None
    events: list[Event] = field(default_factory=list)
    damage: list[str] = field(default_factory=list)
    topics: set[str] = field(default_factory=set)
    channel: int | None = None
    others: dict[int, TelemetryChannel] = field(default_factory=dict)
    stated_count: int | None = None
    finished: bool = False
    metadata_complaint: str = ""

    def take(self, offset: int, opcode: int, body: bytes) -> None:
        from mcap.opcode import Opcode
        from mcap.records import Statistics

        if opcode == Opcode.CHUNK:
            self._take_chunk(_open_chunk(body))
        elif opcode == Opcode.CHANNEL:
            self._take_channel(body)
        elif opcode == Opcode.METADATA:
            self._take_metadata(offset, body)
        elif opcode == Opcode.ATTACHMENT:
            self.events.append(_open_attachment(body))
        elif opcode == Opcode.STATISTICS:
            stated = _parse(Statistics, body)
            others = sum(stated.channel_message_counts.get(number, 0) for number in self.others)
            self.stated_count = stated.message_count - others

    def _take_metadata(self, offset: int, body: bytes) -> None:
        from mcap.records import Metadata

        record = _parse(Metadata, body)
        if record.name == NOTE_NAME:
            self.events.append(Note(record.metadata.get("note", "")))
        elif record.name == layout.SHEET_NAME:
            try:
                self.events.append(Sheet(int(record.metadata["sheet"])))
            except (KeyError, ValueError):
                raise _DamageError("a sheet mark without a number") from None
        elif record.name == layout.MARK_NAME:
            entries = record.metadata
            self.events.append(Mark(entries.get("name", ""), entries.get("value", "")))
        elif record.name == METADATA_NAME:
            try:
                metadata = from_entries(record.metadata)
            except ValueError as error:
                self.metadata_complaint = f"at byte {offset}, {error}"
                raise _DamageError("the description of the recording") from None
            self.metadata = metadata

    def _take_channel(self, body: bytes) -> None:
        from mcap.records import Channel

        channel = _parse(Channel, body)
        self.topics.add(channel.topic)
        if channel.topic == layout.TOPIC:
            self.channel = channel.id
        elif channel.topic in CHANNELS:
            self.others[channel.id] = CHANNELS[channel.topic]

    def _take_chunk(self, data: bytes) -> None:
        """Take a chunk's records; runs of sample messages in one sweep each."""
        from mcap.opcode import Opcode

        at = 0
        while at + HEAD.size <= len(data):
            opcode, length = HEAD.unpack_from(data, at)
            if opcode == Opcode.MESSAGE and length == _MESSAGE_BODY:
                count = (len(data) - at) // layout.MESSAGE_DTYPE.itemsize
                view = np.frombuffer(data, layout.MESSAGE_DTYPE, count, at)
                same = (view["opcode"] == opcode) & (view["length"] == length)
                same &= view["channel"] == view["channel"][0]
                run = count if same.all() else int(np.argmin(same))
                if self.channel in (None, int(view["channel"][0])):
                    self.events.append(view["sample"][:run].copy())
                at += run * layout.MESSAGE_DTYPE.itemsize
                continue
            if opcode == Opcode.CHANNEL:
                self._take_channel(data[at + HEAD.size : at + HEAD.size + length])
            elif opcode == Opcode.MESSAGE:
                at += self._take_telemetry(data, at)
                continue
            at += HEAD.size + length

    def _take_telemetry(self, data: bytes, at: int) -> int:
        """Take a run of messages of a known channel beside the samples; returns its bytes."""
        _, length = HEAD.unpack_from(data, at)
        channel = self.others.get(
            int.from_bytes(data[at + HEAD.size : at + HEAD.size + 2], "little")
        )
        kind = None if channel is None else channel.message_dtype
        if channel is None or kind is None or HEAD.size + length != kind.itemsize:
            return HEAD.size + int(length)
        view = np.frombuffer(data, kind, (len(data) - at) // kind.itemsize, at)
        same = (view["length"] == length) & (view["channel"] == view["channel"][0])
        same &= view["opcode"] == view["opcode"][0]
        run = len(view) if same.all() else int(np.argmin(same))
        self.events.append(Telemetry(channel, view[:run].copy()))
        return run * kind.itemsize


def _records(data: bytes, walk: _Walk) -> Iterator[tuple[int, int, bytes]]:
    """Yield (offset, opcode, body) of the whole records; skip damage and note where it is."""
    offset = len(MAGIC)
    while offset < len(data):
        if walk.finished and data[offset:] == MAGIC:
            return
        end, opcode = offset, 0
        if offset + HEAD.size <= len(data):
            opcode, length = HEAD.unpack_from(data, offset)
            end = offset + HEAD.size + length
        if _may_be_record(opcode) and end <= len(data) and not _too_long(data, offset, end):
            yield offset, opcode, data[offset + HEAD.size : end]
            walk.finished = opcode == 2
            offset = end
            continue
        walk.finished = False
        resume = _next_chunk(data, offset + 1)
        if resume is None:
            walk.damage.append(
                f"The file is cut off at byte {offset}: {len(data) - offset} bytes of an "
                "unfinished record were left out."
            )
            return
        walk.damage.append(f"The bytes from {offset} to {resume} cannot be read; left out.")
        offset = resume
    walk.finished = False


def _may_be_record(opcode: int) -> bool:
    return 1 <= opcode <= 15


def _too_long(data: bytes, offset: int, end: int) -> bool:
    """Whether a record's length is wrong: no record follows it, and a chunk begins within it."""
    if data[end:] in (b"", MAGIC):
        return False
    if end + HEAD.size <= len(data):
        opcode, length = HEAD.unpack_from(data, end)
        if _may_be_record(opcode) and end + HEAD.size + length <= len(data):
            return False
    within = _next_chunk(data, offset + 1)
    return within is not None and within < end


def _next_chunk(data: bytes, start: int) -> int | None:
    """Find the next chunk by the name of its compression, which has a fixed place in it."""
    found = data.find(_ZSTD_FIELD, start + _ZSTD_FIELD_AT)
    while found >= 0:
        offset = found - _ZSTD_FIELD_AT
        opcode, length = HEAD.unpack_from(data, offset)
        if opcode == 6 and offset + HEAD.size + length <= len(data):
            return offset
        found = data.find(_ZSTD_FIELD, found + 1)
    return None


def _parse(record: Any, body: bytes) -> Any:
    from mcap.data_stream import ReadDataStream
    from mcap.exceptions import McapError

    try:
        return record.read(ReadDataStream(BytesIO(body)))
    except (McapError, struct.error, UnicodeDecodeError, MemoryError, OverflowError) as error:
        raise _DamageError(f"not a whole {record.__name__} record") from error


def _open_chunk(body: bytes) -> bytes:
    """Return a chunk's bytes after checking its size and checksum."""
    import zstandard
    from mcap.records import Chunk
    from mcap.stream_reader import CRCValidationError, get_chunk_data_stream

    chunk = _parse(Chunk, body)
    if len(body) != 40 + len(chunk.compression) + len(chunk.data):
        raise _DamageError("a chunk whose length is wrong")
    if chunk.uncompressed_size > LARGEST_CHUNK:
        raise _DamageError(f"a chunk that claims {chunk.uncompressed_size} bytes")
    try:
        if chunk.compression == "zstd":
            stated = zstandard.get_frame_parameters(chunk.data).content_size
            if stated != chunk.uncompressed_size:
                raise _DamageError("a chunk whose size is wrong")
        stream, length = get_chunk_data_stream(chunk, validate_crc=True)
        return stream.read(length)
    except CRCValidationError as error:
        raise _DamageError("a chunk whose checksum does not match") from error
    except (zstandard.ZstdError, RuntimeError) as error:
        raise _DamageError("a chunk that cannot be decompressed") from error


def _open_attachment(body: bytes) -> Attachment:
    import zlib

    from mcap.records import Attachment as Record

    record = _parse(Record, body)
    if zlib.crc32(body[:-4]) != int.from_bytes(body[-4:], "little"):
        raise _DamageError(f"attachment {record.name!r}, whose checksum does not match")
    return Attachment(record.name, record.media_type, record.data)


def _why_no_recording(path: Path, walk: _Walk) -> str:
    if walk.metadata_complaint:
        return f"{path} is not readable: {walk.metadata_complaint}."
    others = sorted(walk.topics - {layout.TOPIC})
    if others:
        listed = ", ".join(others[:5])
        return (
            f"{path} is an MCAP file of another program (topics: {listed}), not a recording. "
            "Export it to CSV there and use 'scissorcal import'."
        )
    if walk.damage:
        return (
            f"{path} is not readable: its description is missing. {walk.damage[0]} "
            "Restore it from a backup, or capture again."
        )
    return (
        f"{path} is an MCAP file without a recording's description. Name a file that "
        "scissorcal wrote."
    )
