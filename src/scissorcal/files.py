"""Files that are written whole or not at all."""

import contextlib
import os
from collections.abc import Iterator
from pathlib import Path


@contextlib.contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """Give a name to write to; the file takes the place of ``path`` once the block has ended.

    Its bytes are on the disk before that, so that neither an error nor a power failure leaves half
    a file; what was there stays until then, and after an error. An OSError names ``path``. Two
    processes that write the same file do not mix: the last one wins.

    >>> with replacing(Path("a.txt")) as part:
    ...     _ = part.write_text("whole")
    >>> Path("a.txt").read_text()
    'whole'
    """
    part = path.with_name(f"{path.name}.{os.getpid()}.part")
    try:
        yield part
        with part.open("rb") as file:
            os.fsync(file.fileno())
        part.replace(path)
    except BaseException as error:
        with contextlib.suppress(OSError):
            part.unlink()
        if isinstance(error, OSError) and error.filename == str(part):
            error.filename, error.filename2 = str(path), None
        raise
