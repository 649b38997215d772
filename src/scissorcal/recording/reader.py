"""Read a recording, also one that is cut off or damaged."""

import math
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from scissorcal.foreign import reading, refuse_unless_regular
from scissorcal.foreign.formats import ANY, RECORDING
from scissorcal.identity import file_digest
from scissorcal.recording.recording import Recording, Stroke
from scissorcal.recording.scan import Attachment, Scan, Sheet, scan_file
from scissorcal.recording.strokes import label_strokes
from scissorcal.recording.summarising import gap_note
from scissorcal.recording.telemetry import TelemetryChannel


def read_recording(path: str | Path) -> Recording:
    """Read a recording, finished or not.

    A file that was cut off gives all samples of its complete chunks; a damaged chunk is left out
    and the rest kept. ``notes`` say what was left out, and where in the file. Strokes that were not
    planned are found from the motion. ``content_hash`` is the SHA-256 of the bytes that were read.

    Raises InputError, naming the file and the remedy, if it is missing, empty, of another format
    or program, or cut off before its description is complete.
    """
    scan = scan_file(Path(path))
    metadata = scan.metadata
    samples = scan.samples()
    strokes = metadata.strokes_of_recording
    if metadata.min_travel is not None:
        with reading(path, RECORDING):
            strokes = _label(samples, metadata.min_travel, scan)
    radius = metadata.handle_radius_m
    notes = [*scan.notes(), *_condition(scan, len(samples)), *gap_note(samples)]
    return Recording(
        kind=metadata.kind,
        samples=samples,
        strokes=strokes,
        joint=metadata.joint_of_recording,
        handle_radius_m=math.nan if radius is None else radius,
        device=metadata.device,
        recipe_toml=metadata.recipe_toml,
        source=str(path),
        content_hash=scan.content_hash,
        notes=tuple(dict.fromkeys(notes)),
        marks=scan.marks(),
        beside=scan.telemetry_rows(),
    )


def read_attachments(path: str | Path) -> tuple[Attachment, ...]:
    """Return the files kept within a recording, in order; raises as ``read_recording`` does."""
    events = scan_file(Path(path)).events
    return tuple(event for event in events if isinstance(event, Attachment))


def read_telemetry(path: str | Path, channel: TelemetryChannel) -> NDArray[np.void]:
    """Return the rows of a channel beside the samples, shape (n,); none where it has no such.

    Each has its ``host_time_ns`` before the channel's own fields. Raises as ``read_recording``.
    """
    return scan_file(Path(path)).telemetry(channel)


def content_hash(path: str | Path) -> str:
    """Return the SHA-256 of a file's bytes in hexadecimal, read in pieces.

    Raises InputError if the file cannot be read.
    """
    refuse_unless_regular(Path(path), ANY)
    return file_digest(Path(path))


def _label(samples: NDArray[np.void], min_travel: float, scan: Scan) -> tuple[Stroke, ...]:
    """Find strokes from the motion, mark the samples, and give each stroke its sheet."""
    sheet = np.full(len(samples), -1)
    at = 0
    for event in scan.events:
        if isinstance(event, np.ndarray):
            at += len(event)
        elif isinstance(event, Sheet):
            sheet[at:] = event.number
    time = samples["device_time_us"] * 1e-6
    labels = label_strokes(samples["opening"], time, min_travel, sheet=sheet)
    samples["stroke"] = labels.stroke_of_sample
    return labels.strokes


def _condition(scan: Scan, count: int) -> list[str]:
    if scan.finished:
        return scan.damage
    return [f"The recording is not finished; it has {count} complete samples.", *scan.damage]
