"""Files that come from elsewhere: opened, bounded and parsed so that none can end the program.

Every room reads foreign files through this one. `open_foreign` and what is built on it
(`read_foreign`, `read_foreign_text`, `read_json`) take regular files of at most the format's size.
`reading` turns what a parser raises into one sentence that names the file. `parse_isolated` runs a
parser that is written in C in a child process with limits of memory and time.
"""

from scissorcal.foreign.formats import Format
from scissorcal.foreign.isolated import parse_isolated
from scissorcal.foreign.reading import (
    decode_text,
    first_line,
    open_foreign,
    parse_json,
    read_foreign,
    read_foreign_text,
    read_json,
    reading,
    refuse_unless_regular,
)

__all__ = [
    "Format",
    "decode_text",
    "first_line",
    "open_foreign",
    "parse_isolated",
    "parse_json",
    "read_foreign",
    "read_foreign_text",
    "read_json",
    "reading",
    "refuse_unless_regular",
]
