"""The one object that every command prints with ``--json``."""

import dataclasses
import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import PurePath
from typing import Any

from scissorcal.verdicts import Verdict


@dataclass(frozen=True)
class Envelope:
    """What a command did: ``ok`` is False exactly where the exit code is not 0.

    ``result`` is the command's own; where it ended in an error it holds ``error`` (the sentence)
    and ``exit_code``. ``files`` are the paths that the command wrote. ``seconds`` is its run time.
    """

    command: str
    ok: bool
    result: dict[str, Any]
    verdicts: list[Verdict]
    files: list[str]
    seconds: float


def plain(value: Any) -> Any:
    """Turn dataclasses, arrays, numpy scalars, paths and sets into what JSON can hold.

    Numbers that are not finite become null, as JSON has no word for them.

    >>> plain({"a": float("nan"), "b": (1, 2)})
    {'a': None, 'b': [1, 2]}
    """
    if value is None or isinstance(value, (bool, int, str)):
        return value
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        names = [field.name for field in dataclasses.fields(value)]
        names += getattr(value, "also_written", ())
        return {name: plain(getattr(value, name)) for name in names}
    if isinstance(value, Mapping):
        return {str(key): plain(item) for key, item in value.items()}
    if isinstance(value, (list, tuple, set, frozenset)):
        return [plain(item) for item in value]
    if isinstance(value, PurePath):
        return str(value)
    if hasattr(value, "tolist"):
        return plain(value.tolist())
    return str(value)
