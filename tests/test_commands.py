"""Every command line that a message, a help text or a page names is one that the parser takes."""

import ast
import re
import shlex
from collections.abc import Iterator, Sequence
from functools import cache
from pathlib import Path

import pytest
import typer
from typer.core import TyperCommand, TyperGroup

import scissorcal
from scissorcal.cli.root import scissorcal_command
from scissorcal.recipe import recipe_names
from scissorcal.workday import STEPS
from tests.test_docs import ROOT

PACKAGE = Path(scissorcal.__file__).parent
HOLE = "\ue000{}\ue001"
"""Stands for what an f-string inserts: the expression between two private characters."""
FITS = ("friction", "friction --axis advance", "cut", "camera", "blade", "plate")
RIG_FITS = ("friction", "friction --axis advance", "cut")

INSERTED: dict[str, Sequence[str]] = {
    "PHOTOGRAPHS[kind]": ("board-*.jpg",),
    "command_words(kind)": RIG_FITS,
    "command_words(path.stem)": FITS,
    "fit.words": RIG_FITS,
    "fitted.words": RIG_FITS,
    "kind": ("camera", "blade", "plate"),
    "name": ("friction.mcap",),
    "path": ("fits/cut.nc",),
    "path.name": ("friction.mcap",),
    "photographs": ("--image *.jpg", "--image *.jpg --positions positions.csv"),
    "what": ("friction", "cut", "plate"),
    "words": ("camera", "blade", "plate", "plate --positions FILE"),
    "words or what": RIG_FITS,
}
"""What each expression within a command line may insert; a new one is to be stated here."""
NOT_COMMANDS = {"scissorcal comparison of two reports"}
SETS_UP_A_SHELL = ("--install-completion", "--show-completion")
"""The parser itself obeys these, so that they are not given to it."""

VALUES = ("1", "friction", "sim", "camera", "office-paper", "x.toml", "x.csv", "captures/a.mcap")
"""Values that stand for a placeholder in turn: a number, a word of each kind, a file."""


def texts_of(source: str) -> Iterator[tuple[int, str]]:
    """Line and text of every string; what an f-string inserts stands in it as a hole."""
    inner: set[ast.AST] = set()
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.JoinedStr):
            inner |= set(node.values)
            parts = [
                str(part.value)
                if isinstance(part, ast.Constant)
                else HOLE.format(ast.unparse(part.value))  # type: ignore[attr-defined]
                for part in node.values
            ]
            yield node.lineno, "".join(parts)
        elif isinstance(node, ast.Constant) and isinstance(node.value, str) and node not in inner:
            yield node.lineno, node.value


QUOTED = re.compile(r"(?<![\w'])'(scissorcal(?: [^'\n]*(?:'[^'\n]*'[^'\n]*)*?)?)'(?!\w)")
PROMPT = re.compile(r"^\s*\$ (scissorcal\b.*)$", re.MULTILINE)
TICKED = re.compile(r"(?<!`)`(scissorcal [^`]*)`")
WHOLE = re.compile(r"^scissorcal [a-z][^.!?]*$")


def commands_in(text: str) -> list[str]:
    """The command lines in a text: in quotes, after a prompt, between backticks, or the whole."""
    joined = re.sub(r"\\\n\s*", "", text)
    found = QUOTED.findall(" ".join(joined.split()) if "\n" not in text else joined)
    found += PROMPT.findall(joined)
    found += [" ".join(one.split()) for one in TICKED.findall(joined)]
    if WHOLE.match(joined) and joined not in NOT_COMMANDS:
        found.append(joined)
    return [one.partition(" | ")[0].partition(" > ")[0] for one in found]


@cache
def root() -> TyperGroup:
    return typer.main.get_command(scissorcal_command)  # type: ignore[return-value]


def refusal(words: Sequence[str]) -> str:
    """What the parser says of a command line; empty where it takes it. Nothing is run.

    A sentence may name a command without what it must be given, so that this is no refusal.
    """
    if set(words) & set(SETS_UP_A_SHELL):
        return ""
    command, name, rest = root(), "scissorcal", list(words)
    context = None
    try:
        while True:
            if isinstance(command, TyperGroup) and not rest:
                return ""
            context = command.make_context(name, rest, parent=context)
            left = [*getattr(context, "_protected_args", ()), *context.args]
            if not isinstance(command, TyperGroup) or not left:
                return ""
            found, command, rest = command.resolve_command(context, left)
            name = found or ""
            if command is None:
                return f"there is no command {left[0]}"
    except typer.Exit:  # --help and --version end the parsing
        return ""
    except Exception as error:  # noqa: BLE001 - whatever the parser raises is a refusal
        unfilled = str(error) == f"Option {words[-1]!r} requires an argument."
        if unfilled or str(error).startswith("Missing parameter"):
            return ""
        return str(error) or type(error).__name__


PLACE = re.compile(r"\b[A-Z][A-Z0-9]{2,}\b|\b[A-Z]\b|\.\.\.|<[^>]*>")


def filled(command: str) -> Iterator[list[str]]:
    """The command lines that a text with holes stands for; each is a list of ways to fill it."""
    holes = list(dict.fromkeys(re.findall("\ue000(.*?)\ue001", command)))
    lines = [command]
    for hole in holes:
        if hole in INSERTED:
            lines = [
                one.replace(HOLE.format(hole), value) for one in lines for value in INSERTED[hole]
            ]
    for line in lines:
        ways: list[str] = []
        for value in VALUES:
            way = re.sub("\ue000.*?\ue001", value, line)
            way = re.sub(r"(\s\.\.\.|\s*\u2026)$", "", way)
            ways += [way, PLACE.sub(value, way)]
        yield list(dict.fromkeys(ways))


def wrong_in(command: str) -> list[str]:
    """What the parser refuses of what a command line stands for, with its reason."""
    wrong = []
    for ways in filled(command):
        said = ""
        for way in ways:
            try:
                words = shlex.split(way, comments=True)[1:]
            except ValueError as error:
                said = said or f"{way}: {error}"
                continue
            reason = refusal(words)
            if not reason:
                break
            said = said or f"{way}: {reason}"
        else:
            wrong.append(said)
    return wrong


def listed(pairs: Iterator[tuple[str, str]]) -> list[str]:
    return [f"{place}: {wrong}" for place, command in pairs for wrong in wrong_in(command)]


def in_source() -> Iterator[tuple[str, str]]:
    for path in sorted(PACKAGE.rglob("*.py")):
        for line, text in texts_of(path.read_text(encoding="utf-8")):
            for command in commands_in(text):
                yield f"{path.relative_to(PACKAGE)}:{line}", command


def in_pages() -> Iterator[tuple[str, str]]:
    pages = [*ROOT.glob("*.md"), *(ROOT / "docs").rglob("*.md")]
    for page in sorted(page for page in pages if page.name != "CHANGELOG.md"):
        text = page.read_text(encoding="utf-8")
        for block in re.findall(r"^```\w*\n(.*?)^```", text, re.MULTILINE | re.DOTALL):
            for line in re.sub(r"\\\n\s*", "", block).splitlines():
                if re.match(r"scissorcal [a-z-]", line) and "<Tab>" not in line:
                    yield page.name, line.partition(" | ")[0]
        for command in commands_in(re.sub(r"^```.*?^```", "", text, flags=re.M | re.S)):
            if "<Tab>" not in command:
                yield page.name, command


def test_commands_in_messages_and_help_exist() -> None:
    found = list(in_source())
    assert len(found) > 200
    assert not listed(iter(found))


def test_what_messages_insert_in_a_command_is_stated_here() -> None:
    holes = {hole for _, one in in_source() for hole in re.findall("\ue000(.*?)\ue001", one)}
    assert holes <= set(INSERTED)


def test_commands_in_the_documentation_exist() -> None:
    if not (ROOT / "docs").is_dir():
        pytest.skip("the documentation is not installed")
    found = list(in_pages())
    assert len(found) > 100
    assert not listed(iter(found))


def test_the_command_of_every_step_and_of_every_remedy_exists() -> None:
    commands = [step.command for step in STEPS]
    commands += [f"{s.command} --max-minutes 60" for s in STEPS if s.kind == "fit" and s.by_effort]
    commands += [f"{s.command} --effort thorough" for s in STEPS if s.kind == "fit" and s.by_effort]
    commands += [f"{step.command} --force" for step in STEPS if step.kind == "fit"]
    assert not [wrong for command in commands for wrong in wrong_in(command)]


def test_no_command_is_made_from_the_name_of_a_step() -> None:
    """A step's name is not its command: "fit friction-advance" is 'fit friction --axis advance'."""
    assert wrong_in("scissorcal fit friction-advance")
    source = "\n".join(path.read_text(encoding="utf-8") for path in PACKAGE.rglob("*.py"))
    assert "scissorcal {name}" not in source
    assert "scissorcal {step.name}" not in source


OPTION = re.compile(r"(?<![\w-])--[a-z][a-z-]+")
OF_OTHERS = {
    "--once",  # ros2 topic echo
    *("--force-reinstall", "--no-deps", "--nthreads"),  # of pip, and of dask
    *("--check", "--write"),  # of this project's own scripts
    "--picture",  # a name in a style sheet
}


def options_of(command: TyperCommand | TyperGroup) -> Iterator[str]:
    for parameter in command.params:
        yield from parameter.opts
        yield from parameter.secondary_opts
    if isinstance(command, TyperGroup):
        for name in command.commands:
            yield from options_of(command.load(name))  # type: ignore[attr-defined]


def test_every_option_in_a_message_is_one_of_some_command() -> None:
    known = {*options_of(root()), "--help"} | OF_OTHERS
    wrong = {
        f"{path.relative_to(PACKAGE)}:{line}: {option}"
        for path in sorted(PACKAGE.rglob("*.py"))
        for line, text in texts_of(path.read_text(encoding="utf-8"))
        if " " in text
        for option in OPTION.findall(text)
        if option not in known
    }
    assert not wrong


@pytest.mark.parametrize(
    ("text", "commands"),
    [
        ("Run 'scissorcal plan' or 'scissorcal fit all --force'.", 2),
        ("'scissorcal recording exclude a.mcap --why 'too short'' leaves it out.", 1),
        ("\b\nExample:\n  $ scissorcal plan \\\n      --json\n", 1),
        ("the package's scissorcal version", 0),
    ],
)
def test_command_lines_are_found_in_texts(text: str, commands: int) -> None:
    assert len(commands_in(text)) == commands


@pytest.mark.parametrize(
    "wrong", ["fitt", "fit nothing", "plan --nope", "fit --effort best cut", "recipe show a b"]
)
def test_wrong_command_lines_are_found(wrong: str) -> None:
    assert wrong_in(f"scissorcal {wrong}")


@pytest.mark.parametrize("name", recipe_names())
def test_the_recipes_that_messages_name_exist(name: str) -> None:
    assert not wrong_in(f"scissorcal init NAME --recipe {name}")
