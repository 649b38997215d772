"""A package as an FMU (FMI 3.0 co-simulation): description, sources, and binaries built here."""

import io
import platform
import shutil
import subprocess
import sys
import tempfile
import zipfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path

from scissorcal.kernel.c_text import c_float
from scissorcal.kernel.compiled_step import step_sources
from scissorcal.package.export.c_project import C_FILES
from scissorcal.package.export.draw_tables import DrawTables, draw_tables
from scissorcal.package.export.facts import ExportFacts
from scissorcal.package.export.fmu_description import (
    build_description,
    model_description,
    model_identifier,
    start_values,
    token,
)
from scissorcal.package.export.header import HEADER_FILE, header_text
from scissorcal.package.model_package import ModelPackage

FMI_FILES = Path(__file__).parent / "fmi"
_OWN = ("fmu.c", "fmu_values.c", "fmu_unsupported.c", "fmu.h", "fmi3.h")

_TIMEOUT_s = 300.0
_FLAGS = (
    *("-std=c99", "-O2", "-s", "-shared", "-fvisibility=hidden", "-ffp-contract=off"),
    "-DFMI3_OVERRIDE_FUNCTION_PREFIX",
)
_ZIG_TARGETS = {
    "x86_64-linux": ("x86_64-linux-gnu.2.17", ".so"),
    "aarch64-linux": ("aarch64-linux-gnu.2.17", ".so"),
    "x86_64-windows": ("x86_64-windows-gnu", ".dll"),
}
_EARLIEST = (1980, 1, 1, 0, 0, 0)


@dataclass(frozen=True)
class Fmu:
    """An FMU's bytes, the platforms of its binaries, how many draws, and notes as sentences."""

    data: bytes
    platforms: tuple[str, ...]
    draws: int
    notes: tuple[str, ...]


def build_fmu(package: ModelPackage, facts: ExportFacts) -> Fmu:
    """The FMU of a package, with a binary for each platform that can be compiled for here.

    This computer's by its C compiler (``cc``); the others of x86_64-linux, aarch64-linux and
    x86_64-windows by ziglang, where the extra "page" is installed. An FMU without a binary still
    has its sources, which importers compile; a note says what a compiler said that failed.
    """
    draws = draw_tables(package)
    sources = {path.name: path.read_bytes() for path in step_sources()}
    sources |= {name: (FMI_FILES / name).read_bytes() for name in _OWN}
    sources[HEADER_FILE] = header_text(package, facts).encode()
    sources["scissorcal_fmu.h"] = _data_header(facts, draws).encode()
    compiled = sorted(name for name in sources if name.endswith(".c"))
    binaries, refused = _binaries(sources, compiled)
    identifier = model_identifier(facts)
    files = {"modelDescription.xml": model_description(facts, len(draws.models))}
    files |= {f"sources/{name}": data for name, data in sorted(sources.items())}
    files["sources/buildDescription.xml"] = build_description(facts, compiled)
    for place, (suffix, data) in binaries.items():
        files[f"binaries/{place}/{identifier}{suffix}"] = data
    files["documentation/index.html"] = _page(facts).encode()
    files["documentation/licenses/license.txt"] = (C_FILES / "LICENSE").read_bytes()
    return Fmu(
        _zipped(files), tuple(binaries), len(draws.models) - 1, (*refused, *_notes(binaries, draws))
    )


def _notes(binaries: Mapping[str, object], draws: DrawTables) -> tuple[str, ...]:
    notes = []
    if not binaries:
        notes.append(
            "No C compiler built a binary here, so the FMU has sources only: install one (cc), or "
            "pip install 'scissorcal[page]', or let the importer compile them."
        )
    if draws.limited:
        notes.append(
            f"The response of {draws.limited} of {len(draws.models)} models was held to slopes "
            "with which it never falls between the package's knots."
        )
    return tuple(notes)


def _binaries(
    sources: Mapping[str, bytes], compiled: Sequence[str]
) -> tuple[dict[str, tuple[str, bytes]], list[str]]:
    """Suffix and bytes of a library for each platform, and what a compiler said that failed."""
    here = f"{platform.machine()}-{platform.system().lower()}"
    made: dict[str, tuple[str, bytes]] = {}
    refused = []
    with tempfile.TemporaryDirectory() as build:
        for name, data in sources.items():
            (Path(build) / name).write_bytes(data)
        for place, (target, suffix) in _ZIG_TARGETS.items():
            if place == here and shutil.which("cc"):
                command = ["cc", "-fPIC"]
            elif find_spec("ziglang") is not None:
                command = [sys.executable, "-m", "ziglang", "cc", "-target", target]
                command += [] if suffix == ".dll" else ["-fPIC"]
            else:
                continue
            library = Path(build) / f"{place}{suffix}"
            said = _run([*command, *_FLAGS, "-o", library.name, *compiled, "-lm"], Path(build))
            if said:
                refused.append(
                    f"There is no binary for {place}: {Path(command[0]).name} said {said}"
                )
            else:
                made[place] = (suffix, library.read_bytes())
    return made, refused


def _run(command: list[str], folder: Path) -> str:
    """Run a compiler; what it said where it failed, else nothing."""
    ran = subprocess.run(
        command,
        cwd=folder,
        capture_output=True,
        text=True,
        check=False,
        timeout=_TIMEOUT_s,
        stdin=subprocess.DEVNULL,
    )
    return (ran.stderr + ran.stdout).strip()[-2000:] if ran.returncode else ""


def _data_header(facts: ExportFacts, draws: DrawTables) -> str:
    """scissorcal_fmu.h: what differs between packages besides the model itself."""
    opening, advance = start_values(facts)
    count = len(draws.models)
    lines = [
        "/* Draws and parameters of the FMU, generated by 'scissorcal package export'. */",
        "#ifndef SCISSORCAL_FMU_DATA_H",
        "#define SCISSORCAL_FMU_DATA_H",
        "",
        f"#define FMI3_FUNCTION_PREFIX {model_identifier(facts)}_",
        f'#include "{HEADER_FILE}"',
        "",
        f'#define FMU_TOKEN "{token(facts)}"',
        f"#define FMU_OPENING_START {opening.hex()}",
        f"#define FMU_ADVANCE_START {advance.hex()}",
        f"enum {{ FMU_DRAWS = {count}, FMU_PARAMETERS = {draws.parameters.shape[1]},",
        f"       FMU_RESPONSE_KNOTS = {len(draws.models[0].response.x)} }};",
        "",
        f"static const double FMU_PARAMETER[{count + 1}][{draws.parameters.shape[1]}] = {{",
        *(f"    {{{', '.join(float(v).hex() for v in row)}}}," for row in draws.parameters),
        "};",
    ]
    body = []
    for name in draws.varied:
        tables = [getattr(model, name) for model in draws.models]
        lines.append(f"static const float FMU_{name.upper()}[{count}][2][{len(tables[0].x)}] = {{")
        for table in tables:
            rows = (", ".join(c_float(value) for value in row) for row in (table.y, table.slope))
            lines.append("    {" + ", ".join(f"{{{row}}}" for row in rows) + "},")
        lines.append("};")
        for index, row in enumerate(("y", "slope")):
            body.append(f"    model->{name}.{row} = FMU_{name.upper()}[draw][{index}];")
    numbers = ("fracture_energy", "kappa", "rate_damping")
    lines.append(f"static const float FMU_NUMBERS[{count}][{len(numbers)}] = {{")
    lines += [
        f"    {{{', '.join(c_float(getattr(model, name)) for name in numbers)}}},"
        for model in draws.models
    ]
    lines.append("};")
    body += [f"    model->{name} = FMU_NUMBERS[draw][{i}];" for i, name in enumerate(numbers)]
    head = "static inline void fmu_put_draw(int32_t draw, sc_model *model)"
    return "\n".join([*lines, "", head, "{", *body, "}", "", "#endif", ""])


def _page(facts: ExportFacts) -> str:
    """documentation/index.html."""
    from html import escape

    name = escape(facts.manifest.name)
    stated = [*facts.identity, *facts.covered, *facts.warnings]
    items = "".join(f"<li>{escape(line)}</li>\n" for line in stated)
    return f"""<!doctype html>
<html lang="en"><head><meta charset="utf-8"><title>{name}</title></head><body>
<h1>{name}</h1>
<ul>
{items}</ul>
<p>A step of the importer is one step of the model at the inputs as they were set, held over the
whole step; nothing is interpolated. Computed in float. Torque and force are not limited.</p>
<p>Licence: licenses/license.txt.</p>
</body></html>
"""


def _zipped(files: Mapping[str, bytes]) -> bytes:
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, data in files.items():
            info = zipfile.ZipInfo(name, _EARLIEST)
            info.external_attr = 0o644 << 16
            archive.writestr(info, data, zipfile.ZIP_DEFLATED)
    return buffer.getvalue()
