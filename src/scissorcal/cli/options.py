"""Options that several commands share, and dataclasses of options as parameters of a command."""

import inspect
from collections.abc import Callable, Mapping
from dataclasses import MISSING, fields, is_dataclass
from pathlib import Path
from typing import Annotated, Any, Literal, TypeVar, get_type_hints

import typer

Function = TypeVar("Function", bound=Callable[..., Any])

Folder = Annotated[
    Path | None,
    typer.Option(
        "--workspace",
        "-w",
        file_okay=False,
        help="The workspace, or a folder in it; the current folder if not given.",
    ),
]

RIG = {
    "device": typer.Option(
        "--device",
        metavar="PORT|sim",
        help='Serial port of the rig, such as /dev/ttyUSB0, or "sim" for a virtual rig.',
    ),
    "seed": typer.Option(
        "--seed",
        min=0,
        help="Seed of all random numbers. A further capture of one seed in a workspace has other "
        "noise.",
    ),
    "baud": typer.Option(
        "--baud", min=9600, max=12_000_000, help="Baud rate, if not the recipe's."
    ),
    "realtime": typer.Option(
        "--realtime",
        help="Serve the virtual rig on a pseudo-terminal, in real time; otherwise --device sim "
        "runs in virtual time.",
    ),
}
"""Options of a rig that is opened: `RigOptions`."""

Device = Annotated[str, RIG["device"]]
Seed = Annotated[int, RIG["seed"]]
Baud = Annotated[int | None, RIG["baud"]]

Yes = Annotated[
    bool,
    typer.Option("--yes", help="Ask no questions: the blades are clear, or material is loaded."),
]

TRUSTED_KEY = typer.Option(
    metavar="FILE",
    help="Public keys (OpenSSH, one a line) that must have signed the package and its review.",
)
TrustedKey = Annotated[Path | None, TRUSTED_KEY]

Axis = Annotated[
    Literal["opening", "advance"],
    typer.Option(
        "--axis",
        help="Whose friction: that of the blades' opening, or that of the carriage along the cut.",
    ),
]


PLATE_CAMERA = typer.Option(
    "--camera",
    metavar="NUMBER|sim|none",
    help="A camera by its number that follows the plate while it runs, sim: a rendered plate "
    "(with --device sim), or none.",
)
NO_RECORD = typer.Option("--no-record", help="Keep no recording.")


def positive(value: float | None) -> float | None:
    """Accept a number above zero, or none; for options of which 0 makes no sense."""
    if value is not None and not value > 0.0:
        raise typer.BadParameter(f"{value:g} is not above 0.")
    return value


def options_of(words: Mapping[str, Any]) -> Callable[[Function], Function]:
    """Let a command take dataclasses of options, which typer by itself does not take.

    ``words`` are typer's options and arguments, by the names of fields: each of these fields gets
    one, with the type and default of the field, and the command gets the dataclass. Fields without
    words keep their default. TypeError where no dataclass has a field.
    """

    def decorate(function: Function) -> Function:
        function.option_words = words  # type: ignore[attr-defined]
        grouped = {name for _, _, names in _groups(function) for name in names}
        if set(words) - grouped:
            unknown = ", ".join(sorted(set(words) - grouped))
            raise TypeError(f"{function.__name__} takes no dataclass with {unknown}.")
        return function

    return decorate


def parameters_of(function: Callable[..., Any]) -> list[inspect.Parameter]:
    """The parameters of a command as typer takes them: an option for each field."""
    groups = {name: options for name, options, _ in _groups(function)}
    parameters: list[inspect.Parameter] = []
    for name, parameter in inspect.signature(function, eval_str=True).parameters.items():
        if name in groups:
            parameters += _fields_as_options(groups[name], function.option_words)  # type: ignore[attr-defined]
        else:
            parameters.append(parameter)
    return parameters


def gathered(function: Callable[..., Any], given: dict[str, Any]) -> dict[str, Any]:
    """What a command takes, its dataclasses made of the options that were ``given``."""
    for name, options, names in _groups(function):
        given[name] = options(**{field: given.pop(field) for field in names})
    return given


def _groups(function: Callable[..., Any]) -> list[tuple[str, type, list[str]]]:
    """Parameters that are dataclasses: name, class, and the fields that are options."""
    words = getattr(function, "option_words", {})
    return [
        (name, options, [field.name for field in fields(options) if field.name in words])
        for name, parameter in inspect.signature(function, eval_str=True).parameters.items()
        if isinstance(options := parameter.annotation, type) and is_dataclass(options)
    ]


def _fields_as_options(options: type, words: Mapping[str, Any]) -> list[inspect.Parameter]:
    types = get_type_hints(options)
    return [
        inspect.Parameter(
            field.name,
            inspect.Parameter.KEYWORD_ONLY,
            default=inspect.Parameter.empty if field.default is MISSING else field.default,
            annotation=Annotated[types[field.name], words[field.name]],
        )
        for field in fields(options)
        if field.name in words
    ]
