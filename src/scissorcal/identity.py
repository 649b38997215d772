"""Identity: the version of this program; the SHA-256 of facts, of bytes, of a file."""

import hashlib
import json
from pathlib import Path
from typing import Any

VERSION = "0.1.0"


def digest(facts: Any) -> str:
    """SHA-256 over the canonical JSON text of plain values: keys sorted, no spaces.

    >>> digest({"b": 1, "a": [2.5]}) == digest({"a": [2.5], "b": 1})
    True
    """
    text = json.dumps(facts, sort_keys=True, separators=(",", ":"))
    return bytes_digest(text.encode())


def bytes_digest(data: bytes) -> str:
    """SHA-256 over bytes, in hexadecimal."""
    return hashlib.sha256(data).hexdigest()


def file_digest(path: Path) -> str:
    """SHA-256 over a file's bytes."""
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()
