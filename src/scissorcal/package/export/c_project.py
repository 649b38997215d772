"""A package as a C project: the step's sources, its tables, a program, CMake and pkg-config."""

from collections.abc import Mapping
from pathlib import Path
from string import Template

from scissorcal.errors import InputError
from scissorcal.files import replacing
from scissorcal.kernel.compiled_step import c_sources, step_sources
from scissorcal.package.export.facts import ExportFacts
from scissorcal.package.export.header import HEADER_FILE, header_text
from scissorcal.package.model_package import ModelPackage

C_FILES = Path(__file__).parent / "c_files"
PROGRAM_FILES = ("main.c", "CMakeLists.txt", "scissorcal-model.pc.in", "LICENSE")
FREESTANDING = ("math.h", "string.h", "library.c")


def c_project(package: ModelPackage, facts: ExportFacts) -> dict[str, bytes]:
    """The files of the project by their name in its folder."""
    files = {path.name: path.read_bytes() for path in step_sources()}
    files |= {name: (C_FILES / name).read_bytes() for name in PROGRAM_FILES}
    for name in FREESTANDING:
        files[f"freestanding/{name}"] = (c_sources() / "freestanding" / name).read_bytes()
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
    text = (C_FILES / "README.template").read_text(encoding="utf-8")
    return Template(text).substitute(
        name=facts.manifest.name,
        identity=_list(facts.identity),
        covered=_list(facts.covered),
        size=_list(facts.size),
        warnings=_list(facts.warnings or ("none",)),
    )


def _list(lines: tuple[str, ...]) -> str:
    return "\n".join(f"- {line}" for line in lines)
