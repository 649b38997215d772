"""Write a recording so that a killed capture loses at most 0.25 s."""

import contextlib
import os
from collections.abc import Iterator
from contextlib import AbstractContextManager
from pathlib import Path
from types import TracebackType
from typing import IO, Self

import numpy as np
from numpy.typing import NDArray

from scissorcal.errors import DeviceError, InputError, ScissorcalError, file_error
from scissorcal.files import keep_name, lock
from scissorcal.identity import VERSION
from scissorcal.recording import layout
from scissorcal.recording.header import METADATA_NAME, NOTE_NAME
from scissorcal.recording.layout import TelemetryChannel
from scissorcal.recording.mcapfile import McapFile
from scissorcal.recording.recording import STOP_MARK, Joint, Kind, Recording, Stroke
from scissorcal.recording.schema import (
    RecordingFacts,
    RecordingMetadata,
    describe,
    stroke_records,
    to_entries,
)

FLUSH_SPAN_NS = 125_000_000
"""Host time that samples wait in memory for their chunk: half of the promised 0.25 s, so that the
promise holds for callers that append at least eight times a second."""

CHUNK_BYTES = 64 * 1024
"""A chunk is closed at this size even if the samples' clock does not advance (imports)."""


class SampleFile:
    """An MCAP file being written: the encoding only, not names, locks or renaming.

    The metadata goes first and, at ``finish``, once more: MCAP has no checksum for it. Of several
    copies the last sound one counts, so that strokes may be stated anew.
    """

    def __init__(self, stream: IO[bytes], metadata: RecordingMetadata) -> None:
        self._entries, joint = to_entries(metadata), metadata.joint_of_recording
        with self._writing():
            self._mcap = McapFile(stream, f"scissorcal {VERSION}", CHUNK_BYTES)
            self._mcap.add_metadata(METADATA_NAME, self._entries)
            self._mcap.begin_channel(
                layout.SCHEMA_NAME,
                layout.SCHEMA_ENCODING,
                layout.message_definition(joint).encode(),
                {
                    f"unit.{field.name}": layout.unit_of(field.name, joint)
                    for field in layout.SAMPLE
                },
            )
            self._mcap.flush()
        self._flushed_at: int | None = None
        self._newest_host_time = 0
        self.sample_count = 0
        self.holds_data = False

    def append(self, samples: NDArray[np.void]) -> None:
        """Add samples, shape (n,) with SAMPLE_DTYPE; close the chunk once it is 0.125 s old."""
        if samples.dtype != layout.SAMPLE_DTYPE or samples.ndim != 1:
            raise ValueError(
                f"samples must have SAMPLE_DTYPE and one dimension, not {samples.dtype} "
                f"with shape {samples.shape}"
            )
        if not len(samples):
            return
        with self._writing():
            self._mcap.add_samples(samples)
        self.sample_count += len(samples)
        self.holds_data = True
        if self._flushed_at is None:
            self._flushed_at = max(int(samples["host_time_ns"][0]), 0)
        self._newest_host_time = max(int(samples["host_time_ns"][-1]), 0)
        self.poll(self._newest_host_time)

    def append_telemetry(
        self, channel: TelemetryChannel, rows: NDArray[np.void], times_ns: NDArray[np.int64]
    ) -> None:
        """Add rows (n,) of another channel, with the host's times; written with the next chunk.

        A recording without samples has chunks of its telemetry alone, as old.
        """
        if rows.dtype != channel.dtype or rows.shape != times_ns.shape:
            raise ValueError(f"rows of {channel.topic} must have its dtype, and a time each")
        if not len(rows):
            return
        with self._writing():
            self._mcap.add_telemetry(channel, rows, times_ns)
        self.holds_data = True
        if self._flushed_at is None:
            self._flushed_at = max(int(times_ns[0]), 0)
        if not self.sample_count:
            self._newest_host_time = max(int(times_ns[-1]), 0)
            self.poll(self._newest_host_time)

    def _describe(self, metadata: RecordingMetadata) -> None:
        """Write the metadata anew, in the place of what was written before."""
        self._entries = to_entries(metadata)
        self._mark(METADATA_NAME, self._entries)

    def poll(self, host_time_ns: int) -> None:
        """Write the chunk out if its oldest sample is older than FLUSH_SPAN_NS by this clock.

        Call it where no sample arrives; :meth:`append` does the same.
        """
        if self._flushed_at is None:
            return
        if abs(host_time_ns - self._flushed_at) >= FLUSH_SPAN_NS:
            self._flush(host_time_ns)

    def attach(self, name: str, data: bytes, media_type: str) -> None:
        """Add a file, in its place among the samples."""
        with self._writing():
            self._mcap.flush()
            self._mcap.attach(self._newest_host_time, name, media_type, data)
        self._flush(self._newest_host_time)
        self.holds_data = True

    def note(self, sentence: str) -> None:
        """Add a sentence for the report, in its place among the samples."""
        self._mark(NOTE_NAME, {"note": sentence})

    def mark_sheet(self, sheet: int) -> None:
        """Record that this sheet of material is loaded from the next sample on (-1: none)."""
        self._mark(layout.SHEET_NAME, {"sheet": str(sheet)})

    def mark(self, name: str, value: str) -> None:
        """Add a fact about the samples so far, by name."""
        self._mark(layout.MARK_NAME, {"name": name, "value": value})

    def finish(self) -> None:
        """Write what is left, the metadata again, the index and the footer; leave the file open."""
        with self._writing():
            self._mcap.flush()
            self._mcap.add_metadata(METADATA_NAME, self._entries)
            self._mcap.finish()

    def _mark(self, name: str, entries: dict[str, str]) -> None:
        with self._writing():
            self._mcap.flush()
            self._mcap.add_metadata(name, entries)
        self._flush(self._newest_host_time)

    def _flush(self, host_time_ns: int) -> None:
        with self._writing():
            self._mcap.flush()
        if self._flushed_at is not None:
            self._flushed_at = host_time_ns

    def _writing(self) -> AbstractContextManager[None]:
        """Stands around whatever may write; a writer that keeps the file turns its errors."""
        return contextlib.nullcontext()


def create_locked(path: Path, part: Path) -> IO[bytes]:
    """Create ``part``, which will become ``path``, and hold its lock until it is closed.

    The lock ends with the process; where there are no locks, none is held. Raises InputError if
    either name is taken or the folder cannot be written.
    """
    while True:
        if path.exists():
            raise InputError(f"{path} exists and is not overwritten. Choose another name.")
        try:
            stream = part.open("xb")
        except FileExistsError:
            raise InputError(
                f"{part} exists: a capture of that name is running or was interrupted. Wait "
                "until it ends; the next command recovers an interrupted one."
            ) from None
        except OSError as error:
            raise InputError(
                f"{part} cannot be created: {error.strerror}. Make the folder {path.parent} "
                "first, or choose one that you may write to."
            ) from error
        lock(stream)
        # A recovery may have renamed the empty file between its creation and the lock.
        if is_same_file(part, stream):
            return stream
        stream.close()


def is_same_file(path: Path, stream: IO[bytes]) -> bool:
    """Whether ``path`` still names the open file."""
    try:
        return os.path.samestat(path.stat(), os.fstat(stream.fileno()))
    except FileNotFoundError:
        return False


def seal(stream: IO[bytes], part: Path, path: Path) -> None:
    """Flush the file to disk, rename it, and only then release the lock."""
    if path.exists():
        raise InputError(
            f"{path} was created by another program during the capture and is not overwritten: "
            f"the capture is kept as {part.name}. The next command recovers it under another name."
        )
    stream.flush()
    os.fsync(stream.fileno())
    if os.name == "nt":  # Windows renames no file that is open
        stream.close()
    part.rename(path)
    keep_name(path.parent)
    stream.close()


@contextlib.contextmanager
def explained(part: Path) -> Iterator[None]:
    """Turn a write error into one that says what is kept."""
    try:
        yield
    except OSError as error:
        kept = f"Samples until then are kept in {part}; the next command recovers them."
        raise file_error(error, part, kept) or error from None


class RecordingWriter(SampleFile):
    """Writes ``<path>.part`` while it runs, and renames it to ``path`` at ``close``.

    An unfinished capture is recognised by its name, and by a lock whether its process still runs.
    Samples appended more than 0.25 s ago (by their host clock) have been handed to the operating
    system, so that killing the process does not lose them.

    ``kind`` and ``joint`` are as in Recording.

    Raises InputError if ``path`` or its ``.part`` exists, or the folder is missing;
    ScissorcalError if writing fails (what was written until then is kept).

    >>> with RecordingWriter("captures/friction.mcap", "friction") as writer:  # doctest: +SKIP
    ...     writer.append(samples)
    """

    def __init__(
        self,
        path: str | Path,
        kind: Kind,
        joint: Joint = Joint(),
        facts: RecordingFacts = RecordingFacts(),
    ) -> None:
        if facts.strokes and facts.min_travel is not None:
            raise ValueError("give strokes or min_travel, not both")
        self.path = Path(path)
        self.part = self.path.with_name(self.path.name + layout.PART_SUFFIX)
        self._metadata = describe(kind, joint, facts)
        self._stream = create_locked(self.path, self.part)
        self._failed = False
        super().__init__(self._stream, self._metadata)

    def state_strokes(self, strokes: tuple[Stroke, ...]) -> None:
        """State all strokes anew, where they are chosen while the capture runs.

        Call it before samples of a new stroke are appended, so that a killed capture has it too.
        """
        self._metadata = self._metadata.model_copy(update={"strokes": stroke_records(strokes)})
        self._describe(self._metadata)

    def close(self) -> Path:
        """Finish the file, rename it and return its path; a second call does nothing."""
        if self._failed:
            raise ScissorcalError(
                f"{self.path} is not finished: {self.part.name} could not be written. The next "
                "command recovers what is in it."
            )
        if not self._stream.closed:
            with self._writing():
                self.finish()
                seal(self._stream, self.part, self.path)
        return self.path

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        if self._stream.closed:
            return
        if error is None:
            self.close()
        elif not self.holds_data:
            self._stream.close()
            self.part.unlink()
        else:
            stopped = isinstance(error, KeyboardInterrupt)
            reason = "Ctrl-C" if stopped else str(error) or type(error).__name__
            self.note(f"The capture ended early after {self.sample_count} samples: {reason}")
            if isinstance(error, DeviceError) and error.stop:
                self.mark(STOP_MARK, error.stop)
            self.close()

    @contextlib.contextmanager
    def _writing(self) -> Iterator[None]:
        """Release file and lock where writing fails, so that recovery finds the file."""
        try:
            with explained(self.part):
                yield
        except ScissorcalError:
            self._failed = True
            with contextlib.suppress(OSError):
                self._stream.close()
            raise


def write_recording(recording: Recording, path: str | Path) -> Path:
    """Write a recording in memory (an import, a simulation) as one file; return its path.

    Samples, strokes, joint, handle radius, device, recipe and notes come back from
    ``read_recording`` as they were. Raises as RecordingWriter does.
    """
    with RecordingWriter(
        path,
        recording.kind,
        recording.joint,
        facts=RecordingFacts(
            recipe_toml=recording.recipe_toml,
            device=recording.device,
            handle_radius_m=recording.handle_radius_m,
            strokes=recording.strokes,
        ),
    ) as writer:
        for sentence in recording.notes:
            writer.note(sentence)
        writer.append(recording.samples)
        for name, value in recording.marks:
            writer.mark(name, value)
    return writer.path
