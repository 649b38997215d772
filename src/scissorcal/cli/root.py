"""The ``scissorcal`` command itself: its commands in the order of the day, and how it ends."""

import contextlib
import gc
import io
import os
import sys
from collections.abc import Iterator, Sequence
from typing import Annotated

import typer

import scissorcal
from scissorcal.cli.lazy import group
from scissorcal.cli.terminal import echo, patient_output
from scissorcal.errors import ScissorcalError

THREAD_VARIABLES = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS")
"""What libraries of linear algebra read once, when they are loaded: after the command has begun."""

_COMMANDS = {
    "init": ("scissorcal.cli.init:init", "Start a workspace from a recipe."),
    "plan": ("scissorcal.cli.plan:plan", "The state of every step, and the next command."),
    "recipe": ("scissorcal.cli.recipe:recipe", "Settings and priors, with defaults."),
    "target": ("scissorcal.cli.target:target", "Sheets to print: camera board, mat, markers."),
    "capture": ("scissorcal.cli.capture:capture", "Record friction, cuts or photographs."),
    "import": ("scissorcal.cli.import_:import_", "Import a log (CSV, Parquet, .mat) or a camera."),
    "summarise": ("scissorcal.cli.summarise:summarise", "Sum up force or torque over angle."),
    "identify": ("scissorcal.cli.identify:identify", "Friction of any joint from its log."),
    "export": ("scissorcal.cli.export:export", "Write a recording as Parquet or CSV."),
    "recording": ("scissorcal.cli.recording:recording", "Look into recordings."),
    "fit": ("scissorcal.cli.fit:fit", "Fit what the scene requires; cached."),
    "verify": ("scissorcal.cli.verify:verify", "Check whether a fit's intervals can be trusted."),
    "predict": ("scissorcal.cli.predict:predict", "Predict the effort of a motion, with a band."),
    "report": ("scissorcal.cli.report:report", "Write, compare or sign the report."),
    "package": ("scissorcal.cli.package:package", "Build or check the model package."),
    "render": ("scissorcal.cli.render:render", "Render the cut on a rig."),
    "prototype": ("scissorcal.cli.prototype:prototype", "See and try the package in a browser."),
    "control": ("scissorcal.cli.control:control", "Press on a plate and follow a path on it."),
    "track": ("scissorcal.cli.track:track", "Follow the plate's pose by camera and contact."),
    "device": ("scissorcal.cli.device:device", "Find, check or simulate a rig."),
    "bench": ("scissorcal.cli.bench:bench", "What accuracy costs, measured on your own data."),
    "demo": ("scissorcal.cli.demo:demo", "The whole day on a virtual rig; estimates and truth."),
}


def _print_version(wanted: bool) -> None:
    if wanted:
        typer.echo(f"scissorcal, version {scissorcal.__version__}")
        raise typer.Exit


@group(
    _COMMANDS,
    add_completion=True,
    context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100},
)
def scissorcal_command(
    version: Annotated[
        bool,
        typer.Option(
            "--version", is_eager=True, callback=_print_version, help="Show the version and exit."
        ),
    ] = False,
) -> None:
    """Calibrate, identify and render a haptic scissors rig.

    A workspace is a folder with a recipe.toml. Every command takes --json. Exit codes: 0 done,
    1 unexpected failure, 2 wrong usage or input file, 3 a verdict failed, 4 device or link fault,
    5 another command must run first, 130 interrupted from the keyboard.

    \b
    Example:
      $ scissorcal init my-paper --recipe paper-80gsm
      $ cd my-paper
      $ scissorcal plan
    """


def run(arguments: Sequence[str] | None = None) -> None:
    """Run the command line; leaves by SystemExit with the exit code.

    Linear algebra takes one thread here and in all processes that a command starts, unless the
    environment says how many: the largest matrices have some hundred rows, whose threads only wait
    for each other, for seconds where the machine is busy.
    """
    for variable in THREAD_VARIABLES:
        os.environ.setdefault(variable, "1")
    # no plugin is used, and looking for some reads the metadata of every installed distribution
    os.environ.setdefault("PYDANTIC_DISABLE_PLUGINS", "__all__")
    given = list(sys.argv[1:] if arguments is None else arguments)
    with patient_output(), _collecting_seldom(), _asking():
        code = _run(given)
    sys.exit(code)


@contextlib.contextmanager
def _collecting_seldom() -> Iterator[None]:
    """Have the collector of cycles look seldom: imports make many objects that stay.

    Only while a command runs: a process that goes on would keep cycles of large arrays for long.
    """
    before = gc.get_threshold()
    gc.set_threshold(100_000)
    try:
        yield
    finally:
        gc.set_threshold(*before)


def _asking() -> contextlib.AbstractContextManager[None]:
    """Let another program answer the questions of a command, where the environment asks for it."""
    if os.environ.pop("SCISSORCAL_QUESTIONS", "") != "pipe":
        return contextlib.nullcontext()
    from scissorcal.cli.questions import asked_by_pipe

    return asked_by_pipe()


def _run(given: list[str]) -> int:
    try:
        main = typer.main.get_command(scissorcal_command).main
        code = main(given, prog_name="scissorcal", standalone_mode=False, obj=given)
    except (typer.TyperException, ScissorcalError) as error:
        code = _refuse_usage(error, "--json" in given)
    except typer.Abort:
        echo("Interrupted.", err=True)
        code = 130
    except OSError as error:
        code = _refuse_write(error)
    return code if isinstance(code, int) else 0


def _refuse_write(error: OSError) -> int:
    """Say which file could not be written, or that stdout took no answer; return the exit code."""
    from scissorcal.cli.failures import user_error

    known = user_error(error, None) if error.filename else None
    sentence = known or f"The answer could not be written: {error.strerror}."
    echo(f"Error: {sentence}", err=True)
    return known.exit_code if known else 1


def _refuse_usage(error: typer.TyperException | ScissorcalError, as_json: bool) -> int:
    """Say what is wrong with the words of the command line, and return the exit code.

    Where an option or argument is missing, its help says what to give.
    """
    if isinstance(error, typer.BadParameter):
        error.message = _whole_sentence(error.message)
        error.message = error.message or getattr(error.param, "help", None) or ""
    if isinstance(error, typer.TyperException):
        shown = io.StringIO()
        error.show(file=shown)  # type: ignore[attr-defined]  # every error of the parser has it
        echo(shown.getvalue().rstrip("\n"), err=True)
        sentence = error.format_message()
    else:
        sentence = str(error)
        echo(f"Error: {sentence}", err=True)
    if as_json:
        from scissorcal.cli.output import Answer, print_envelope

        context = getattr(error, "ctx", None)
        name = context.command_path.partition(" ")[2] if context else ""
        answer = Answer({"error": sentence, "exit_code": error.exit_code})
        print_envelope(name, answer, error.exit_code, 0.0)
    return error.exit_code


def _whole_sentence(message: str) -> str:
    """Say in a sentence what the parser found wrong with a value; empty stays empty."""
    words = message.removeprefix("Value error, ").replace("Input should be", "It must be", 1)
    return words if not words or words.endswith((".", "?", "!")) else f"{words}."
