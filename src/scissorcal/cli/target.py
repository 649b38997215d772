"""``scissorcal target``"""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from scissorcal.cli.output import Answer, command

if TYPE_CHECKING:
    from scissorcal.vision.targets.sheet import Sheet, SheetName


@command
def target(
    what: Annotated[
        Literal["camera", "blade", "plate", "all"], typer.Argument(help="The sheet to write.")
    ] = "all",
    paper: Annotated[Literal["A4", "Letter"], typer.Option(help="Size of the paper.")] = "A4",
    folder: Annotated[
        Path, typer.Option("--output", file_okay=False, help="Folder to write into.")
    ] = Path(),
) -> Answer:
    """Write the sheets to print, as PDF and PNG: camera board, blade mat, plate and rig markers.

    Print the PDF at 100 %, and check both rulers of the sheet with a steel rule. No two targets
    share a marker, so a photograph shows which target it is of.

    \b
    Example:
      $ scissorcal target blade
      target-blade-A4.pdf, target-blade-A4.png: blade mat (markers 40-69)
      Print at 100 % (actual size); the rulers must be 200.0 mm across and 150.0 mm down.
    """
    from scissorcal.vision.targets.sheet import RULERS_MM, target_sheet, write_target

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
