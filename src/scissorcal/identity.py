"""Identity of content: one digest of facts, one of a file's bytes."""

import hashlib
import json
from pathlib import Path
from typing import Any


def digest(facts: Any) -> str:
    """SHA-256 over the canonical JSON text of plain values: keys sorted, no spaces.

    >>> digest({"b": 1, "a": [2.5]}) == digest({"a": [2.5], "b": 1})
    True
    """
    text = json.dumps(facts, sort_keys=True, separators=(",", ":"))
    return hashlib.sha256(text.encode()).hexdigest()


def file_digest(path: Path) -> str:
    """SHA-256 over a file's bytes."""
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()
