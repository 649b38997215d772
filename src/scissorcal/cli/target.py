"""``scissorcal target``"""

from pathlib import Path
from typing import TYPE_CHECKING, Literal

import click

from scissorcal.cli.output import Answer, command

if TYPE_CHECKING:
    from scissorcal.vision.targets.sheet import Paper, Sheet, SheetName


@click.command("target")
@click.argument("what", type=click.Choice(["camera", "blade", "plate", "all"]), default="all")
@click.option("--paper", type=click.Choice(["A4", "Letter"]), default="A4", show_default=True)
@click.option(
    "--output",
    "folder",
    type=click.Path(path_type=Path, file_okay=False),
    default=Path(),
    help="Folder to write into; where you stand if not given.",
)
@command
def target(
    what: 'SheetName | Literal["all"]',
    paper: "Paper",
    folder: Path,
) -> Answer:
    """Write the sheets to print, as PDF and PNG: camera board, blade mat, plate and rig markers.

    Print the PDF at 100 %, and lay a steel rule along both rulers of the sheet. Each target has
    markers of its own, so a photograph tells which one it shows.

    \b
    Example:
      $ scissorcal target blade
      target-blade-A4.pdf, target-blade-A4.png: blade mat (markers 40-69)
      Print at 100 % (actual size); the rulers must be 200.0 mm across and 150.0 mm down.
    """
    from scissorcal.vision.targets.sheet import RULERS_MM, target_sheet
    from scissorcal.vision.targets.sheet_files import write_target

    names: tuple[SheetName, ...] = ("camera", "blade", "plate") if what == "all" else (what,)
    written: list[Path] = []
    lines = []
    for name in names:
        sheet = target_sheet(name, paper)
        paths = write_target(sheet, folder)
        written += paths
        lines.append(f"{', '.join(map(str, paths))}: {_on(sheet)}")
    lines.append(
        f"Print at 100 % (actual size); the rulers must be {RULERS_MM[0]:.1f} mm across and "
        f"{RULERS_MM[1]:.1f} mm down."
    )
    result = {"paper": paper, "rulers_mm": RULERS_MM, "targets": list(names)}
    return Answer(result, "\n".join(lines), files=written)


def _on(sheet: "Sheet") -> str:
    return ", ".join(
        f"{board.name} (markers {board.ids[0]}-{board.ids[-1]})" for board, _, _ in sheet.boards
    )
