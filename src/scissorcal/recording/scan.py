"""Read the bytes of a recording and keep every complete part, whatever happened to the rest."""

import zlib
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple

import numpy as np
from mcap.opcode import Opcode
from mcap.records import Attachment as Record
from mcap.records import Channel, Metadata, Statistics
from numpy.typing import NDArray

from scissorcal.errors import InputError
from scissorcal.foreign import read_foreign, reading
from scissorcal.foreign.formats import RECORDING
from scissorcal.identity import bytes_digest
from scissorcal.recording import layout
from scissorcal.recording.chunks import (
    LARGEST_CHUNK,
    ChunkPlaces,
    DamageError,
    open_chunk,
    parse_record,
    run_end,
)
from scissorcal.recording.header import HEAD, MAGIC, METADATA_NAME, NOTE_NAME
from scissorcal.recording.layout import CHANNELS, TelemetryChannel, rows_of
from scissorcal.recording.schema import RecordingMetadata, from_entries

LARGEST_RATIO = 100
"""Unpacked bytes for each byte of a file, beyond one chunk: samples of a rig at rest, without any
noise, have 9 at most."""
MOST_RECORDS = LARGEST_CHUNK // 50
"""Records of a chunk, or runs of them: the smallest message that tools write has 50 bytes."""
MOST_CHANNELS = 1000
"""Different channels of a file; scissorcal writes four."""
LONGEST_SHEET_NUMBER = 9
MOST_DAMAGE = 20
"""Places of damage that are listed; of further ones the number."""


class Attachment(NamedTuple):
    """A file kept within a recording."""

    name: str
    media_type: str
    data: bytes


class Note(NamedTuple):
    """A sentence that the writer left."""

    sentence: str


class Sheet(NamedTuple):
    """This sheet of material is loaded from here on."""

    number: int


class Mark(NamedTuple):
    """A fact about the samples until here, such as the stop that ended them."""

    name: str
    value: str


@dataclass(frozen=True, eq=False)
class Telemetry:
    """Messages of a channel beside the samples, shape (n,) with its message_dtype."""

    channel: TelemetryChannel
    messages: NDArray[np.void]


Event = NDArray[np.void] | Note | Sheet | Mark | Attachment | Telemetry


def samples_among(events: Iterable[Event]) -> NDArray[np.void]:
    """The samples among events in one array, shape (N,)."""
    blocks = [event for event in events if isinstance(event, np.ndarray)]
    return np.concatenate(blocks) if blocks else layout.empty_samples()


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
        return samples_among(self.events)

    def telemetry(self, channel: TelemetryChannel) -> NDArray[np.void]:
        """All rows of a channel beside the samples, shape (N,), each with its ``host_time_ns``."""
        events = [e for e in self.events if isinstance(e, Telemetry) and e.channel == channel]
        blocks = [rows_of(channel, event.messages) for event in events]
        none = rows_of(channel, np.zeros(0, dtype=channel.message_dtype))
        return np.concatenate([none, *blocks])

    def telemetry_rows(self) -> dict[str, int]:
        """How many rows each channel beside the samples has, by its topic."""
        rows: dict[str, int] = {}
        for event in self.events:
            if isinstance(event, Telemetry):
                topic = event.channel.topic
                rows[topic] = rows.get(topic, 0) + len(event.messages)
        return rows

    def notes(self) -> tuple[str, ...]:
        """The sentences that the writer left."""
        return tuple(event.sentence for event in self.events if isinstance(event, Note))

    def marks(self) -> tuple[tuple[str, str], ...]:
        """Facts by name, in order; a name may come more than once."""
        return tuple((event.name, event.value) for event in self.events if isinstance(event, Mark))


def scan_file(path: Path) -> Scan:
    """Read a whole file, complete, cut off or damaged; InputError if it is no recording."""
    data = read_foreign(path, RECORDING)
    _refuse_unknown(path, data)
    walk = Walk(room=LARGEST_CHUNK + LARGEST_RATIO * len(data))
    with reading(path, RECORDING):
        for offset, opcode, body in _records(data, walk):
            try:
                walk.take(offset, opcode, body)
            except DamageError as damage:
                walk.damage.append(f"The bytes from {offset} on are damaged ({damage}); left out.")
    if walk.metadata is None:
        raise InputError(_why_no_recording(path, walk))
    if walk.finished:
        read = sum(len(event) for event in walk.events if isinstance(event, np.ndarray))
        if walk.stated_count is not None and walk.stated_count != read:
            walk.damage.append(
                f"{walk.stated_count - read} of {walk.stated_count} samples cannot be read."
            )
    more = len(walk.damage) - MOST_DAMAGE
    if more > 1:
        walk.damage[MOST_DAMAGE:] = [f"{more} further places are damaged; left out."]
    return Scan(
        path,
        bytes_digest(data),
        walk.metadata,
        walk.events,
        walk.damage,
        walk.finished,
    )


def _refuse_unknown(path: Path, data: bytes) -> None:
    """InputError where bytes do not begin as a recording; known kinds are refused before."""
    if data.startswith(MAGIC):
        return
    if MAGIC.startswith(data):
        raise InputError(
            f"{path} is cut off within its first {len(MAGIC)} bytes: nothing can be recovered "
            "from it. Capture again."
        )
    raise InputError(
        f"{path} is not a recording: its first bytes are those of an unknown format. Name an .mcap "
        "file that scissorcal wrote."
    )


@dataclass
class Walk:
    """State while walking over records, one by one: what was found so far.

    ``room`` are the bytes that are left for unpacked chunks; :meth:`take` raises DamageError.
    """

    room: int
    metadata: RecordingMetadata | None = None
    events: list[Event] = field(default_factory=list)
    damage: list[str] = field(default_factory=list)
    topics: set[str] = field(default_factory=set)
    channels: set[bytes] = field(default_factory=set)
    channel: int | None = None
    others: dict[int, TelemetryChannel] = field(default_factory=dict)
    stated_count: int | None = None
    finished: bool = False
    metadata_complaint: str = ""

    def take(self, offset: int, opcode: int, body: bytes) -> None:
        """Take one record, which begins at ``offset`` of the file."""
        if opcode == Opcode.CHUNK:
            self._take_chunk(open_chunk(body, self.room))
        elif opcode == Opcode.CHANNEL:
            self._take_channel(body)
        elif opcode == Opcode.METADATA:
            self._take_metadata(offset, body)
        elif opcode == Opcode.ATTACHMENT:
            self.events.append(_open_attachment(body))
        elif opcode == Opcode.STATISTICS:
            stated = parse_record(Statistics, body)
            others = sum(stated.channel_message_counts.get(number, 0) for number in self.others)
            self.stated_count = stated.message_count - others

    def _take_metadata(self, offset: int, body: bytes) -> None:
        record = parse_record(Metadata, body)
        if record.name == NOTE_NAME:
            self.events.append(Note(record.metadata.get("note", "")))
        elif record.name == layout.SHEET_NAME:
            digits = record.metadata.get("sheet", "").removeprefix("-")
            if not digits.isdecimal() or len(digits) > LONGEST_SHEET_NUMBER:
                raise DamageError("a sheet mark without a number")
            self.events.append(Sheet(int(record.metadata["sheet"])))
        elif record.name == layout.MARK_NAME:
            entries = record.metadata
            self.events.append(Mark(entries.get("name", ""), entries.get("value", "")))
        elif record.name == METADATA_NAME:
            try:
                metadata = from_entries(record.metadata)
            except ValueError as error:
                self.metadata_complaint = f"at byte {offset}, {error}"
                raise DamageError("the description of the recording") from None
            self.metadata = metadata

    def _take_channel(self, body: bytes) -> None:
        if body in self.channels:
            return
        self.channels.add(body)
        channel = parse_record(Channel, body)
        self.topics.add(channel.topic)
        if channel.topic == layout.TOPIC:
            self.channel = channel.id
        elif channel.topic in CHANNELS:
            self.others[channel.id] = CHANNELS[channel.topic]

    def _take_chunk(self, data: bytes) -> None:
        """Take a chunk's records: runs of messages of one size and channel in one sweep each."""
        self.room -= len(data)
        runs: dict[int | None, list[memoryview]] = {}
        view, at, count = memoryview(data), 0, 0
        while at + HEAD.size <= len(data):
            count += 1
            if count > MOST_RECORDS or len(self.channels) > MOST_CHANNELS:
                raise DamageError("a chunk of records that are smaller than any message")
            opcode, length = HEAD.unpack_from(data, at)
            end = at + HEAD.size + length
            if opcode == Opcode.CHANNEL:
                self._take_channel(data[at + HEAD.size : end])
            elif opcode == Opcode.MESSAGE and end <= len(data):
                number = int.from_bytes(data[at + HEAD.size : at + HEAD.size + 2], "little")
                if self._is_known(number, end - at):
                    end = run_end(data, at, end - at)
                    stated = number in self.others or self.channel is not None
                    runs.setdefault(number if stated else None, []).append(view[at:end])
            at = end
        for channel, parts in runs.items():
            self._take_run(channel, b"".join(parts))

    def _is_known(self, number: int, size: int) -> bool:
        """Whether a message record of this size is of a channel that scissorcal reads."""
        if number in self.others:
            return size == self.others[number].message_dtype.itemsize
        return self.channel in (None, number) and size == layout.MESSAGE_DTYPE.itemsize

    def _take_run(self, number: int | None, messages: bytes) -> None:
        channel = None if number is None else self.others.get(number)
        if channel is not None:
            self.events.append(Telemetry(channel, np.frombuffer(messages, channel.message_dtype)))
        else:
            self.events.append(np.frombuffer(messages, layout.MESSAGE_DTYPE)["row"].copy())


def _records(data: bytes, walk: Walk) -> Iterator[tuple[int, int, bytes]]:
    """Yield (offset, opcode, body) of the whole records; skip damage and note where it is."""
    offset, chunks = len(MAGIC), ChunkPlaces(data)
    while offset < len(data):
        if walk.finished and _is_end(data, offset):
            return
        end, opcode = offset, 0
        if offset + HEAD.size <= len(data):
            opcode, length = HEAD.unpack_from(data, offset)
            end = offset + HEAD.size + length
        if _may_be_record(opcode) and end <= len(data) and not _too_long(data, chunks, offset, end):
            yield offset, opcode, data[offset + HEAD.size : end]
            walk.finished = opcode == 2
            offset = end
            continue
        walk.finished = False
        resume = chunks.after(offset)
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


def _is_end(data: bytes, offset: int) -> bool:
    return len(data) - offset == len(MAGIC) and data.endswith(MAGIC)


def _too_long(data: bytes, chunks: "ChunkPlaces", offset: int, end: int) -> bool:
    """Whether a record's length is wrong: no record follows it, and a chunk begins within it."""
    if end == len(data) or _is_end(data, end):
        return False
    if end + HEAD.size <= len(data):
        opcode, length = HEAD.unpack_from(data, end)
        if _may_be_record(opcode) and end + HEAD.size + length <= len(data):
            return False
    within = chunks.after(offset)
    return within is not None and within < end


def _open_attachment(body: bytes) -> Attachment:
    record = parse_record(Record, body)
    if zlib.crc32(body[:-4]) != int.from_bytes(body[-4:], "little"):
        raise DamageError(f"attachment {record.name!r}, whose checksum does not match")
    return Attachment(record.name, record.media_type, record.data)


def _why_no_recording(path: Path, walk: Walk) -> str:
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
