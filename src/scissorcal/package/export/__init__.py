"""A package for other engines: C sources, a header for a microcontroller, an FMU."""

from pathlib import Path

from scissorcal.errors import InputError
from scissorcal.files import replacing
from scissorcal.package.export.c_project import c_project, write_files
from scissorcal.package.export.facts import ExportFacts, export_facts
from scissorcal.package.export.fmu import Fmu, build_fmu
from scissorcal.package.export.header import header_text
from scissorcal.package.model_package import ModelPackage

__all__ = ["ExportFacts", "Fmu", "export_facts", "write_c", "write_fmu", "write_header"]


def write_c(
    package: ModelPackage, facts: ExportFacts, folder: Path, *, overwrite: bool = False
) -> list[Path]:
    """Write a C project of the package's step; gives its files.

    Raises InputError where the folder has something in it, unless ``overwrite``.
    """
    return write_files(folder, c_project(package, facts), overwrite=overwrite)


def write_header(
    package: ModelPackage, facts: ExportFacts, path: Path, *, overwrite: bool = False
) -> int:
    """Write the package's tables and model as one C header; gives its bytes.

    Raises InputError where the file is there already, unless ``overwrite``, or does not end in .h.
    """
    _refuse(path, ".h", "no compiler would take it as a header", overwrite=overwrite)
    return _write(path, header_text(package, facts).encode())


def write_fmu(
    package: ModelPackage, facts: ExportFacts, path: Path, *, overwrite: bool = False
) -> Fmu:
    """Write the package as an FMU. Raises InputError as `write_header` does, for .fmu."""
    _refuse(path, ".fmu", "no simulator would take it as an FMU", overwrite=overwrite)
    fmu = build_fmu(package, facts)
    _write(path, fmu.data)
    return fmu


def _refuse(path: Path, suffix: str, why: str, *, overwrite: bool) -> None:
    if path.suffix.lower() != suffix:
        raise InputError(f"{path}: {why}; name a file that ends in {suffix}.")
    if path.is_dir() or (path.exists() and not overwrite):
        raise InputError(f"{path} already exists: name another file, or give --overwrite.")


def _write(path: Path, data: bytes) -> int:
    with replacing(path) as part:
        part.write_bytes(data)
    return len(data)
