"""The ``scissorcal`` command itself: its commands in the order of the day, and how it ends."""

import os
import sys
from collections.abc import Sequence

import click

import scissorcal
from scissorcal.cli.lazy import LazyGroup
from scissorcal.cli.output import Answer, print_envelope

THREAD_VARIABLES = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS")
"""What libraries of linear algebra read once, when they are loaded: after the command has begun."""

_COMMANDS = {
    "init": ("scissorcal.cli.init:init", "Start a workspace from a recipe."),
    "plan": ("scissorcal.cli.plan:plan", "What the scene needs; done, missing, stale; what next."),
    "recipe": ("scissorcal.cli.recipe:recipe", "Settings and priors, with defaults."),
    "target": (
        "scissorcal.cli.target:target",
        "Sheets to print: camera board, blade mat, markers.",
    ),
    "capture": ("scissorcal.cli.capture:capture", "Record friction or cuts from a rig."),
    "import": ("scissorcal.cli.import_:import_", "Bring in a log from CSV, Parquet or .mat."),
    "export": ("scissorcal.cli.export:export", "Write a recording as Parquet or CSV."),
    "recording": ("scissorcal.cli.recording:recording", "Look into recordings."),
    "fit": ("scissorcal.cli.fit:fit", "Fit what the scene requires; cached."),
    "verify": ("scissorcal.cli.verify:verify", "Check whether a fit's intervals can be trusted."),
    "predict": ("scissorcal.cli.predict:predict", "Predict efforts of a motion, with a band."),
    "report": ("scissorcal.cli.report:report", "One HTML file to review; compare two; sign."),
    "package": ("scissorcal.cli.package:package", "Build or check the model package."),
    "render": ("scissorcal.cli.render:render", "Render the cut on a rig."),
    "device": ("scissorcal.cli.device:device", "Find, check or simulate a rig."),
    "demo": ("scissorcal.cli.demo:demo", "The whole day on a virtual rig, truth against estimate."),
}


@click.group(
    cls=LazyGroup,
    lazy=_COMMANDS,
    context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100},
)
@click.version_option(scissorcal.__version__, prog_name="scissorcal")
def scissorcal_command() -> None:
    """Calibrate, identify and render a haptic scissors rig.

    A workspace is a folder with a recipe.toml. Every command takes --json, and ends with
    0 done, 1 unexpected failure, 2 wrong usage or input file, 3 a verdict failed, 4 device or link
    fault, 5 something must come first.

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
    given = list(sys.argv[1:] if arguments is None else arguments)
    try:
        code = scissorcal_command.main(given, prog_name="scissorcal", standalone_mode=False)
    except click.ClickException as error:
        error.show()
        code = error.exit_code
        if "--json" in given:
            _refuse_as_json(error)
    except click.Abort:
        click.echo("Interrupted.", err=True)
        code = 130
    except BrokenPipeError:
        sys.stderr.close()
        code = 1
    except OSError as error:
        click.echo(f"Error: The answer could not be written: {error.strerror}.", err=True)
        code = 1
    sys.exit(code if isinstance(code, int) else 0)


def _refuse_as_json(error: click.ClickException) -> None:
    context = getattr(error, "ctx", None)
    name = context.command_path.partition(" ")[2] if context else ""
    answer = Answer({"error": error.format_message(), "exit_code": error.exit_code})
    print_envelope(name, answer, error.exit_code, 0.0)
