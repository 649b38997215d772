"""The core and the images of the boards, as several compilers and options build them."""

import os
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parents[2]
FIRMWARE = ROOT / "firmware"
WIRE = ROOT / "src" / "scissorcal" / "kernel" / "c"
SHARED = (
    *("wire", "messages", "model", "release", "fracture"),
    *("edge", "table", "turn", "motion", "near_rest"),
)
"""What the core takes of the host's own sources."""
ZIG = (sys.executable, "-m", "ziglang", "cc")
WARNINGS = ("-Wall", "-Wextra", "-Werror", "-Wconversion", "-Wdouble-promotion", "-pedantic")

HOST_BUILDS: dict[str, tuple[str, ...]] = {
    "gcc, -O0": ("gcc", "-O0"),
    "gcc, -O2": ("gcc", "-O2"),
    "gcc, -O3, this processor's instructions": ("gcc", "-O3", "-march=native"),
    "gcc, 32 bits": ("gcc", "-O2", "-m32", "-msse2", "-mfpmath=sse"),
    "clang, -O2": (*ZIG, "-O2"),
}
"""Compilers and options by the name of a build."""


def make(folder: Path, *targets: str, optimise: str = "-Os") -> None:
    """Run firmware/arm's Makefile; RuntimeError with what it printed if it fails or warns."""
    ran = subprocess.run(
        [
            *(
                "make",
                "--silent",
                f"--jobs={os.cpu_count()}",
                "-C",
                str(FIRMWARE / "arm"),
                f"BUILD={folder}",
            ),
            *(f"PYTHON={sys.executable}", f"OPTIMISE={optimise}", *targets),
        ],
        capture_output=True,
        text=True,
        check=False,
        # not as a part of a make that runs the tests: it would warn of the jobs
        env={name: value for name, value in os.environ.items() if not name.startswith("MAKE")},
    )
    if ran.returncode or ran.stderr:
        raise RuntimeError(ran.stderr[-3000:])


def host_build(name: str, target: Path) -> str | None:
    """Build the posix board for this computer; what the compiler said where it cannot."""
    sources = [
        FIRMWARE / "boards" / "posix.c",
        *sorted((FIRMWARE / "core").glob("*.c")),
        *(WIRE / f"sc_{part}.c" for part in SHARED),
    ]
    includes = [f"-I{folder}" for folder in (FIRMWARE / "core", WIRE)]
    options = ("-std=c99", "-ffp-contract=off", "-D_XOPEN_SOURCE=700", *WARNINGS)
    try:
        ran = subprocess.run(
            [*HOST_BUILDS[name], *options, *includes, "-o", target, *sources, "-lm"],
            capture_output=True,
            text=True,
            check=False,
        )
    except FileNotFoundError as error:
        return str(error)
    return ran.stderr if ran.returncode else None


def run(program: Path, board: bytes, records: list[bytes]) -> bytes:
    """All records that a build answers."""
    ran = subprocess.run(
        [program, "--records"], input=board + b"".join(records), capture_output=True, check=True
    )
    return ran.stdout
