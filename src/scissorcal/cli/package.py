"""``scissorcal package``"""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from scissorcal.cli.lazy import group
from scissorcal.cli.opening import open_workspace, writes_in
from scissorcal.cli.options import Folder, Seed, TrustedKey, options_of
from scissorcal.cli.output import Answer, command
from scissorcal.cli.report import SigningKey, signer_of
from scissorcal.errors import InputError
from scissorcal.workday.options import ExportOptions

if TYPE_CHECKING:
    from scissorcal.package import Manifest
    from scissorcal.verdicts import Verdict

_COMMANDS = {
    "build": ("scissorcal.cli.package:build", "Compile the fits into tables with an error bound."),
    "export": (
        "scissorcal.cli.package:export",
        "Write the package as a page, C sources, a header or an FMU.",
    ),
    "check": ("scissorcal.cli.package:check", "Hold a package to what it states."),
}


@group(_COMMANDS)
def package() -> None:
    """Build, check or show the model package, the one file that a rig renders.

    \b
    Example:
      $ scissorcal package build
      package/paper-photographed.zip: 6 tables, 200 draws, error bound 0.00055 N m (proved: 0.00039)
      ...
    """


@command
def build(
    force: Annotated[
        bool, typer.Option("--force", help="Build again even where nothing changed.")
    ] = False,
    allow_failed: Annotated[
        bool,
        typer.Option(
            "--allow-failed",
            help="Build from a fit that failed a check; the package warns on every use.",
        ),
    ] = False,
    key: SigningKey = None,
    seed: Seed = 0,
    folder: Folder = None,
) -> Answer:
    """Compile the workspace's fits into package/<recipe>.zip, and check it.

    A fit that failed a check is refused, with the command that may clear it. With --key its
    content and review are signed, which --trusted-key of 'package check' and 'render' asks for.

    \b
    Example:
      $ scissorcal package build
      package/paper-photographed.zip: 6 tables, 200 draws, error bound 0.00055 N m (proved: 0.00039)
      ...
    """
    from scissorcal.package.signature import signer_words
    from scissorcal.workday.engine import Engine
    from scissorcal.workday.runs.package import build_workspace_package

    with writes_in(folder, "scissorcal package build") as workspace:
        built = build_workspace_package(
            Engine.of(workspace),
            seed=seed,
            force=force,
            allow_failed=allow_failed,
            sign=signer_of(key),
        )
    head = f"{workspace.relative(built.path)}: {_contents(built.manifest)}"
    if built.manifest.signature:
        head += f"\n{signer_words(built.manifest)}"
    if built.cached:
        head += "\nnothing changed since it was built, so it is as it was"
    said = built.choice.sentences if built.choice else ()
    text = "\n".join([head, *said, *(f"note: {warning}" for warning in built.warnings)])
    result = {
        **_facts(built.manifest),
        "cached": built.cached,
        "warnings": built.warnings,
        "scene_choice": built.choice.model_dump() if built.choice else None,
    }
    files = [] if built.cached else [built.path]
    return Answer(result, text, built.verdicts, files)


@command
def check(
    path: Annotated[
        Path | None, typer.Argument(help="The package; the workspace's if not given.")
    ] = None,
    trusted_key: TrustedKey = None,
    folder: Folder = None,
) -> Answer:
    """Check a package: bytes, error bound, extremes, fits, review, signature.

    That of the workspace is also held to its fits: a package of earlier ones fails.

    A review names who signed and every file that was reviewed. Without a key anyone can write one,
    and the whole package; --trusted-key demands that keys that you know signed both.

    \b
    Example:
      $ scissorcal package check package/paper-photographed.zip
      package/paper-photographed.zip: 6 tables, 200 draws, error bound 0.00055 N m (proved: 0.00039)
      ...
    """
    from scissorcal.package import check_package, open_package
    from scissorcal.package.keys import read_public_keys

    current: tuple[Verdict, ...] = ()
    if path is None:
        from scissorcal.workday.engine import Engine
        from scissorcal.workday.runs.package import current_verdict

        workspace = open_workspace(folder)
        path = workspace.package_path(workspace.recipe())
        current = (current_verdict(Engine.of(workspace)),) if path.is_file() else ()
    trusted = read_public_keys(trusted_key) if trusted_key else None
    package = open_package(path, warn=False)
    manifest = package.manifest
    return Answer(
        _facts(manifest),
        f"{path}: {_contents(manifest)}",
        (*check_package(package, trusted), *current),
    )


_EXPORT = {
    "html": typer.Option(metavar="FILE", dir_okay=False, help="The page to write (.html)."),
    "c": typer.Option(
        "--c", metavar="DIR", file_okay=False, help="The folder of C sources to write."
    ),
    "header": typer.Option(
        metavar="FILE", dir_okay=False, help="The C header of tables to write (.h)."
    ),
    "fmu": typer.Option(metavar="FILE", dir_okay=False, help="The FMU to write (.fmu)."),
    "package": typer.Option(help="The package to export; the workspace's if not given."),
    "overwrite": typer.Option("--overwrite", help="Replace what exists."),
}


@command
@options_of(_EXPORT)
def export(options: ExportOptions, folder: Folder = None) -> Answer:
    """Write the package as a page, C sources, a header or an FMU, which need no Python.

    \b
    --html    a page for any browser, which fetches nothing
    --c       sources of the step, the tables, a program, CMake, pkg-config and README
    --header  the tables and the model as constants, for a microcontroller with those sources
    --fmu     FMI 3.0 co-simulation, for Simulink, OpenModelica or Python

    All compute what the rig's loop computes, bit for bit.

    \b
    Example:
      $ scissorcal package export --html paper.html
      paper.html: 0.9 MB; open it in a browser, it needs no server and no network
      $ scissorcal package export --c paper-c --fmu paper.fmu
      paper-c: 21 files, 70 kB; tables 340 bytes, error bound 6.8e-05 N m, not signed
      paper.fmu: 172 kB, binaries for x86_64-linux; 200 draws, error bound 6.8e-05 N m, not signed
    """
    answers = []
    html = options.html
    if html is not None:
        from scissorcal.workday.runs.prototype import export_page

        size = export_page(
            open_workspace(folder), html, options.package, overwrite=options.overwrite
        )
        text = (
            f"{html}: {size / 1e6:.2g} MB; open it in a browser, it needs no server and no network"
        )
        answers.append(Answer({"page": html, "bytes": size}, text, files=[html]))
    if options.c or options.header or options.fmu:
        from scissorcal.workday.runs.package import built_package

        path = options.package or built_package(open_workspace(folder), "export")
        answers.append(_export_step(path, options))
    if not answers:
        raise InputError(
            "Nothing to export: give --html FILE, --c DIR, --header FILE or --fmu FILE."
        )
    return Answer(
        {key: value for answer in answers for key, value in answer.result.items()},
        "\n".join(answer.text for answer in answers),
        files=[file for answer in answers for file in answer.files],
    )


def _export_step(package_path: Path, options: ExportOptions) -> Answer:
    """The model's step in C and as an FMU."""
    from scissorcal.package import open_package
    from scissorcal.package.export import export_facts, write_c, write_fmu, write_header

    package = open_package(package_path, warn=False)
    c, header, fmu, overwrite = options.c, options.header, options.fmu, options.overwrite
    facts = export_facts(package)
    result: dict[str, object] = {"package": facts.result}
    lines, files, notes = [], [], list(facts.warnings)
    tables = f"tables {facts.table_bytes} bytes"
    stated = f"error bound {facts.manifest.bound.stated_Nm:.2g} N m, {facts.signature}"
    if c is not None:
        written = write_c(package, facts, c, overwrite=overwrite)
        size = sum(file.stat().st_size for file in written)
        lines.append(f"{c}: {len(written)} files, {size / 1e3:.3g} kB; {tables}, {stated}")
        result["c"] = {"folder": c, "files": len(written), "bytes": size}
        files += written
    if header is not None:
        size = write_header(package, facts, header, overwrite=overwrite)
        lines.append(
            f"{header}: {tables}, model {facts.model_bytes} bytes, {stated}; {facts.instructions}"
        )
        result["header"] = {"file": header, "bytes": size}
        files.append(header)
    if fmu is not None:
        made = write_fmu(package, facts, fmu, overwrite=overwrite)
        size, where = len(made.data), ", ".join(made.platforms) or "no platform"
        held = f"binaries for {where}; {made.draws} draws"
        lines.append(f"{fmu}: {size / 1e3:.3g} kB, {held}, {stated}")
        result["fmu"] = {
            "file": fmu,
            "bytes": size,
            "platforms": made.platforms,
            "draws": made.draws,
            "notes": made.notes,
        }
        files.append(fmu)
        notes += made.notes
    lines += [f"note: {sentence}" for sentence in notes]
    return Answer(result, "\n".join(lines), files=files)


def _contents(manifest: "Manifest") -> str:
    tables = [member for member in manifest.members if member.file.startswith("tables/")]
    draws = max(
        (member.shape[0] for member in manifest.members if member.file.startswith("draws/")),
        default=0,
    )
    bound, proved = manifest.bound.stated_Nm, manifest.bound.proved_Nm
    said = f"{len(tables)} tables, {draws} draws, error bound {bound:.2g} N m"
    return said if proved is None else f"{said} (proved: {proved:.2g})"


def _facts(manifest: "Manifest") -> dict[str, object]:
    return {
        "name": manifest.name,
        "content_hash": manifest.content_hash,
        "signed_by": manifest.signature.fingerprint if manifest.signature else None,
        "inputs_hash": manifest.provenance.inputs_hash,
        "bound": manifest.bound.model_dump(),
        "ranges": manifest.ranges.model_dump(),
        "bytes": sum(member.bytes for member in manifest.members),
    }
