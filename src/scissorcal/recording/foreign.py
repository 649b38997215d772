"""Files of other kinds, told by their first bytes."""

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
    known = {
        b"\x89PNG": "a PNG image",
        b"\xff\xd8\xff": "a JPEG image",
        b"PK\x03\x04": "a zip archive",
        b"PAR1": "a Parquet table (use 'scissorcal import')",
        b"MATLAB": "a MATLAB file (use 'scissorcal import')",
        b"\x89HDF": "an HDF5 file",
    }
    looks = next((words for start, words in known.items() if data.startswith(start)), "")
    if not looks:
        printable = sum(32 <= byte < 127 or byte in b"\r\n\t" for byte in data[:1000])
        text = printable > 0.9 * len(data[:1000])
        looks = "text (for a table use 'scissorcal import')" if text else "an unknown format"
    raise InputError(
        f"{path} is not a recording: its first bytes are those of {looks}. Name an .mcap file that "
        "scissorcal wrote."
    )
