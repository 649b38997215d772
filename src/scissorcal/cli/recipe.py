"""``scissorcal recipe``"""

from typing import Annotated

import typer

from scissorcal.cli.lazy import group
from scissorcal.cli.options import Folder
from scissorcal.cli.output import Answer, command

_COMMANDS = {
    "show": ("scissorcal.cli.recipe:show", "Settings and priors; with --defaults, all of them."),
}


@group(_COMMANDS)
def recipe() -> None:
    """Look into recipes.

    \b
    Example:
      $ scissorcal recipe show --defaults
      format = "scissorcal-recipe/1"  # recipe, line 4
      ...
    """


@command
def show(
    name: Annotated[str | None, typer.Argument(help="A built-in recipe, or a .toml file.")] = None,
    defaults: Annotated[
        bool, typer.Option("--defaults", help="Show every setting, defaults among them.")
    ] = False,
    folder: Folder = None,
) -> Answer:
    """Show the settings of a recipe, and where each value is from.

    NAME is a built-in recipe or a .toml file; the workspace's recipe if not given. The output is a
    recipe with the same meaning.

    \b
    Example:
      $ scissorcal recipe show paper-80gsm --defaults
      format = "scissorcal-recipe/1"  # recipe, line 4
      ...
      [fit.friction.priors.rotary]
      ...
    """
    from scissorcal.recipe.load import (
        as_toml,
        parse_recipe,
        read_text,
        recipe_file,
        recipe_settings,
    )
    from scissorcal.workday.workspace import find_workspace

    path = find_workspace(folder).recipe_path if name is None else recipe_file(name)
    text = read_text(path)
    found = parse_recipe(text, str(path))
    settings = recipe_settings(found, text, defaults=defaults)
    rows = [
        {"key": one.key, "value": one.value, "given": one.line is not None, "origin": one.origin}
        for one in settings
    ]
    return Answer(
        {"recipe": found.name, "path": path, "settings": rows}, as_toml(settings).rstrip()
    )
