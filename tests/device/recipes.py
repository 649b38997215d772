"""Recipes of the library, with some keys changed; and short ones, for captures in tests."""

from scissorcal.recipe import Recipe, builtin_recipe


def changed(name: str, **tables: dict[str, object]) -> Recipe:
    """Return a recipe of the library with some keys changed, table by table ("rig__edge")."""
    plain = builtin_recipe(name).model_dump()
    for table, keys in tables.items():
        place = plain
        for part in table.split("__"):
            place = place[part]
        place.update(keys)
    return Recipe.model_validate(plain)


def short(name: str, sheets: int = 1) -> Recipe:
    """Return a recipe whose captures take a few seconds."""
    return changed(
        name,
        capture__friction={
            "speeds_rad_per_s": (0.7, 1.5),
            "repeats": 1,
            "excitation_s": 1.0,
        },
        capture__cut={"speeds_rad_per_s": (0.4, 0.8), "strokes_per_sheet": 2, "sheets": sheets},
    )
