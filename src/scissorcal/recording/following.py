"""Read a recording while it is written: what came since the last look, and whether it ended."""

import os
import time
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path
from typing import IO

import numpy as np
from numpy.typing import NDArray

from scissorcal.errors import InputError
from scissorcal.files import try_lock, unlock
from scissorcal.foreign import open_foreign
from scissorcal.foreign.formats import RECORDING
from scissorcal.recording.chunks import LARGEST_CHUNK, DamageError
from scissorcal.recording.header import HEAD, MAGIC
from scissorcal.recording.layout import TelemetryChannel, rows_of
from scissorcal.recording.scan import Telemetry, Walk, samples_among
from scissorcal.recording.schema import RecordingMetadata

MOST_RECORD_BYTES = 64_000_000
"""Of a record that is read whole; a longer one (a file kept within) is passed over unread."""
_CHUNK, _METADATA, _DATA_END = 0x06, 0x0C, 0x0F
_FIRST_CHUNKS = 6
"""They have the descriptions of the channels, and when the recording began."""
_LAST_CHUNKS = 16
"""Of a recording that is joined in its midst: about 2 s of samples."""


class RecordingFollower(ExitStack):
    """Follows a file that another process appends to; it is only read, never locked or changed.

    A recording grows by a chunk each 0.15 s or so, and each :meth:`read` returns the samples of
    those that are whole by then. One that is joined in its midst begins with its last two seconds.
    The file stays open where its writer renames it at the end, until ``close``.

    Raises InputError where the file cannot be opened, or is none of a recording.

    >>> with RecordingFollower(Path("captures/cut.mcap.part")) as follower:  # doctest: +SKIP
    ...     while not follower.finished:
    ...         samples = follower.read()
    """

    def __init__(self, path: Path) -> None:
        super().__init__()
        self.path = path
        self._stream: IO[bytes] = self.enter_context(open_foreign(path, RECORDING))
        self._offset = 0
        self._joins = True
        self._walk = Walk(room=LARGEST_CHUNK)
        self.finished = False
        """Whether its writer closed it; nothing comes after that."""

    @property
    def metadata(self) -> RecordingMetadata | None:
        """What the recording says about itself; None until that is written."""
        return self._walk.metadata

    @property
    def size(self) -> int:
        """Bytes of the file by now."""
        return os.fstat(self._stream.fileno()).st_size

    @property
    def is_removed(self) -> bool:
        """Whether the file has no name any more, as one that its writer removed."""
        return os.fstat(self._stream.fileno()).st_nlink == 0

    @property
    def age_s(self) -> float:
        """Seconds since something was written, by the computer's clock."""
        return time.time() - os.fstat(self._stream.fileno()).st_mtime

    @property
    def is_written(self) -> bool:
        """Whether a process still has it open to write: its writer holds a lock on it.

        The lock is tried and given back at once, so ask seldom, and only where the file does not
        grow.
        """
        free = try_lock(self._stream)
        if free:
            unlock(self._stream)
        return free is False

    def read(self) -> NDArray[np.void]:
        """The samples (n,) that were appended since the last call, with SAMPLE_DTYPE.

        Damaged chunks are left out. InputError where the file is not one of records any more.
        """
        self._take(self._whole_records())
        return samples_among(self._walk.events)

    def newest_row(self, channel: TelemetryChannel) -> NDArray[np.void]:
        """The last row (at most one) of a channel beside the samples that the last read found."""
        events = [e for e in self._walk.events if isinstance(e, Telemetry) and e.channel == channel]
        none = np.zeros(0, channel.message_dtype)
        return rows_of(channel, events[-1].messages[-1:] if events else none)

    def _whole_records(self) -> list[tuple[int, int, int]]:
        """Place, kind and length of the records that were completed since the last call.

        The first call leaves out the chunks in the middle.
        """
        first = self._offset == 0
        records = list(self._completed())
        if not first:
            return records
        chunks = [record for record in records if record[1] == _CHUNK]
        left_out = set(chunks[_FIRST_CHUNKS:-_LAST_CHUNKS])
        return [record for record in records if record not in left_out]

    def _completed(self) -> Iterator[tuple[int, int, int]]:
        size = self.size
        if self._offset == 0:
            if size < len(MAGIC):
                return
            if self._bytes(0, len(MAGIC)) != MAGIC:
                raise InputError(f"{self.path} is not a recording.")
            self._offset = len(MAGIC)
        while not self.finished and self._offset + HEAD.size <= size:
            opcode, length = HEAD.unpack(self._bytes(self._offset, HEAD.size))
            if not 1 <= opcode <= _DATA_END:
                raise InputError(f"{self.path} is damaged from byte {self._offset} on.")
            end = self._offset + HEAD.size + length
            if end > size:
                return
            if opcode in (_CHUNK, _METADATA) and length <= MOST_RECORD_BYTES:
                yield self._offset, opcode, length
            self.finished = opcode == _DATA_END
            self._offset = end

    def _take(self, records: list[tuple[int, int, int]]) -> None:
        self._walk.events.clear()
        self._walk.damage.clear()
        for offset, opcode, length in records:
            self._walk.room = LARGEST_CHUNK
            try:
                self._walk.take(offset, opcode, self._bytes(offset + HEAD.size, length))
            except DamageError:
                continue  # the report on the finished recording says what is damaged

    def _bytes(self, offset: int, length: int) -> bytes:
        self._stream.seek(offset)
        return self._stream.read(length)
