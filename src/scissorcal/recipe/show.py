"""Every setting of a recipe: as it was given, or the default and what it rests on."""

import json
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

from pydantic import BaseModel

from scissorcal.recipe.explain import key_lines
from scissorcal.recipe.priors import AnyPrior
from scissorcal.recipe.schema import Recipe


@dataclass(frozen=True)
class Setting:
    """One key of a recipe.

    ``table`` are the names of the tables that it stands in, ``value`` is plain (a prior is a
    mapping), None where nothing is set. ``line`` is the line of the file that gives it, None for a
    default; ``origin`` says where the value is from.
    """

    table: tuple[str, ...]
    name: str
    value: Any
    line: int | None
    origin: str

    @property
    def key(self) -> str:
        """The key with its tables, as messages name it."""
        return ".".join((*self.table, self.name))

    @property
    def toml(self) -> str:
        """The key and its value as a statement of TOML; one that sets nothing is a comment."""
        return f"{self.name} = {_toml(self.value)}" if self.value is not None else f"# {self.name}"


def recipe_settings(recipe: Recipe, text: str, *, defaults: bool = True) -> tuple[Setting, ...]:
    """Settings of ``recipe``, which was read from ``text``, in the order of the schema.

    ``defaults`` lists those too that the file does not give.
    """
    keys = list(_walk(recipe, ()))
    lines = key_lines(text, [(*table, name) for table, name, _, _, _ in keys])
    settings = []
    for (table, name, value, given, why), line in zip(keys, lines, strict=True):
        if given:
            settings.append(Setting(table, name, value, line, f"recipe, line {line}"))
        elif defaults:
            settings.append(
                Setting(table, name, value, None, f"default: {why}" if why else "default")
            )
    return tuple(settings)


def as_toml(settings: tuple[Setting, ...]) -> str:
    """The settings as a recipe with the same meaning; comments say where each value is from."""
    lines: list[str] = []
    table: tuple[str, ...] = ()
    for setting in settings:
        if setting.table != table:
            table = setting.table
            lines += ["", f"[{'.'.join(table)}]"]
        lines.append(f"{setting.toml}  # {setting.origin}")
    return "\n".join(lines) + "\n"


def with_designed_captures(recipe: Recipe, text: str) -> str:
    """``recipe``, which was read from ``text`` and got a designed list of captures, as TOML.

    Comments say on which line of ``text`` a value stands, or that it was designed.
    """
    plan = recipe.capture.model_copy(update={"plan": "designed"})
    planned = recipe.model_copy(update={"capture": plan})
    settings = recipe_settings(planned, text, defaults=False)
    return as_toml(
        tuple(
            replace(setting, origin="designed") if setting.table[:1] == ("capture",) else setting
            for setting in settings
        )
    )


def _walk(
    model: BaseModel, table: tuple[str, ...], given: bool = True
) -> Iterator[tuple[tuple[str, ...], str, Any, bool, str]]:
    """Table, name, value, whether it was given, and why the default: keys first, then tables."""
    inner = []
    for name, field in type(model).model_fields.items():
        value = getattr(model, name)
        stated = given and name in model.model_fields_set
        # a prior is written in one line, as one setting
        if isinstance(value, BaseModel) and not isinstance(value, AnyPrior):
            inner.append((name, value, stated))
            continue
        plain = value.model_dump() if isinstance(value, BaseModel) else value
        if isinstance(value, tuple) and value and isinstance(value[0], BaseModel):
            plain = [one.model_dump(exclude_none=True, exclude_unset=True) for one in value]
        yield table, name, plain, stated, field.description or ""
    for name, value, stated in inner:
        yield from _walk(value, (*table, name), stated)


def _toml(value: Any) -> str:
    """A value of a recipe as TOML."""
    if isinstance(value, dict):
        return "{ " + ", ".join(f"{key} = {_toml(item)}" for key, item in value.items()) + " }"
    if isinstance(value, (list, tuple)):
        return "[" + ", ".join(_toml(item) for item in value) + "]"
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str):
        return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
    return repr(value)
