"""A group of commands that imports each command only when it runs."""

from collections.abc import Callable, Mapping
from importlib import import_module
from typing import Any, ClassVar

import typer
from typer.core import TyperCommand, TyperGroup

from scissorcal.errors import InputError

Commands = Mapping[str, tuple[str, str]]
"""Name of a command -> where it stands (``module:attribute``) and one line of help."""


class LazyGroup(TyperGroup):
    """A group that knows its commands by name and one line of help until one of them runs.

    Help, completion and suggestions for mistyped names read the lines; only the command that runs
    is imported.
    """

    lazy: ClassVar[Commands] = {}

    def __init__(self, **settings: Any) -> None:
        super().__init__(**settings)
        self.commands = {
            name: TyperCommand(name, help=line, rich_markup_mode=None)
            for name, (_, line) in self.lazy.items()
        }

    def load(self, name: str) -> Any:
        """Import the command ``name``: a function made by `command`, or another `group`."""
        module, _, attribute = self.lazy[name][0].partition(":")
        found = getattr(import_module(module), attribute)
        if isinstance(found, typer.Typer):
            return typer.main.get_command(found)
        app = typer.Typer(rich_markup_mode=None, add_completion=False)
        app.command(name)(found)
        return typer.main.get_command(app)

    def resolve_command(self, ctx: Any, args: list[str]) -> tuple[str | None, Any, list[str]]:
        """Load the command that ``args`` name.

        Raises InputError where options of a group that is a command, too, stand in front of a
        subcommand: they would be lost.
        """
        own = (option for option in self.params if option.name in ctx.params)
        given = any(ctx.params[option.name] != option.get_default(ctx) for option in own)
        if given and self.invoke_without_command:
            raise InputError("Give the options after the subcommand, not in front of it.")
        name, _, rest = super().resolve_command(ctx, args)
        return name, self.load(name) if name else None, rest


def group(
    commands: Commands, runs_alone: bool = False, **settings: Any
) -> Callable[[Callable[..., None]], typer.Typer]:
    """Make a group of ``commands``, described by the docstring of the decorated function.

    ``runs_alone``: the function is also a command, which runs where no subcommand is given.
    Other ``settings`` go to `typer.Typer`.
    """

    def decorate(function: Callable[..., None]) -> typer.Typer:
        name = function.__name__
        return typer.Typer(
            name=name,
            cls=type(name, (LazyGroup,), {"lazy": commands}),
            callback=function,
            invoke_without_command=runs_alone,
            no_args_is_help=not runs_alone,
            rich_markup_mode=None,
            **{"add_completion": False, **settings},
        )

    return decorate
