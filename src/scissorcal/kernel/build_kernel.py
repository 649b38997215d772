"""Builds the C core into ``scissorcal.kernel._kernel`` (cffi, API mode); setup.py names it.

The declarations that cffi needs are the headers themselves, less their preprocessor lines, so that
nothing is declared twice.
"""

import sys
from pathlib import Path

from cffi import FFI

C = Path("src/scissorcal/kernel/c")  # relative: setuptools refuses absolute source paths
HEADERS = (
    "sc_messages.h",
    "sc_wire.h",
    "sc_table.h",
    "sc_table16.h",
    "sc_turn.h",
    "sc_edge.h",
    "sc_model.h",
    "sc_hybrid.h",
    "sc_control.h",
    "sc_control_block.h",
    "sc_motion.h",
    "sc_near_rest.h",
    "sc_passivity.h",
    "sc_plate.h",
    "sc_pieces.h",
    "sc_lag.h",
    "sc_stamp.h",
    "sc_swing.h",
    "sc_watch.h",
    "sc_servo.h",
    "sc_block.h",
    "sc_loop.h",
    "sc_rights.h",
    "sc_cut_fit.h",
    "sc_crack.h",
    "sc_presliding.h",
    "sc_joint.h",
)


def declarations() -> str:
    """Give the headers' declarations without preprocessor lines, in order of dependence."""
    text = "\n".join((C / header).read_text(encoding="utf-8") for header in HEADERS)
    return "\n".join(line for line in text.splitlines() if not line.startswith("#"))


builder = FFI()
builder.cdef(declarations())
builder.set_source(
    "scissorcal.kernel._kernel",
    "\n".join(f'#include "{header}"' for header in HEADERS),
    sources=[str(source) for source in sorted(C.glob("*.c"))],
    depends=[str(header) for header in sorted(C.glob("*.h"))],
    include_dirs=[str(C)],
    libraries=[] if sys.platform == "win32" else ["m"],  # there it is part of the C library
    # without contraction every computer, and a browser, computes the same bits
    extra_compile_args=[
        *("-std=c99", "-O3", "-fno-math-errno", "-ffp-contract=off", "-Wall", "-Wextra"),
    ],
)
