"""Read mutants of every format, each under limits of time and memory, and print a table.

python -m tests.foreign.mutate --count 2000
python -m tests.foreign.mutate --count 300 "recording MCAP" PNG
python -m tests.foreign.mutate --count 300 --commands
"""

import argparse
import contextlib
import json
import select
import subprocess
import sys
import tempfile
from collections import Counter
from dataclasses import dataclass, field
from typing import Any, Self

from tests.foreign.commands import COMMANDS
from tests.foreign.samples import SAMPLES

HANG_S = 180.0
"""A mutant that takes longer is a hang; parsers have 10 to 60 s of processor time."""

MOST_SHOWN = 40
MOST_MEGABYTES = 2000.0
"""What reading a mutant may add; a parser's process is limited to 2 or 3 GB."""


@dataclass
class Tally:
    """How the mutants of one format ended."""

    name: str
    codes: Counter[int] = field(default_factory=Counter)
    worst_s: float = 0.0
    worst_megabytes: float = 0.0
    deaths: int = 0
    faults: list[str] = field(default_factory=list)

    @property
    def count(self) -> int:
        return sum(self.codes.values()) + self.deaths

    @property
    def row(self) -> tuple[str, ...]:
        return (
            self.name,
            str(self.count),
            *(str(self.codes[code]) for code in (0, 2, 3, 5)),
            str(len(self.faults)),
            f"{self.worst_s:.2f}",
            f"{self.worst_megabytes:.0f}",
            str(self.deaths),
        )


HEAD = (
    "format",
    "mutants",
    "exit 0",
    "2",
    "3",
    "5",
    "faults",
    "worst s",
    "worst MB",
    "crashes, hangs",
)


class Reader:
    """A process that reads mutants; one that died or hung is replaced by the next."""

    def __init__(self, by_commands: bool = False) -> None:
        self._words = ("commands",) if by_commands else ()
        self._folder = tempfile.TemporaryDirectory()
        self._process: subprocess.Popen[str] | None = None

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._end()
        self._folder.cleanup()

    def read(self, name: str, number: int) -> dict[str, Any] | str:
        """How one mutant ended; in words where the process did not answer."""
        process = self._started()
        assert process.stdin is not None
        assert process.stdout is not None
        with contextlib.suppress(BrokenPipeError):  # then there is no line, which says it
            process.stdin.write(f"{number} {name}\n")
            process.stdin.flush()
        ready, _, _ = select.select([process.stdout], [], [], HANG_S)
        line = process.stdout.readline() if ready else ""
        if line:
            found: dict[str, Any] = json.loads(line)
            return found
        if not ready:
            process.kill()
        code = process.wait()
        self._end()
        return f"exit code {code}" if ready else f"no answer in {HANG_S:g} s"

    def _started(self) -> "subprocess.Popen[str]":
        if self._process is None:
            command = [sys.executable, "-m", "tests.foreign.worker", self._folder.name]
            command += self._words
            self._process = subprocess.Popen(command, stdin=-1, stdout=-1, text=True, bufsize=1)
        return self._process

    def _end(self) -> None:
        if self._process is not None:
            with self._process:
                self._process = None


def run(reader: Reader, name: str, count: int, first: int = 0) -> Tally:
    """Read ``count`` mutants of one format."""
    tally = Tally(name)
    for number in range(first, first + count):
        found = reader.read(name, number)
        if isinstance(found, str):
            tally.deaths += 1
            tally.faults.append(f"{name} {number}: {found}")
        else:
            _note(tally, number, found)
    return tally


def _note(tally: Tally, number: int, found: dict[str, Any]) -> None:
    tally.codes[found["code"]] += 1
    seconds, megabytes = found["seconds"], found["megabytes"]
    tally.worst_s = max(tally.worst_s, seconds)
    tally.worst_megabytes = max(tally.worst_megabytes, megabytes)
    if found["fault"]:
        tally.faults.append(f"{tally.name} {number}: {found['fault']}")
    elif megabytes > MOST_MEGABYTES:
        tally.faults.append(f"{tally.name} {number}: {megabytes:.0f} MB")


def main() -> int:
    """Print the table, and what went wrong below it; 1 where anything did."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--count", type=int, default=200)
    parser.add_argument("--first", type=int, default=0, help="number of the first mutant")
    parser.add_argument("--commands", action="store_true", help="through whole commands")
    parser.add_argument("formats", nargs="*", help="all where none is named")
    given = parser.parse_args()
    print(" | ".join(HEAD), flush=True)
    faults = []
    with Reader(given.commands) as reader:
        for name in given.formats or (COMMANDS if given.commands else SAMPLES):
            tally = run(reader, name, given.count, given.first)
            print(" | ".join(tally.row), flush=True)
            faults += tally.faults
    for fault in faults[:MOST_SHOWN]:
        print(f"\n{fault}")
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
