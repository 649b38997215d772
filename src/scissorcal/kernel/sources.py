"""Where the C core's own sources lie, for whoever builds it into firmware or another engine."""

from pathlib import Path


def c_sources() -> Path:
    """Directory of the C core: ``sc_*.c`` and ``sc_*.h``.

    All but ``sc_block`` and ``sc_loop``, which need POSIX, is portable C99 without allocation.

    >>> sorted(path.name for path in c_sources().glob("*.h"))[:2]
    ['sc_block.h', 'sc_crack.h']
    """
    return Path(__file__).parent / "c"
