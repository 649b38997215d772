"""``scissorcal export``"""

from pathlib import Path

import click

from scissorcal.cli.output import Answer, command


@click.command("export")
@click.argument("recording", type=click.Path(path_type=Path, dir_okay=False))
@click.argument("table", type=click.Path(path_type=Path, dir_okay=False))
@click.option("--overwrite", is_flag=True, help="Replace TABLE where it stands already.")
@command
def export(recording: Path, table: Path, overwrite: bool) -> Answer:
    """Write RECORDING as TABLE: Parquet or CSV, by its ending. Units stand in the headings.

    \b
    Example:
      $ scissorcal export captures/friction-20261121T131415Z.mcap friction.parquet
      friction.parquet: 24841 rows
      ...
    """
    from scissorcal.recording import export_table, read_recording

    read = read_recording(recording)
    path = export_table(read, table, overwrite=overwrite)
    text = "\n".join(
        [f"{path}: {len(read.samples)} rows", *(f"note: {sentence}" for sentence in read.notes)]
    )
    result = {"table": path, "rows": len(read.samples), "notes": read.notes}
    return Answer(result, text, files=[path])
