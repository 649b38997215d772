"""A package as a C project: the step's sources, its tables, a program, CMake and pkg-config."""

from collections.abc import Mapping
from pathlib import Path

from scissorcal.errors import InputError
from scissorcal.files import replacing
from scissorcal.kernel.compiled_step import step_sources
from scissorcal.package.export.facts import ExportFacts
from scissorcal.package.export.header import HEADER_FILE, header_text
from scissorcal.package.model_package import ModelPackage

C_FILES = Path(__file__).parent / "c_files"
PROGRAM_FILES = ("main.c", "CMakeLists.txt", "scissorcal-model.pc.in", "LICENSE")
FREESTANDING = ("math.h", "string.h", "string.c")


def c_project(package: ModelPackage, facts: ExportFacts) -> dict[str, bytes]:
    """The files of the project by their name in its folder."""
    files = {path.name: path.read_bytes() for path in step_sources()}
    files |= {name: (C_FILES / name).read_bytes() for name in PROGRAM_FILES}
    for name in FREESTANDING:
        files[f"freestanding/{name}"] = (C_FILES / "freestanding" / name).read_bytes()
    files[HEADER_FILE] = header_text(package, facts).encode()
    files["README.md"] = _readme(facts).encode()
    return files


def write_files(folder: Path, files: Mapping[str, bytes], *, overwrite: bool) -> list[Path]:
    """Write files into a folder, each whole or not at all; other files there stay.

    Raises InputError where the folder has something in it, unless ``overwrite``.
    """
    if folder.is_file() or (folder.is_dir() and any(folder.iterdir()) and not overwrite):
        raise InputError(f"{folder} already exists: name another folder, or give --overwrite.")
    for name, data in files.items():
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        with replacing(path) as part:
            part.write_bytes(data)
    return [folder / name for name in files]


def _readme(facts: ExportFacts) -> str:
    manifest = facts.manifest
    warnings = [f"- {sentence}" for sentence in facts.warnings] or ["None."]
    return f"""# {manifest.name}: a fitted model of cutting in C

One step from opening (rad), rate (rad/s) and advance (m) to torque (N m), force along the cut (N) and
the crack's tip (m), in float, without allocation and without a state but the caller's.

{_list(facts.identity)}

## Build

    cmake -B build && cmake --build build && build/stroke

or without CMake:

    cc -std=c99 -O2 -ffp-contract=off -o stroke main.c sc_*.c -lm

`-ffp-contract=off` keeps the compiler from contracting products and sums; then the step gives on any
processor the bits that scissorcal's own kernel gives. `build/stroke` prints a closing stroke, `build/stroke -`
a step for each line "opening rate advance" that it reads. `cmake --install build` installs the library, its headers
and a pkg-config file, scissorcal-model. A compiler without a C library takes `-Ifreestanding -fno-builtin` and
`freestanding/string.c` besides.

## Use

    #include "scissorcal_package.h"
    sc_crack crack = {{0}};                  /* a fresh sheet; one for each cut */
    sc_step_output out;
    sc_model_step(&scissorcal_package, &crack, opening, rate, advance, &out);

Torque on the pivot opens the blades where it is positive. Hold torque and force, and how fast they change, within the
limits of the header: the step does not. Flags of a step stand in `sc_model.h`; an input that is not finite gives zero
torque and `SC_STEP_INVALID`.

## Valid

{_list(facts.covered)}

Outside these ranges a step has no stated error, and is flagged `SC_STEP_OUT_OF_RANGE` for opening and contact.

## Size

{_list(facts.size)}

## Warnings

{chr(10).join(warnings)}

## Licence

BSD-3-Clause, see LICENSE: for these sources. The tables are data of whoever fitted them.
"""


def _list(lines: tuple[str, ...]) -> str:
    return "\n".join(f"- {line}" for line in lines)
