"""Read a recording, also one that is cut off or damaged."""

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from scissorcal.errors import InputError
from scissorcal.files import try_lock
from scissorcal.foreign import open_foreign, reading, refuse_unless_regular
from scissorcal.foreign.formats import ANY, RECORDING
from scissorcal.identity import file_digest
from scissorcal.recording import layout
from scissorcal.recording.layout import TelemetryChannel
from scissorcal.recording.recording import Recording, Stroke, gap_note
from scissorcal.recording.scan import Attachment, Mark, Note, Scan, Sheet, Telemetry, scan_file
from scissorcal.recording.strokes import label_strokes
from scissorcal.recording.writer import SampleFile, explained, is_same_file, seal


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
    sheets = np.full(len(samples), -1)
    at = 0
    for event in scan.events:
        if isinstance(event, np.ndarray):
            at += len(event)
        elif isinstance(event, Sheet):
            sheets[at:] = event.number
    time = samples["device_time_us"] * 1e-6
    labels = label_strokes(samples["opening"], time, min_travel, sheet=sheets)
    samples["stroke"] = labels.stroke_of_sample
    return labels.strokes


def _condition(scan: Scan, count: int) -> list[str]:
    if scan.finished:
        return scan.damage
    return [f"The recording is not finished; it has {count} complete samples.", *scan.damage]


KEPT_SUFFIX = ".interrupted"


@dataclass(frozen=True)
class Recovered:
    """The result for one unfinished capture.

    ``recovered``: ``recording`` is the finished file. ``empty``: it had no complete sample.
    ``busy``: a running process still writes it, so it was not touched. ``kept`` is the path of the
    original.
    """

    status: Literal["recovered", "empty", "busy"]
    kept: Path
    recording: Path | None
    samples: int
    sentence: str


def recover(folder: str | Path) -> tuple[Recovered, ...]:
    """Turn every ``*.mcap.part`` of a folder into a finished recording, and report on each.

    The complete samples, notes and attachments go into ``<name>.mcap`` with a note about the
    interruption; the original is kept as ``<name>.mcap.interrupted``. Captures that a running
    process still writes are not touched. It may be called at any time, by several processes, and
    may be killed: the next call finishes the work. A call with nothing to do, or for a folder that
    does not exist, returns an empty tuple.
    """
    parts = sorted(Path(folder).glob("*.mcap" + layout.PART_SUFFIX))
    return tuple(result for part in parts if (result := _recover_one(part)) is not None)


def _recover_one(part: Path) -> Recovered | None:
    if not part.exists():
        return None
    with open_foreign(part, RECORDING) as stream, explained(part):
        free = try_lock(stream)
        if free is None:
            sentence = (
                f"{part.name} was not touched: there are no locks here, so that it is not known "
                "whether it is still being written. Copy the folder to a disk of a computer that "
                "has locks."
            )
            return Recovered("busy", part, None, 0, sentence)
        if not free:
            sentence = f"{part.name} is still being written, so it was not touched."
            return Recovered("busy", part, None, 0, sentence)
        if not is_same_file(part, stream):
            return None
        try:
            scan = scan_file(part)
        except InputError as error:
            kept = _keep(part)
            return Recovered("empty", kept, None, 0, f"Nothing could be recovered: {error}")
        samples = scan.samples()
        if not len(samples) and not scan.telemetry_rows():
            kept = _keep(part)
            sentence = f"{part.name} was interrupted before its first sample was written."
            return Recovered("empty", kept, None, 0, sentence)
        path = _already_recovered(part, scan) or _rewrite(part, scan)
        kept = _keep(part)
    held = f"{sum(scan.telemetry_rows().values())} rows beside samples"
    if len(samples):
        seconds = float(samples["device_time_us"][-1] - samples["device_time_us"][0]) * 1e-6
        held = f"{len(samples)} samples, {seconds:.2f} s"
    sentence = f"{path.name} was recovered from an interrupted capture: {held}."
    return Recovered("recovered", kept, path, len(samples), sentence)


def _rewrite(part: Path, scan: Scan) -> Path:
    """Write the finished recording beside the original and return its path."""
    path = _free(part.with_name(part.name.removesuffix(layout.PART_SUFFIX)))
    draft = part.with_name(part.name.removesuffix(layout.PART_SUFFIX) + ".recovery")
    metadata = scan.metadata.model_copy(update={"recovered_from": scan.content_hash})
    with draft.open("wb") as stream:
        file = SampleFile(stream, metadata)
        for event in scan.events:
            if isinstance(event, np.ndarray):
                file.append(event)
            elif isinstance(event, Telemetry):
                times_ns = event.messages["log_time"].astype(np.int64)
                file.append_telemetry(event.channel, event.messages["row"], times_ns)
            elif isinstance(event, Note):
                file.note(event.sentence)
            elif isinstance(event, Sheet):
                file.mark_sheet(event.number)
            elif isinstance(event, Mark):
                file.mark(event.name, event.value)
            elif isinstance(event, Attachment):
                file.attach(event.name, event.data, event.media_type)
        if not scan.finished:
            file.note(f"The capture was interrupted after {file.sample_count} samples.")
        for sentence in scan.damage:
            file.note(sentence)
        file.finish()
        seal(stream, draft, path)
    return path


def _already_recovered(part: Path, scan: Scan) -> Path | None:
    """Find the recording that an earlier, interrupted call made of these bytes."""
    name = part.name.removesuffix(".mcap" + layout.PART_SUFFIX)
    for candidate in sorted(part.parent.glob(f"{name}*.mcap")):
        try:
            if scan_file(candidate).metadata.recovered_from == scan.content_hash:
                return candidate
        except InputError:
            continue
    return None


def _keep(part: Path) -> Path:
    """Rename the original; it is never deleted."""
    kept = _free(part.with_name(part.name.removesuffix(layout.PART_SUFFIX) + KEPT_SUFFIX))
    return part.rename(kept)


def _free(path: Path) -> Path:
    """Return ``path``, or the first of ``stem-2``, ``stem-3``, ... that is not taken."""
    stem, suffixes = path.name.split(".mcap", 1)
    candidate, number = path, 1
    while candidate.exists():
        number += 1
        candidate = path.with_name(f"{stem}-{number}.mcap{suffixes}")
    return candidate
