"""Files that do not begin as a recording, and are of no other known kind."""

from pathlib import Path

from scissorcal.errors import InputError
from scissorcal.recording.header import MAGIC


def refuse_other_formats(path: Path, data: bytes) -> None:
    """InputError that says what a file is which does not begin as a recording."""
    if data.startswith(MAGIC):
        return
    if MAGIC.startswith(data):
        raise InputError(
            f"{path} is cut off within its first {len(MAGIC)} bytes: nothing can be recovered "
            "from it. Capture again."
        )
    raise InputError(
        f"{path} is not a recording: its first bytes are those of an unknown format. Name an .mcap "
        "file that scissorcal wrote."
    )
