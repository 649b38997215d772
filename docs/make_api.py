"""Write docs/api, and the tables of docs/verdicts.md and docs/loop.md, from the code.

    python docs/make_api.py --write     # after a change of public docstrings
    python docs/make_api.py --check     # exit code 1 if a page is not up to date

One page per room: every name in ``__all__`` of its contract (``__init__.pyi``) with signature and
docstring. Names of the contract that are not in it serve other rooms and their tests.
"""

import argparse
import ast
import importlib
import inspect
import re
import sys
import textwrap
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType
from typing import Any

from scissorcal.kernel import StopReason
from scissorcal.verdicts import TORQUE, Check

DOCS = Path(__file__).parent
SOURCE = DOCS.parent / "src"
ROOMS = (
    "scissorcal",
    "scissorcal.recording",
    "scissorcal.model",
    "scissorcal.model.surface",
    "scissorcal.inference",
    "scissorcal.calibration",
    "scissorcal.package",
    "scissorcal.tracking",
    "scissorcal.kernel",
    "scissorcal.control",
    "scissorcal.report",
    "scissorcal.errors",
    "scissorcal.verdicts",
)
STOPS_HEAD = "| stop | number | message |"
TABLE_HEAD = "| scope | check | limit | bounds | what the value is, and what it guards |"


def main() -> int:
    """Write or check every page; returns the exit code."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    choice = parser.add_mutually_exclusive_group(required=True)
    choice.add_argument("--write", action="store_true")
    choice.add_argument("--check", action="store_true")
    wanted = pages()
    if parser.parse_args().write:
        for path, text in wanted.items():
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(text, encoding="utf-8")
        return 0
    stale = stale_pages(wanted)
    for path in stale:
        print(f"{path} is not up to date: run 'make api'.", file=sys.stderr)
    return 1 if stale else 0


def pages() -> dict[Path, str]:
    """Return every generated page by its path."""
    modules = [importlib.import_module(name) for name in ROOMS]
    found = {DOCS / "api" / f"{m.__name__}.md": _room_page(m) for m in modules}
    found[DOCS / "api" / "index.md"] = _index(modules)
    verdicts = DOCS / "verdicts.md"
    head = verdicts.read_text(encoding="utf-8").partition(TABLE_HEAD)[0]
    found[verdicts] = head + _verdict_table()
    loop = DOCS / "loop.md"
    found[loop] = loop.read_text(encoding="utf-8").partition(STOPS_HEAD)[0] + _stops_table()
    return found


def _stops_table() -> str:
    """Each reason for a stop of the servo, at the end of docs/loop.md."""
    rows = [f"| {r.name} | {r.value} | {r.sentence} |" for r in StopReason if r.value]
    return "\n".join([STOPS_HEAD, "|---|---|---|", *rows, ""])


def stale_pages(wanted: dict[Path, str]) -> list[Path]:
    """Return the pages that differ from what the code gives, and those that it no longer has."""
    differ = [p for p, text in wanted.items() if not p.is_file() or p.read_text("utf-8") != text]
    return differ + sorted(set((DOCS / "api").glob("*.md")) - set(wanted))


def _index(modules: list[ModuleType]) -> str:
    lines = ["# API", "", "Generated from the docstrings by `make api`.", ""]
    lines += ["| room | content | names |", "|---|---|---|"]
    for module in modules:
        names = ", ".join(f"`{name}`" for name, _ in _public(module))
        lines.append(
            f"| [{module.__name__}]({module.__name__}.md) | {_summary(module)} | {names} |"
        )
    return "\n".join([*lines, ""])


def _room_page(module: ModuleType) -> str:
    parts = [f"# {module.__name__}", "", *_text(module)]
    for name, thing in _public(module):
        parts += [f"## {name}", ""]
        if inspect.isclass(thing):
            parts += _class(name, thing)
        elif callable(thing):
            parts += [*_signature(name, thing), *_text(thing)]
        else:
            parts += [f"`{name}` of type `{type(thing).__name__}`.", ""]
    return "\n".join(parts)


def _public(module: ModuleType) -> Iterator[tuple[str, Any]]:
    names = _documented(module) or [
        name
        for name, thing in vars(module).items()
        if not name.startswith("_") and getattr(thing, "__module__", "") == module.__name__
    ]
    for name in sorted(names):
        if not name.startswith("__"):
            yield name, getattr(module, name)


def _documented(module: ModuleType) -> list[str]:
    stub = Path(str(module.__file__)).with_suffix(".pyi")
    if not stub.exists():
        return list(getattr(module, "__all__", ()))
    for node in ast.parse(stub.read_text(encoding="utf-8")).body:
        if isinstance(node, ast.Assign):
            return list(ast.literal_eval(node.value))
    return []


def _class(name: str, thing: type) -> list[str]:
    parts = _fields(name, thing) + _text(thing)
    # with what a base of the same file gives: that base is on no page
    bases = [base for base in thing.__mro__[::-1] if base.__module__ == thing.__module__]
    members = {member: value for base in bases for member, value in vars(base).items()}
    for member, value in members.items():
        if member.startswith("_"):
            continue
        if isinstance(value, property):
            parts += [f"### {name}.{member}", "", *_text(value.fget)]
        elif inspect.isfunction(value) or isinstance(value, (classmethod, staticmethod)):
            function = inspect.unwrap(getattr(thing, member))
            parts += [f"### {name}.{member}", "", *_signature(member, function), *_text(function)]
    return parts


def _fields(name: str, thing: type) -> list[str]:
    """The fields of a dataclass or a pydantic model, as the source has them."""
    body = _parsed(thing)
    if not isinstance(body, ast.ClassDef):
        return []
    fields = [ast.unparse(node) for node in body.body if isinstance(node, ast.AnnAssign)]
    return _fenced(name, [f for f in fields if not f.startswith("_")], "") if fields else []


def _signature(name: str, thing: Any) -> list[str]:
    """Arguments and result, as the source has them: types keep their short names."""
    function = _parsed(thing)
    if not isinstance(function, ast.FunctionDef):
        return []
    parts = re.split(r", (?=\*{0,2}\w+(?::|=|,|$)|\*$|\*,|/)", ast.unparse(function.args))
    result = f" -> {ast.unparse(function.returns)}" if function.returns else ""
    return _fenced(name, [part for part in parts if part not in ("", "self", "cls")], result)


def _fenced(name: str, parts: list[str], result: str) -> list[str]:
    one = f"{name}({', '.join(parts)}){result}"
    if len(one) > 96:
        one = f"{name}(\n    " + ",\n    ".join(parts) + f",\n){result}"
    return ["```python", one, "```", ""]


def _parsed(thing: Any) -> ast.AST | None:
    try:
        return ast.parse(textwrap.dedent(inspect.getsource(thing))).body[0]
    except (TypeError, OSError):
        return None


def _summary(thing: Any) -> str:
    return (inspect.getdoc(thing) or "").partition("\n")[0]


def _text(thing: Any) -> list[str]:
    """The docstring as Markdown: examples in fences, the rest as it stands."""
    lines: list[str] = []
    fenced = False
    for line in (inspect.getdoc(thing) or "").splitlines():
        example = line.lstrip().startswith((">>>", "..."))
        if example and not fenced:
            lines += ["```pycon"]
            fenced = True
        elif fenced and not line.strip():
            lines += ["```"]
            fenced = False
        lines.append(line if fenced else re.sub(r":\w+:`~?([^`]+)`", r"`\1`", line))
    return [*lines, *(["```"] if fenced else []), ""] if lines else []


def checks() -> list[Check]:
    """Every check that a module declares as a constant or in a dict of them, sorted by scope."""
    found: dict[str, Check] = {}
    for path in sorted(SOURCE.rglob("*.py")):
        if "Check(" not in path.read_text(encoding="utf-8"):
            continue
        module = importlib.import_module(".".join(path.relative_to(SOURCE).with_suffix("").parts))
        for thing in vars(module).values():
            for check in thing.values() if isinstance(thing, dict) else (thing,):
                if isinstance(check, Check) and found.setdefault(check.key, check) is not check:
                    raise ValueError(f"{path} declares {check.key} a second time")
    return sorted(found.values(), key=lambda check: check.key.partition(" ")[0])


def _verdict_table() -> str:
    rows = [TABLE_HEAD, "|---|---|---|---|---|"]
    for check in checks():
        scope, _, name = check.key.partition(" ")
        kind, guards = "", check.guards
        if guards.startswith(TORQUE):
            kind, guards = "torque", guards.removeprefix(TORQUE)
        limit = f"{check.limit} {check.threshold:g}".removesuffix("nan").strip()
        rows.append(f"| {scope} | *{name}* | {limit} | {kind} | {guards} |")
    return "\n".join([*rows, ""])


if __name__ == "__main__":
    sys.exit(main())
