"""What the files of a workspace hold, read once for each content and kept in .scissorcal/."""

import contextlib
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

from scissorcal.errors import InputError
from scissorcal.files import replacing
from scissorcal.foreign import read_json
from scissorcal.foreign.formats import STATE
from scissorcal.identity import digest, file_digest

FORMAT = "scissorcal-index/4"

Facts = dict[str, Any]


class FileIndex:
    """Facts of files, looked up by path, size and times of change.

    A file that was written since has another time of change (ctime, which programs cannot set),
    so that facts are never those of earlier content. The index only saves time: it may be removed
    at any moment, and a workspace that cannot be written works without it.
    """

    def __init__(self, root: Path) -> None:
        self.root = root
        self.path = root / ".scissorcal" / "index.json"
        self._entries = self._read()
        self._changed = False

    def facts(self, path: Path, what: str, read: Callable[[Path], Facts], given: str = "") -> Facts:
        """Give the facts named ``what`` of one file, by ``read`` where they are not known yet.

        Facts are plain values, as JSON holds them. ``given`` identifies what else they follow
        from: of several, the newest are kept. What ``read`` raises passes through.
        """
        key = str(path.relative_to(self.root)) if path.is_relative_to(self.root) else str(path)
        stamp = _stamp(path)
        entry = self._entries.get(key)
        if entry is None or entry["stamp"] != stamp:
            entry = self._entries[key] = {"stamp": stamp, "facts": {}}
        known = entry["facts"].get(what)
        if known is None or known["given"] != given:
            found = json.loads(json.dumps(read(path)))
            known = {"given": given, "facts": found, "digest": _digest(given, found)}
            entry["facts"][what] = known
            self._changed = True
        facts: Facts = known["facts"]
        return facts

    def digest(self, path: Path) -> str:
        """SHA-256 of a file's bytes."""
        return str(self.facts(path, "sha256", lambda file: {"sha256": file_digest(file)})["sha256"])

    def save(self) -> None:
        """Keep what was read, where the workspace can be written; forget files that are gone."""
        if not self._changed:
            return
        there = {key: entry for key, entry in self._entries.items() if (self.root / key).exists()}
        text = json.dumps({"format": FORMAT, "files": there})
        # Without the index every command still works, only slower.
        with contextlib.suppress(OSError):
            self.path.parent.mkdir(exist_ok=True)
            with replacing(self.path) as part:
                part.write_text(text, encoding="utf-8")
            self._changed = False

    def _read(self) -> dict[str, Any]:
        try:
            found = read_json(self.path, STATE)
        except InputError:
            return {}
        if not isinstance(found, dict) or found.get("format") != FORMAT:
            return {}
        entries = found.get("files")
        if not isinstance(entries, dict):
            return {}
        return {key: entry for key, entry in entries.items() if _is_entry(entry)}


def _is_entry(entry: Any) -> bool:
    """Whether an entry is whole, as :meth:`FileIndex.facts` keeps it; others are dropped."""
    if not isinstance(entry, dict) or not isinstance(entry.get("facts"), dict):
        return False
    return "stamp" in entry and all(_is_whole(one) for one in entry["facts"].values())


def _is_whole(known: Any) -> bool:
    if not isinstance(known, dict) or not isinstance(known.get("facts"), dict):
        return False
    given = known.get("given")
    return isinstance(given, str) and known.get("digest") == _digest(given, known["facts"])


def _digest(given: str, facts: Facts) -> str:
    """Digest of kept facts and of what they follow from, which damage changes."""
    return digest([given, facts])


def _stamp(path: Path) -> list[int]:
    stat = path.stat()
    return [stat.st_size, stat.st_mtime_ns, stat.st_ctime_ns, stat.st_ino]
