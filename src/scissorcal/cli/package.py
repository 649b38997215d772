"""``scissorcal package``"""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from scissorcal.cli.lazy import group
from scissorcal.cli.opening import open_workspace, writes_in
from scissorcal.cli.options import Folder, Seed, TrustedKey
from scissorcal.cli.output import Answer, command
from scissorcal.cli.report import SigningKey, signer_of

if TYPE_CHECKING:
    from scissorcal.package import Manifest

_COMMANDS = {
    "build": ("scissorcal.cli.package:build", "Compile the fits into tables with an error bound."),
    "export": ("scissorcal.cli.package:export", "Write the package as a page that runs anywhere."),
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

    if path is None:
        workspace = open_workspace(folder)
        path = workspace.package_path(workspace.recipe())
    trusted = read_public_keys(trusted_key) if trusted_key else None
    package = open_package(path, warn=False)
    manifest = package.manifest
    return Answer(
        _facts(manifest), f"{path}: {_contents(manifest)}", check_package(package, trusted)
    )


@command
def export(
    html: Annotated[
        Path,
        typer.Option("--html", metavar="FILE", dir_okay=False, help="The page to write (.html)."),
    ],
    package_path: Annotated[
        Path | None,
        typer.Option("--package", help="The package to show; the workspace's if not given."),
    ] = None,
    overwrite: Annotated[
        bool, typer.Option("--overwrite", help="Replace FILE if it exists.")
    ] = False,
    folder: Folder = None,
) -> Answer:
    """Write the package and the C core, compiled to WebAssembly, as one page.

    It runs in any browser, from a disk or a web server, and fetches nothing. It computes what the
    rig's loop computes.

    \b
    Example:
      $ scissorcal package export --html paper.html
      paper.html: 0.9 MB; open it in a browser, it needs no server and no network
    """
    from scissorcal.workday.runs.prototype import export_page

    size = export_page(open_workspace(folder), html, package_path, overwrite=overwrite)
    text = f"{html}: {size / 1e6:.2g} MB; open it in a browser, it needs no server and no network"
    return Answer({"page": html, "bytes": size}, text, files=[html])


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
