"""Write a recording so that a killed capture loses at most 0.25 s."""

import contextlib
from collections.abc import Iterator
from pathlib import Path
from types import TracebackType
from typing import Self

import numpy as np
from numpy.typing import NDArray

from scissorcal.errors import DeviceError, ScissorcalError
from scissorcal.recording import layout
from scissorcal.recording.recording import STOP_MARK, Joint, Kind, Recording, Stroke
from scissorcal.recording.samplefile import SampleFile, create_locked, explained, seal
from scissorcal.recording.schema import RecordingFacts, describe, stroke_records
from scissorcal.recording.telemetry import TelemetryChannel


class RecordingWriter:
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
        with self._writing():
            self._file = SampleFile(self._stream, self._metadata)

    @property
    def sample_count(self) -> int:
        """Samples appended so far."""
        return self._file.sample_count

    def append(self, samples: NDArray[np.void]) -> None:
        """Add samples, shape (n,) with SAMPLE_DTYPE, in the order of time."""
        with self._writing():
            self._file.append(samples)

    def append_telemetry(
        self, channel: TelemetryChannel, rows: NDArray[np.void], times_ns: NDArray[np.int64]
    ) -> None:
        """Add rows of another channel, shape (n,), each with a time of the host's clock in ns."""
        with self._writing():
            self._file.append_telemetry(channel, rows, times_ns)

    def state_strokes(self, strokes: tuple[Stroke, ...]) -> None:
        """State all strokes anew, where they are chosen while the capture runs.

        Call it before samples of a new stroke are appended, so that a killed capture has it too.
        """
        self._metadata = self._metadata.model_copy(update={"strokes": stroke_records(strokes)})
        with self._writing():
            self._file.describe(self._metadata)

    def poll(self, host_time_ns: int) -> None:
        """Write out buffered samples if due by this clock, where no sample arrives."""
        with self._writing():
            self._file.flush_if_due(host_time_ns)

    def attach(self, name: str, data: bytes, media_type: str) -> None:
        """Add a file (a photograph, a calibration), kept byte for byte."""
        with self._writing():
            self._file.attach(name, data, media_type)

    def note(self, sentence: str) -> None:
        """Add a sentence for the report; it survives a killed capture."""
        with self._writing():
            self._file.note(sentence)

    def mark(self, name: str, value: str) -> None:
        """Add a fact about the samples so far, as ``Recording.marks`` has them."""
        with self._writing():
            self._file.mark(name, value)

    def mark_sheet(self, sheet: int) -> None:
        """Record that this sheet of material is loaded from the next sample on (-1: none).

        Only strokes that are found from the motion (``min_travel``) read this; planned strokes
        carry their sheet themselves.
        """
        with self._writing():
            self._file.mark_sheet(sheet)

    def close(self) -> Path:
        """Finish the file, rename it and return its path; a second call does nothing."""
        if self._failed:
            raise ScissorcalError(
                f"{self.path} is not finished: {self.part.name} could not be written. The next "
                "command recovers what is in it."
            )
        if not self._stream.closed:
            with self._writing():
                self._file.finish()
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
        elif not self._file.holds_data:
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
