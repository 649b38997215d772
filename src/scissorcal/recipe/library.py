"""Where recipes, specimens and schemas lie.

In an installed wheel that is beside the code; in a checkout, at the top of the repository.
"""

import difflib
from pathlib import Path

from scissorcal.errors import InputError, MissingError
from scissorcal.recipe.load import load_recipe
from scissorcal.recipe.schema import Recipe

_PACKAGE = Path(__file__).resolve().parents[1]


def recipes_dir() -> Path:
    """Return the folder of the recipes that come with scissorcal."""
    return _data_folder("recipes")


def schemas_dir() -> Path:
    """Return the folder of the JSON schemas that come with scissorcal."""
    return _data_folder("data_schemas")


def specimens_dir() -> Path:
    """Return the folder of the specimens: what the virtual rig can put between its blades."""
    return recipes_dir() / "specimens"


def recipe_names() -> tuple[str, ...]:
    """Return the names of the recipes that come with scissorcal, sorted.

    >>> recipe_names()
    ('cotton-cloth', 'paper-80gsm', 'paper-photographed', 'paper-with-hole', 'press-only')
    """
    return _names(recipes_dir())


def recipe_path(name: str) -> Path:
    """Return the file of the recipe called ``name``; InputError naming the others if none is."""
    return _named(recipes_dir(), name, "recipe")


def recipe_file(given: str) -> Path:
    """The file of a recipe that a person named: a built-in one, or a file of any name.

    Raises InputError where it is neither.
    """
    path = Path(given)
    if given in recipe_names() or not (path.suffix == ".toml" or path.exists()):
        return recipe_path(given)
    if path.is_dir():
        raise InputError(f"{path} is a folder, not a recipe. Name the recipe.toml in it.")
    return path


def specimen_path(name: str) -> Path:
    """Return the file of the specimen called ``name``; InputError naming the others if none is."""
    return _named(specimens_dir(), name, "specimen")


def builtin_recipe(name: str) -> Recipe:
    """Load one of the recipes that come with scissorcal."""
    return load_recipe(recipe_path(name))


def _data_folder(name: str) -> Path:
    places = (_PACKAGE / name, _PACKAGE.parents[1] / name)
    for place in places:
        if place.is_dir():
            return place
    raise MissingError(
        f"The folder {name} that belongs to scissorcal is in neither {places[0]} nor {places[1]}: "
        "install scissorcal again."
    )


def _names(folder: Path) -> tuple[str, ...]:
    return tuple(sorted(path.stem for path in folder.glob("*.toml")))


def _named(folder: Path, name: str, what: str) -> Path:
    names = _names(folder)
    if name in names:
        return folder / f"{name}.toml"
    close = difflib.get_close_matches(name, names, 1)
    hint = f' Did you mean "{close[0]}"?' if close else ""
    raise InputError(f'There is no {what} called "{name}"; there are: {", ".join(names)}.{hint}')
