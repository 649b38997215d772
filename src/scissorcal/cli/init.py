"""``scissorcal init``"""

from pathlib import Path
from typing import Annotated

import typer

from scissorcal.cli.output import Answer, command, works_in


@command
def init(
    folder: Annotated[Path, typer.Argument(file_okay=False, help="The new workspace.")],
    recipe: Annotated[
        str,
        typer.Option(
            help="A built-in recipe (paper-80gsm, paper-photographed, paper-with-hole, "
            "cotton-cloth, press-only), or a recipe file (.toml)."
        ),
    ] = "paper-80gsm",
) -> Answer:
    """Start a workspace in FOLDER from a recipe.

    The recipe is copied to FOLDER/recipe.toml, to be edited: your rig, your material, your scene.
    A drawing of its plate (.svg) is copied with it.

    \b
    Example:
      $ scissorcal init my-paper --recipe paper-80gsm
      my-paper is a workspace for paper-80gsm (Office paper, 80 g/m^2, cut with office scissors.)
      Edit my-paper/recipe.toml, then go there: cd my-paper
      next: scissorcal plan
    """
    from scissorcal.workday.workspace import create_workspace

    workspace = create_workspace(folder, recipe)
    works_in(workspace)
    loaded = workspace.recipe()
    drawn = [workspace.root / name for name in loaded.plate.drawings]
    text = (
        f"{folder} is a workspace for {loaded.name} ({loaded.description})\n"
        f"Edit {folder / workspace.recipe_path.name}, then go there: cd {folder}\n"
        "next: scissorcal plan"
    )
    if drawn:
        names = ", ".join(path.name for path in drawn)
        text = text.replace("\nEdit ", f"\nIts plate is drawn in {names}.\nEdit ", 1)
    result = {"workspace": workspace.root, "recipe": loaded.name}
    return Answer(result, text, files=[workspace.recipe_path, *drawn])
