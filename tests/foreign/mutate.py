"""Read mutants of every format, each under limits of time and memory, and print a table.

python -m tests.foreign.mutate --count 2000
python -m tests.foreign.mutate --count 300 "recording MCAP" PNG
"""

import argparse
import json
import select
import subprocess
import sys
import tempfile
from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path

from tests.foreign.samples import SAMPLES

HANG_S = 60.0
"""A mutant that takes longer is a hang; whole samples take at most 0.3 s."""

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
    crashes: int = 0
    hangs: int = 0
    faults: list[str] = field(default_factory=list)

    @property
    def count(self) -> int:
        return sum(self.codes.values()) + self.crashes + self.hangs

    @property
    def row(self) -> tuple[str, ...]:
        return (
            self.name,
            str(self.count),
            *(str(self.codes[code]) for code in (0, 2, 5)),
            str(len(self.faults)),
            f"{self.worst_s:.2f}",
            f"{self.worst_megabytes:.0f}",
            str(self.crashes + self.hangs),
        )


HEAD = ("format", "mutants", "exit 0", "2", "5", "faults", "worst s", "worst MB", "crashes, hangs")


def run(name: str, count: int, first: int = 0) -> Tally:
    """Read ``count`` mutants of one format in a separate process, which is replaced if it dies."""
    tally = Tally(name)
    sample = SAMPLES[name]
    with tempfile.TemporaryDirectory() as made:
        folder = Path(made)
        whole = folder / f"sample-{sample.file}"
        sample.make(folder / sample.file)
        (folder / sample.file).rename(whole)
        number, last = first, first + count
        while number < last:
            number = _serve(tally, folder, number, last)
    return tally


def _serve(tally: Tally, folder: Path, number: int, last: int) -> int:
    """Read mutants from ``number`` on; the number of the one after the last that was read."""
    command = [sys.executable, "-m", "tests.foreign.worker", str(folder), tally.name]
    with subprocess.Popen(command, stdin=-1, stdout=-1, text=True, bufsize=1) as process:
        assert process.stdin is not None
        assert process.stdout is not None
        while number < last:
            try:
                process.stdin.write(f"{number}\n")
                process.stdin.flush()
            except BrokenPipeError:
                break
            ready, _, _ = select.select([process.stdout], [], [], HANG_S)
            line = process.stdout.readline() if ready else ""
            if not line:
                _note_death(tally, process, number, hung=not ready)
                return number + 1
            _note(tally, number, json.loads(line))
            number += 1
    return number


def _note_death(tally: Tally, process: "subprocess.Popen[str]", number: int, hung: bool) -> None:
    if hung:
        process.kill()
        tally.hangs += 1
    else:
        tally.crashes += 1
    what = f"no answer in {HANG_S:g} s" if hung else f"exit code {process.wait()}"
    tally.faults.append(f"{tally.name} {number}: {what}")


def _note(tally: Tally, number: int, found: dict[str, object]) -> None:
    tally.codes[int(str(found["code"]))] += 1
    seconds, megabytes = float(str(found["seconds"])), float(str(found["megabytes"]))
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
    parser.add_argument("formats", nargs="*", help="all where none is named")
    given = parser.parse_args()
    print(" | ".join(HEAD), flush=True)
    faults = []
    for name in given.formats or SAMPLES:
        tally = run(name, given.count, given.first)
        print(" | ".join(tally.row), flush=True)
        faults += tally.faults
    for fault in faults[:MOST_SHOWN]:
        print(f"\n{fault}")
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
