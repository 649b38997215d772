"""Path of the C core's sources, to build them into firmware or another engine."""

from pathlib import Path


def c_sources() -> Path:
    """Directory of the C core: ``sc_*.c`` and ``sc_*.h``.

    All but ``sc_block``, ``sc_loop`` and ``sc_rights``, which ask a system, is portable C99 without
    allocation. Compiled without contraction of products and sums (``-ffp-contract=off``), it gives
    on any processor the bits that this installation computes; with it, the torque within rounding.

    >>> sorted(path.name for path in c_sources().glob("*.h"))[:2]
    ['sc_block.h', 'sc_bytes.h']
    """
    return Path(__file__).parent / "c"
