"""Search for examples that property tests fail on: ``python -m tests.explore --minutes 60``.

The suite tries the same examples in every run. This tries fresh ones: each round, every test that
hypothesis drives gets an equal share of the time and uses it up with seed after seed. A test that
failed is left out of later rounds. The end prints, for each failure, the falsifying example and the
command that shows it again, and the exit code is 1 if there was one. What is found is repaired at
its cause and becomes an ``@example`` of its test.

Tests marked slow take part with ``--slow``: one is a state machine whose run of minutes is never
cut short. ``paths`` restrict the search.
"""

import argparse
import json
import math
import os
import re
import secrets
import shlex
import subprocess
import sys
import tempfile
import time
from collections import defaultdict
from dataclasses import dataclass
from pathlib import Path

from tests.property_profiles import EXPLORE

ROOT = Path(__file__).parent.parent
# A round collects the tests and makes their fixtures again, half a minute, and each round drops
# the tests that failed and changes which tests come last: more of both is not worth more.
ROUND_MINUTES = 15.0
# Hypothesis looks up to five minutes for a smaller example of a failure; one slow test more.
GRACE_SECONDS = 900.0


@dataclass(frozen=True)
class Failure:
    """A test, the seed that it failed with and what it said."""

    test: str
    seed: int
    said: str


@dataclass(frozen=True)
class Tried:
    """What a test did in a round."""

    test: str
    runs: int
    examples: int
    seconds: float


def explore(
    minutes: float, paths: list[str], *, root: Path = ROOT, processes: int = 1, slow: bool = False
) -> tuple[list[Failure], list[Tried]]:
    """Search for ``minutes`` in ``paths`` below ``root``; what failed, once a test, and was tried.

    Each process tries one test at least, and with no time at all one seed of it.
    """
    began = time.time()
    rounds = max(math.ceil(minutes / ROUND_MINUTES), 1)
    failures: list[Failure] = []
    tried: list[Tried] = []
    for n in range(rounds):
        until = began + 60.0 * minutes * (n + 1) / rounds
        words = ["-m", "hypothesis" if slow else "hypothesis and not slow"]
        words += [word for failure in failures for word in ("--deselect", failure.test)]
        found, done = _round(root, until, [*words, *paths], processes)
        failures += found
        tried += done
        print(f"round {n + 1} of {rounds}: {len(found)} tests failed", flush=True)
    return failures, tried


def _round(
    root: Path, until: float, words: list[str], processes: int
) -> tuple[list[Failure], list[Tried]]:
    seed = secrets.randbits(32)
    with tempfile.TemporaryDirectory() as scratch:
        files = [Path(scratch) / f"{part}.jsonl" for part in range(processes)]
        children = []
        for part, to in enumerate(files):
            command = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider"]
            command += ["-p", "tests.explore_plugin", f"--hypothesis-profile={EXPLORE}"]
            command += ["--explore-until", str(until), "--explore-seed", str(seed)]
            command += ["--explore-part", f"{part}/{processes}", "--explore-to", str(to)]
            children.append(_Child([*command, *words], root, to.with_suffix(".txt")))
        failures: list[Failure] = []
        tried: list[Tried] = []
        for child, to in zip(children, files, strict=True):
            ended = child.end(until + GRACE_SECONDS)
            found, done = _read(to, ended, child.output)
            failures += found
            tried += done
    return failures, tried


def environment() -> dict[str, str]:
    """The environment of pytest's processes, which import this package from anywhere."""
    known = os.environ.get("PYTHONPATH")
    return os.environ | {"PYTHONPATH": os.pathsep.join([str(ROOT), *([known] if known else [])])}


class _Child:
    """A pytest process and what it printed."""

    def __init__(self, command: list[str], root: Path, to: Path) -> None:
        self.to = to
        with to.open("w") as output:
            self.process = subprocess.Popen(
                command, cwd=root, env=environment(), stdout=output, stderr=subprocess.STDOUT
            )

    @property
    def output(self) -> str:
        return self.to.read_text(errors="replace")

    def end(self, latest: float) -> str:
        """Wait for it; why its last test is a failure, or nothing."""
        try:
            code = self.process.wait(max(latest - time.time(), 0.0))
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.wait()
            return f"the test did not end within {GRACE_SECONDS:.0f} s after the round's end"
        # 5: this process has no test of its own, because there are fewer files than processes.
        return "" if code in (0, 5) else f"the test's process ended with code {code}"


def _read(file: Path, ended: str, output: str) -> tuple[list[Failure], list[Tried]]:
    lines = [json.loads(line) for line in file.read_text().splitlines()] if file.exists() else []
    if not lines and ended:
        raise SystemExit(f"{output}\nNo test ran: {ended}; its output is above.")
    failures = [
        Failure(one["test"], one["seed"], one["failure"]) for one in lines if "failure" in one
    ]
    tried = [Tried(**one) for one in lines if "runs" in one]
    if ended and "runs" not in lines[-1]:
        failures.append(Failure(lines[-1]["test"], lines[-1]["seed"], f"{ended}\n{output}"))
    return failures, tried


def falsifying_example(said: str) -> str:
    """The lines of a report that state the example; the whole report if it has none."""
    text = re.sub(r"(?m)^E ? ?", "", said)
    head = r"(?ms)^\s*(?:Falsifying example|Failing test case):"
    found = re.search(rf"{head} .*?^\s*\)\s*$", text) or re.search(rf"{head}$.*?teardown\(\)", text)
    return found.group().strip() if found else said


def command_for(failure: Failure) -> str:
    """What shows a failure again: the same seed, the same examples."""
    python = Path(sys.executable)
    shown = python.relative_to(ROOT) if python.is_relative_to(ROOT) else python
    seed = f"--hypothesis-seed={failure.seed}"
    words = [str(shown), "-m", "pytest", failure.test, f"--hypothesis-profile={EXPLORE}", seed]
    return shlex.join(words)


def summary(failures: list[Failure], tried: list[Tried]) -> str:
    """What was tried in each file, then each failure with its example and its command."""
    files: dict[str, list[Tried]] = defaultdict(list)
    for one in tried:
        files[one.test.split("::")[0]].append(one)
    lines = ["tests  seeds  examples  seconds  file"]
    for file, done in sorted(files.items()):
        tests = len({one.test for one in done})
        runs, examples = sum(one.runs for one in done), sum(one.examples for one in done)
        seconds = sum(one.seconds for one in done)
        lines.append(f"{tests:5}  {runs:5}  {examples:8}  {seconds:7.1f}  {file}")
    for n, failure in enumerate(failures, 1):
        lines += ["", f"{n}. {failure.test}", f"seed {failure.seed}"]
        lines += [falsifying_example(failure.said), "Shown again by:", command_for(failure)]
    examples = sum(one.examples for one in tried)
    lines += ["", f"{len(failures)} tests failed; {examples} examples tried"]
    return "\n".join(lines)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--minutes", type=float, default=5.0)
    parser.add_argument("--processes", type=int, choices=(1, 2), default=1)
    parser.add_argument("--slow", action="store_true", help="tests marked slow too")
    parser.add_argument("paths", nargs="*", default=["tests"])
    asked = parser.parse_args()
    failures, tried = explore(
        asked.minutes, asked.paths, processes=asked.processes, slow=asked.slow
    )
    print(summary(failures, tried))
    return 1 if failures else 0


if __name__ == "__main__":
    sys.exit(main())
