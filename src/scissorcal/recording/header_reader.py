"""Read what a recording is, without its samples: by the index of the file, else by a scan.

Nothing heavy is imported for a file with an index, so that a command can look at every recording
of a workspace.
"""

import json
import math
import struct
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import IO

from scissorcal.foreign import open_foreign, reading
from scissorcal.foreign.formats import RECORDING
from scissorcal.recording.header import (
    FORMAT,
    HEAD,
    MAGIC,
    METADATA_NAME,
    NOTE_NAME,
    SAMPLE_CHANNEL,
    Joint,
    RecordingHeader,
    Stroke,
    checksum,
)

_FOOTER = struct.Struct("<BQQQI")
_STATISTICS = struct.Struct("<QHIIIIQQ")
_METADATA_INDEX = struct.Struct("<QQ")


def read_header(path: str | Path) -> RecordingHeader:
    """Read what a recording says about itself, without its samples.

    A finished file has an index at its end, so that a few kilobytes are read (some milliseconds).
    A file that was cut off or damaged is read whole, as `read_recording` does. Raises InputError
    as that does.
    """
    path = Path(path)
    with open_foreign(path, RECORDING) as stream:
        header = _from_index(stream)
    return header or _from_scan(path)


def _from_index(stream: IO[bytes]) -> RecordingHeader | None:
    """Read by the index of a finished file; None where there is none or anything is odd."""
    end = stream.seek(0, 2) - len(MAGIC) - _FOOTER.size
    try:
        stream.seek(end)
        opcode, _, start, _, _ = _FOOTER.unpack(stream.read(_FOOTER.size))
        if opcode != 0x02 or not 0 < start < end or stream.read() != MAGIC:
            return None
        stream.seek(start)
        summary = stream.read(end - start)
        records: dict[str, list[dict[str, str]]] = {}
        count = duration_ns = None
        room = end
        for opcode, body in _records(summary):
            if opcode == 0x0B:
                count, *_, first, last = _STATISTICS.unpack_from(body)
                count -= _beside_samples(body[_STATISTICS.size :])
                duration_ns = last - first
            elif opcode == 0x0D:
                offset, length = _METADATA_INDEX.unpack_from(body)
                room -= length
                if length < HEAD.size or room < 0:  # more metadata than the file has bytes
                    return None
                stream.seek(offset + HEAD.size)
                name, entries = _metadata(stream.read(length - HEAD.size))
                records.setdefault(name, []).append(entries)
        described = [e for e in records.get(METADATA_NAME, ()) if _is_sound(e)]
        if count is None or duration_ns is None or not described:
            return None
        notes = tuple(entries.get("note", "") for entries in records.get(NOTE_NAME, ()))
        return _header(described[-1], notes, count, duration_ns * 1e-9)
    except Exception:  # noqa: BLE001 - without a sound index, the scan says what is wrong
        return None


def _beside_samples(counts: bytes) -> int:
    """Messages of channels other than the first, by the counts of a statistics record."""
    (size,) = struct.unpack_from("<I", counts)
    pairs = struct.iter_unpack("<HQ", counts[4 : 4 + size])
    return sum(count for channel, count in pairs if channel != SAMPLE_CHANNEL)


def _is_sound(entries: Mapping[str, str]) -> bool:
    right = entries.get("format") == FORMAT
    return right and entries.get("crc32") == checksum(entries)


def _records(data: bytes) -> Iterator[tuple[int, bytes]]:
    at = 0
    while at + HEAD.size <= len(data):
        opcode, length = HEAD.unpack_from(data, at)
        at += HEAD.size + length
        yield opcode, data[at - length : at]


def _metadata(body: bytes) -> tuple[str, dict[str, str]]:
    """Name and entries of a metadata record: strings with their lengths before them."""
    texts = []
    at = 0

    def text() -> str:
        nonlocal at
        (length,) = struct.unpack_from("<I", body, at)
        at += 4 + length
        return body[at - length : at].decode()

    name = text()
    at += 4
    while at < len(body):
        texts.append((text(), text()))
    return name, dict(texts)


def _header(
    entries: Mapping[str, str],
    notes: tuple[str, ...],
    count: int,
    duration_s: float,
    *,
    finished: bool = True,
) -> RecordingHeader:
    radius = json.loads(entries["handle_radius_m"])
    strokes = json.loads(entries["strokes"])
    return RecordingHeader(
        kind=entries["kind"],  # type: ignore[arg-type]
        joint=Joint(entries["joint"]),  # type: ignore[arg-type]
        handle_radius_m=math.nan if radius is None else radius,
        strokes=tuple(
            Stroke(**{**stroke, "speed": math.nan if stroke["speed"] is None else stroke["speed"]})
            for stroke in strokes
        ),
        min_travel=json.loads(entries["min_travel"]),
        recipe_toml=entries["recipe_toml"],
        device=json.loads(entries["device"]),
        notes=notes,
        sample_count=count,
        duration_s=duration_s,
        finished=finished,
    )


def _from_scan(path: Path) -> RecordingHeader:
    from scissorcal.recording.scan import scan_file
    from scissorcal.recording.schema import to_entries

    scan = scan_file(path)
    time_ns = scan.samples()["host_time_ns"]
    duration_s = float(time_ns[-1] - time_ns[0]) * 1e-9 if len(time_ns) else 0.0
    entries = to_entries(scan.metadata)
    with reading(path, RECORDING):
        return _header(entries, scan.notes(), len(time_ns), duration_s, finished=scan.finished)
