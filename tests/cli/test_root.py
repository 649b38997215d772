"""Every command has help with an example, takes --json, and ends with the code it should."""

import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
import typer
from typer.core import TyperCommand

import scissorcal
from scissorcal.cli.lazy import LazyGroup
from scissorcal.cli.output import Answer, table
from scissorcal.cli.root import scissorcal_command
from scissorcal.errors import DeviceError, InputError, MissingError, ScissorcalError, VerdictError
from scissorcal.verdicts import Verdict

from .conftest import Cli, run_instead


def all_commands() -> Iterator[tuple[str, TyperCommand]]:
    """Walk through all commands, groups left out."""
    pending = [("", typer.main.get_command(scissorcal_command))]
    while pending:
        path, found = pending.pop()
        if isinstance(found, LazyGroup):
            pending += [(f"{path} {name}".strip(), found.load(name)) for name in found.lazy]
        else:
            assert isinstance(found, TyperCommand)
            yield path, found


COMMANDS = dict(all_commands())


def test_the_day_is_there() -> None:
    assert set(COMMANDS) >= {
        "init",
        "plan",
        "capture friction",
        "capture cut",
        "import",
        "export",
        "recording show",
        "fit friction",
        "fit cut",
        "fit all",
        "verify",
        "report compare",
        "report sign",
        "package build",
        "package check",
        "render",
        "device simulate",
        "device doctor",
        "device list",
        "demo",
    }


def test_the_module_runs_the_command_line() -> None:
    said = subprocess.run(
        [sys.executable, "-m", "scissorcal", "--version"],
        capture_output=True,
        text=True,
        check=True,
    )
    assert said.stdout == f"scissorcal, version {scissorcal.__version__}\n"


@pytest.mark.parametrize("path", COMMANDS)
def test_help_has_an_example_with_output_and_json(path: str, cli: Cli) -> None:
    said = cli(*path.split(), "--help")
    assert said.code == 0
    assert "--json" in said.out
    lines = said.out.split("Example", 1)[1].splitlines()
    calls = [index for index, line in enumerate(lines) if line.strip().startswith("$ scissorcal")]
    assert calls, "no example"
    assert any(
        lines[index + 1].strip() and not lines[index + 1].strip().startswith("$") for index in calls
    ), "no output in the example"


@pytest.mark.parametrize("path", COMMANDS)
def test_every_option_and_argument_has_help(path: str) -> None:
    for parameter in COMMANDS[path].params:
        assert getattr(parameter, "help", None), parameter.name


def test_the_line_of_help_in_the_list_does_not_need_the_command(cli: Cli) -> None:
    said = cli("capture", "--help")
    assert "friction  Empty strokes" in said.out


@pytest.mark.parametrize(
    ("words", "suggested"), [(["captrue"], "capture"), (["capture", "fricton"], "friction")]
)
def test_a_mistyped_command_is_answered_with_a_suggestion(
    words: list[str], suggested: str, cli: Cli
) -> None:
    said = cli(*words)
    assert said.code == 2
    assert f"Did you mean '{suggested}'?" in said.err


@pytest.mark.parametrize("words", [["capture", "friction"], ["render"], ["device", "doctor"]])
def test_a_missing_device_names_the_virtual_rig(words: list[str], cli: Cli) -> None:
    said = cli(*words)
    assert said.code == 2
    assert "--device" in said.err
    assert '"sim" for a virtual rig' in said.err


@pytest.mark.parametrize(
    ("shell", "words", "expected"),
    [
        ("bash", "scissorcal cap", "capture"),
        ("zsh", "scissorcal capture fr", "friction"),
        ("fish", "scissorcal fit bl", "blade"),
    ],
)
def test_a_shell_completes_commands_and_choices(shell: str, words: str, expected: str) -> None:
    typed = {
        "COMP_WORDS": words,
        "COMP_CWORD": str(len(words.split()) - 1),
        "_TYPER_COMPLETE_ARGS": words,
        "_TYPER_COMPLETE_FISH_ACTION": "get-args",
        "_SCISSORCAL_COMPLETE": f"complete_{shell}",
    }
    program = "from scissorcal.cli import main; main()"
    done = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, env=os.environ | typed
    )
    assert expected in done.stdout, done.stderr


def test_an_option_in_front_of_a_subcommand_is_refused(cli: Cli) -> None:
    said = cli("report", "--anew", "compare", "a", "b")
    assert said.code == 2
    assert "after the subcommand" in said.err


def test_version(cli: Cli) -> None:
    assert scissorcal.__version__ in cli("--version").out


@pytest.mark.parametrize(
    "words", [["nope"], ["init"], ["init", "--nope"], ["fit", "colour"], ["capture", "cut"]]
)
def test_wrong_usage_is_two_and_still_one_object(words: list[str], cli: Cli) -> None:
    plain = cli(*words)
    assert plain.code == 2
    assert plain.err
    assert not plain.out
    said = cli(*words, "--json")
    assert said.code == 2
    assert said.envelope["result"]["exit_code"] == 2
    assert said.envelope["result"]["error"]


@pytest.mark.parametrize(
    ("raised", "code"),
    [
        (ScissorcalError("Plain."), 1),
        (InputError("File, line, mend."), 2),
        (VerdictError("Failed."), 3),
        (DeviceError("Unplugged."), 4),
        (MissingError("Capture first."), 5),
        (KeyError("colour"), 1),
        (KeyboardInterrupt(), 130),
    ],
)
def test_an_error_is_a_sentence_and_a_code(
    raised: BaseException, code: int, cli: Cli, monkeypatch: pytest.MonkeyPatch
) -> None:
    def broken() -> Answer:
        raise raised

    run_instead(broken, monkeypatch)
    said = cli("plan")
    assert said.code == code
    assert "Traceback" not in said.err + said.out
    assert said.err.startswith("Error: ")
    envelope = cli("plan", "--json").envelope
    assert envelope["result"]["exit_code"] == code
    assert envelope["command"] == "plan"
    if not isinstance(raised, KeyboardInterrupt):
        assert "Traceback" in cli("plan", "--traceback").err


def test_an_unexpected_failure_says_how_to_see_more(
    cli: Cli, monkeypatch: pytest.MonkeyPatch
) -> None:
    def broken() -> Answer:
        raise ZeroDivisionError("division by zero")

    run_instead(broken, monkeypatch)
    said = cli("plan")
    assert "ZeroDivisionError: division by zero" in said.err
    assert "--traceback" in said.err


def test_a_failed_verdict_is_three_and_prose_leaves_stdout_to_the_object(
    cli: Cli, monkeypatch: pytest.MonkeyPatch
) -> None:
    verdicts = [
        Verdict("fit.cut", "k-hat", "fail", 0.9, 0.7, "Far off.", "at most"),
        Verdict("fit.cut", "bounds", "not_evaluated", None, None, "No search."),
    ]

    def judged() -> Answer:
        return Answer({"value": float("nan")}, "What it found.", verdicts, [Path("a.json")])

    run_instead(judged, monkeypatch)
    said = cli("plan")
    assert said.code == 3
    assert "What it found." in said.out
    assert "FAIL  fit.cut  k-hat   0.9, at most 0.7  Far off." in said.out
    said = cli("plan", "--json")
    assert said.code == 3
    assert "What it found." in said.err
    assert said.envelope["verdicts"][0]["status"] == "fail"
    assert said.envelope["result"] == {"value": None}
    assert said.envelope["files"] == ["a.json"]


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="this system has no /dev/full")
def test_an_answer_that_cannot_be_written_is_said_to_be(tmp_path: Path) -> None:
    program = "from scissorcal.cli import main; main()"
    words = [sys.executable, "-c", program, "init", str(tmp_path / "work")]
    with Path("/dev/full").open("w") as full:
        done = subprocess.run(words, stdout=full, stderr=subprocess.PIPE, text=True)
    assert done.returncode == 1
    assert "could not be written" in done.stderr
    assert "Traceback" not in done.stderr


def test_tables_line_up() -> None:
    assert table([["a", "long"], ["longer", "b"]]) == "a       long\nlonger  b"


def test_linear_algebra_takes_one_thread_unless_the_environment_says_otherwise() -> None:
    program = (
        "import os, sys\n"
        "from scissorcal.cli.root import THREAD_VARIABLES, run\n"
        "os.environ.pop('OMP_NUM_THREADS', None)\n"
        "os.environ.pop('MKL_NUM_THREADS', None)\n"
        "os.environ['OPENBLAS_NUM_THREADS'] = '3'\n"
        "assert 'numpy' not in sys.modules\n"
        "try:\n    run(['--version'])\nexcept SystemExit:\n    pass\n"
        "print([os.environ[name] for name in THREAD_VARIABLES])\n"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True)
    assert done.stdout.splitlines()[-1] == "['3', '1', '1']", done.stderr
