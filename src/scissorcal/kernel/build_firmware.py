"""Builds the firmware's core into ``scissorcal.kernel._firmware`` (cffi); setup.py names it.

The same sources that a board compiles: `firmware/core` at the top of the repository, the wire, and
what a step of the model takes.
"""

import sys
from pathlib import Path

from cffi import FFI

CORE = Path("firmware/core")  # relative: setuptools refuses absolute source paths
C = Path("src/scissorcal/kernel/c")
WIRE = ("sc_messages", "sc_wire")
STEP = ("sc_table", "sc_turn", "sc_edge", "sc_model", "sc_motion", "sc_near_rest")
UNDECLARED = ("sc_fracture", "sc_release")
HEADERS = (
    *(C / f"{name}.h" for name in (*WIRE, *STEP)),
    *(CORE / f"fw_{name}.h" for name in ("image", "render", "board", "core", "record")),
)


def declarations() -> str:
    """Give the headers' declarations without preprocessor lines, in order of dependence."""
    text = "\n".join(header.read_text(encoding="utf-8") for header in HEADERS)
    return "\n".join(line for line in text.splitlines() if not line.startswith("#"))


builder = FFI()
builder.cdef(declarations())
builder.set_source(
    "scissorcal.kernel._firmware",
    '#include "fw_record.h"',
    sources=[
        *(str(source) for source in sorted(CORE.glob("*.c"))),
        *(str(C / f"{name}.c") for name in (*WIRE, *STEP, *UNDECLARED)),
    ],
    depends=[str(header) for folder in (CORE, C) for header in sorted(folder.glob("*.h"))],
    include_dirs=[str(CORE), str(C)],
    libraries=[] if sys.platform == "win32" else ["m"],  # there it is part of the C library
    # without contraction every build of the core computes the same bits
    extra_compile_args=["-std=c99", "-O2", "-ffp-contract=off", "-Wall", "-Wextra"],
)
