"""Options that several commands share."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import click

Decorator = Callable[[Callable[..., Any]], Callable[..., Any]]

workspace_option: Decorator = click.option(
    "--workspace",
    "-w",
    "folder",
    type=click.Path(path_type=Path, file_okay=False),
    default=None,
    help="The workspace, or a folder in it; where you stand if not given.",
)

seed_option: Decorator = click.option(
    "--seed",
    type=click.IntRange(min=0),
    default=0,
    show_default=True,
    help="Seed of everything random, so that a run can be repeated.",
)

device_option: Decorator = click.option(
    "--device",
    required=True,
    metavar="PORT|sim",
    help='Serial port of the rig, such as /dev/ttyUSB0, or "sim" for a virtual one.',
)

yes_option: Decorator = click.option(
    "--yes", is_flag=True, help="Ask nobody: blades are clear, or material is loaded."
)


def images_option(of_what: str) -> Decorator:
    """``--image``, which may be given many times, for photographs of something."""
    return click.option(
        "--image",
        "-i",
        "images",
        type=click.Path(path_type=Path),
        multiple=True,
        help=f"A photograph of {of_what}; give it again for each.",
    )
