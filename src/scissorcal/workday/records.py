"""Results kept one by one while a long run goes on, so that a killed one loses none."""

import json
import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from types import TracebackType
from typing import Any

from scissorcal.errors import InputError
from scissorcal.files import replacing, try_lock
from scissorcal.foreign import open_foreign, refuse_unless_regular
from scissorcal.foreign.formats import RECORDS

FORMAT = "scissorcal-records/1"

Record = Mapping[str, Any]


class RecordFile:
    """A file of JSON lines that one run at a time appends to.

    Its first line holds the hash of what the records were made from. Records of other inputs are
    put aside under another name, never mixed with these; ``note`` then reports it. A line that a
    killed run left half-written is cut off.

    >>> with RecordFile(Path("a.jsonl"), "1234") as file:
    ...     file.append({"index": 0})
    >>> with RecordFile(Path("a.jsonl"), "1234") as file:
    ...     file.records
    [{'index': 0}]
    >>> with RecordFile(Path("a.jsonl"), "99") as file:
    ...     file.records, file.note
    ([], 'a.jsonl was made from other inputs; it is kept as a.jsonl.1234.')
    """

    def __init__(self, path: Path, inputs: str) -> None:
        self.path, self.inputs = path, inputs
        self.records: list[Record] = []
        self.note = ""

    def __enter__(self) -> "RecordFile":
        """Open the file and read what is there.

        Raises InputError where another run holds it, or what stands there is no file of records'
        size.
        """
        self.path.parent.mkdir(parents=True, exist_ok=True)
        self._open()
        known, self.records, sound = _read(self.path)
        if known == self.inputs:
            self._stream.truncate(sound)
        elif sound or self.path.stat().st_size:
            aside = self._aside(known)
            self._stream.close()
            self.path.rename(aside)
            self.note = f"{self.path.name} was made from other inputs; it is kept as {aside.name}."
            self.records = []
            self._open()
        if self._stream.seek(0, os.SEEK_END) == 0:
            self._write(self._head)
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._stream.close()

    def append(self, record: Record) -> None:
        """Add one record, and hand it to the operating system before returning."""
        self._write(record)
        self.records.append(record)

    def keep(self, records: Sequence[Record]) -> None:
        """Hold these records alone. A run that is killed meanwhile leaves all that were there."""
        with replacing(self.path) as part:
            part.write_bytes(b"".join(_line(one) for one in (self._head, *records)))
            self._stream.close()  # Windows replaces no file that is open
        self._open()
        self.records = list(records)

    @property
    def _head(self) -> Record:
        return {"format": FORMAT, "inputs": self.inputs}

    def _open(self) -> None:
        if self.path.exists():
            refuse_unless_regular(self.path, RECORDS)
        self._stream = self.path.open("a+b")
        if try_lock(self._stream) is False:
            self._stream.close()
            raise InputError(
                f"{self.path} is being written by another run of this command: wait for it, or "
                "stop it."
            )

    def _aside(self, known: str) -> Path:
        named = known[:8] if known.isascii() and known.isalnum() else "unreadable"
        base = f"{self.path.name}.{named}"
        aside, number = self.path.with_name(base), 1
        while aside.exists():
            number += 1
            aside = self.path.with_name(f"{base}-{number}")
        return aside

    def _write(self, record: Record) -> None:
        self._stream.write(_line(record))
        self._stream.flush()


def _line(record: Record) -> bytes:
    return json.dumps(record, allow_nan=False, separators=(",", ":")).encode() + b"\n"


def _read(path: Path) -> tuple[str, list[Record], int]:
    """The inputs' hash, the records, and the length of what is whole; an empty hash if none is."""
    with open_foreign(path, RECORDS) as file:
        data = file.read()
    lines = data.splitlines(keepends=True)
    found: list[Record] = []
    sound = 0
    for line in lines:
        try:
            record = json.loads(line)
        except (ValueError, RecursionError):
            break
        if not line.endswith(b"\n") or not isinstance(record, dict):
            break
        found.append(record)
        sound += len(line)
    if not found or found[0].get("format") != FORMAT:
        return "", [], 0
    return str(found[0].get("inputs", "")), found[1:], sound
