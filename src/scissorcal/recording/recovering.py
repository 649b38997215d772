"""Recover interrupted captures, without deleting anything."""

from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np

from scissorcal.errors import InputError
from scissorcal.foreign import open_foreign
from scissorcal.foreign.formats import RECORDING
from scissorcal.recording import layout
from scissorcal.recording.samplefile import SampleFile, explained, is_same_file, seal
from scissorcal.recording.scan import Attachment, Mark, Note, Scan, Sheet, Telemetry, scan_file

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
    from scissorcal.locks import try_lock

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
