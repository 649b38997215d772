"""Write the tables of docs/verdicts.md and docs/loop.md from the code.

python docs/tools/tables.py --write     # after a change of a check or a reason to stop
python docs/tools/tables.py --check     # exit code 1 if a table is not up to date
"""

import argparse
import importlib
import sys
from pathlib import Path

from scissorcal.kernel import StopReason
from scissorcal.verdicts import TORQUE, Check

DOCS = Path(__file__).resolve().parents[1]
SOURCE = DOCS.parent / "src"
STOPS_HEAD = "| stop | number | message |"
VERDICTS_HEAD = "| scope | check | limit | bounds | what the value is, and what it guards |"


def main() -> int:
    """Write or check both tables; returns the exit code."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    choice = parser.add_mutually_exclusive_group(required=True)
    choice.add_argument("--write", action="store_true")
    choice.add_argument("--check", action="store_true")
    wanted = pages()
    stale = [path for path, text in wanted.items() if path.read_text(encoding="utf-8") != text]
    if parser.parse_args().write:
        for path in stale:
            path.write_text(wanted[path], encoding="utf-8")
        return 0
    for path in stale:
        print(f"The table of {path} is not up to date: run 'make schemas'.", file=sys.stderr)
    return 1 if stale else 0


def pages() -> dict[Path, str]:
    """Return both pages by their path; each ends with its table."""
    ends = {"verdicts.md": (VERDICTS_HEAD, _verdicts()), "loop.md": (STOPS_HEAD, _stops())}
    return {
        DOCS / name: (DOCS / name).read_text(encoding="utf-8").partition(head)[0] + table
        for name, (head, table) in ends.items()
    }


def checks() -> list[Check]:
    """Every check that a module declares as a constant or in a dict of them, sorted by scope."""
    declared: dict[str, Check] = {}
    for path in sorted(SOURCE.rglob("*.py")):
        if "Check(" not in path.read_text(encoding="utf-8"):
            continue
        module = importlib.import_module(".".join(path.relative_to(SOURCE).with_suffix("").parts))
        for thing in vars(module).values():
            for check in thing.values() if isinstance(thing, dict) else (thing,):
                if isinstance(check, Check) and declared.setdefault(check.key, check) is not check:
                    raise ValueError(f"{path} declares {check.key} a second time")
    return sorted(declared.values(), key=lambda check: check.key.partition(" ")[0])


def _verdicts() -> str:
    rows = [VERDICTS_HEAD, "|---|---|---|---|---|"]
    for check in checks():
        scope, _, name = check.key.partition(" ")
        kind, guards = "", check.guards
        if guards.startswith(TORQUE):
            kind, guards = "torque", guards.removeprefix(TORQUE)
        limit = f"{check.limit} {check.threshold:g}".removesuffix("nan").strip()
        rows.append(f"| {scope} | *{name}* | {limit} | {kind} | {guards} |")
    return "\n".join([*rows, ""])


def _stops() -> str:
    rows = [f"| {r.name} | {r.value} | {r.sentence} |" for r in StopReason if r.value]
    return "\n".join([STOPS_HEAD, "|---|---|---|", *rows, ""])


if __name__ == "__main__":
    sys.exit(main())
