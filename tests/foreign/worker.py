"""A process that reads mutants, one after the other, and says of each how it ended.

    python -m tests.foreign.worker FOLDER [commands]

A line on standard input is the number of a mutant and the name of its format; the answer is a line
of JSON. With "commands" whole commands read the mutants, else the readers alone.
"""

import json
import os
import resource
import sys
import time
import traceback
import warnings
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

from scissorcal.cli.failures import user_error
from scissorcal.foreign import isolated
from tests.foreign.commands import Commands
from tests.foreign.mutations import mutate
from tests.foreign.samples import SAMPLES, Sample

MOST_MEMORY = 3_000_000_000


def serve(folder: Path, by_commands: bool = False) -> None:
    """Answer until the input ends."""
    commands = Commands(folder) if by_commands else None
    whole: dict[str, bytes] = {}
    answers = os.fdopen(os.dup(1), "w", buffering=1)
    os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
    resource.setrlimit(resource.RLIMIT_DATA, (MOST_MEMORY, MOST_MEMORY))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    warnings.simplefilter("ignore")
    for line in sys.stdin:
        number, _, name = line.strip().partition(" ")
        sample = SAMPLES[name]
        path = folder / sample.file
        if name not in whole:
            path.unlink(missing_ok=True)
            sample.make(path)
            whole[name] = path.read_bytes()
            sample.read(path)
        data = mutant(sample, name, whole[name], int(number))
        path.write_bytes(data)
        found = _measured(
            partial(commands.outcome, name, data) if commands else partial(_outcome, sample, path)
        )
        print(json.dumps(found), file=answers)


def mutant(sample: Sample, name: str, data: bytes, number: int) -> bytes:
    """The mutant of a number: of a sample that can be sealed, every other one is sealed."""
    change = partial(mutate, seed=f"{name} {number}")
    return sample.seal(data, change) if sample.seal and number % 2 else change(data)


def _measured(outcome: Callable[[], dict[str, Any]]) -> dict[str, Any]:
    before = _reset_peaks()
    began = time.perf_counter()
    found = outcome()
    found["seconds"] = time.perf_counter() - began
    found["megabytes"] = max(_peak(pid) - start for pid, start in before.items()) / 1e3
    return found


def _outcome(sample: Sample, path: Path) -> dict[str, Any]:
    found: dict[str, Any] = {"code": 0, "said": "", "fault": ""}
    try:
        sample.read(path)
    except BaseException as error:  # noqa: BLE001 - what it is, is the outcome
        known = user_error(error)
        code = known.exit_code if known else 1
        said = str(known or error)
        fault = ""
        if code not in (2, 5):
            fault = "".join(traceback.format_exception(error))[-1500:]
        elif not str(said).startswith(str(path.parent)):
            fault = f"the sentence does not begin with the file: {said[:200]}"
        elif "\n" in said and path.suffix != ".toml":
            fault = f"more than one line: {said[:200]}"
        found = {"code": code, "said": said[:300], "fault": fault}
    return found


def _processes() -> list[str]:
    children = [str(child.pid) for child in isolated.idle_children()]
    return ["self", *children]


def _reset_peaks() -> dict[str, float]:
    """Forget the peaks of this process and its parsers; what each holds now, in kB."""
    found = {}
    for pid in _processes():
        Path(f"/proc/{pid}/clear_refs").write_text("5")
        found[pid] = _peak(pid)
    return found


def _peak(pid: str) -> float:
    try:
        lines = Path(f"/proc/{pid}/status").read_text().splitlines()
    except OSError:  # a parser that died: its limit held
        return 0.0
    return next((float(line.split()[1]) for line in lines if line.startswith("VmHWM")), 0.0)


if __name__ == "__main__":
    serve(Path(sys.argv[1]), "commands" in sys.argv[2:])
