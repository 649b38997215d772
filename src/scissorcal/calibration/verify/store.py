"""Trust checks on disk, as JSON."""

import json
from dataclasses import asdict
from pathlib import Path

from scissorcal.calibration.verify.result import FORMAT, VerifyResult
from scissorcal.errors import InputError


def save_verify(result: VerifyResult, path: Path) -> None:
    """Write a trust check to ``path``, complete or not at all."""
    path.parent.mkdir(parents=True, exist_ok=True)
    part = path.with_name(path.name + ".part")
    text = json.dumps(asdict(result), allow_nan=False, ensure_ascii=False, separators=(",", ":"))
    part.write_text(text + "\n", encoding="utf-8")
    part.replace(path)


def load_verify(path: Path) -> VerifyResult:
    """Read a trust check written by :func:`save_verify`. Raises InputError if it is not one."""
    from pydantic import TypeAdapter, ValidationError

    try:
        found = TypeAdapter(VerifyResult).validate_json(path.read_bytes())
    except (OSError, ValidationError) as error:
        raise InputError(
            f"{path} is not a trust check of scissorcal, or it is damaged "
            f"({str(error).splitlines()[0]}); remove it and run 'scissorcal verify' again."
        ) from error
    if found.format != FORMAT:
        raise InputError(
            f"{path} has the format {found.format}, and this version reads {FORMAT}: remove it and "
            "run 'scissorcal verify' again."
        )
    return found
