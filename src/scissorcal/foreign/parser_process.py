"""The child's side of `parse_isolated`: one request after the other, until the input ends."""

import importlib
import os
import signal
import sys
from pathlib import Path
from typing import IO, Any

from scissorcal.errors import InputError, MissingError
from scissorcal.foreign.plain import read_frame, write_frame

_LARGEST_REQUEST = 4_000_000_000


def serve() -> None:
    """Answer requests on standard input until it ends. Parsers' words go nowhere."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is the parent's
    answers = os.fdopen(os.dup(1), "wb")
    requests = os.fdopen(os.dup(0), "rb", buffering=0)
    write_frame(answers, {"ready": True})
    nowhere = os.open(os.devnull, os.O_RDWR)
    for number in (0, 1, 2):
        os.dup2(nowhere, number)
    _bound_forever()
    while True:
        try:
            request = read_frame(requests.readinto, _LARGEST_REQUEST)
        except EOFError:
            return
        _send(answers, {**_answer(request), "held": _held()})


def _answer(request: dict[str, Any]) -> dict[str, Any]:
    try:
        module, _, name = request["function"].partition(":")
        function = getattr(importlib.import_module(module), name)
        _bound(request["limits"])
        return {"value": function(request.pop("data"), **request["options"])}
    except InputError as error:
        return {"error": "input", "said": str(error)}
    except MissingError as error:
        return {"error": "missing", "said": str(error)}
    except MemoryError:
        return {"error": "memory"}
    except RecursionError:
        return {"error": "other", "said": "nested too deeply"}
    except Exception as error:  # noqa: BLE001 - whatever a parser raises is a fact about the file
        return {"error": "other", "said": _words(error)}


def _send(answers: IO[bytes], answer: dict[str, Any]) -> None:
    try:
        write_frame(answers, answer)
    except MemoryError:
        write_frame(answers, {"error": "memory"})
    except TypeError as error:  # before anything was written: the value is not plain
        write_frame(answers, {"error": "other", "said": _words(error)})


def _words(error: Exception) -> str:
    lines = str(error).strip().splitlines()
    return f"{type(error).__name__}: {lines[0][:200]}" if lines else type(error).__name__


def _bound_forever() -> None:
    """No core dumps, no files written."""
    try:
        import resource
    except ImportError:
        return
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    resource.setrlimit(resource.RLIMIT_FSIZE, (0, 0))


def _bound(limits: dict[str, int]) -> None:
    """Limits of one request: memory beyond what is held now, and processor time from now on.

    What parsers of earlier files reserved and keep (Parquet's 1.1 GB) is not this file's. On
    systems without these limits (Windows) only the parent's limit of time holds.
    """
    try:
        import resource
    except ImportError:
        return
    # what is reserved and never written does not count against DATA, as it does against AS
    memory = resource.RLIMIT_DATA if sys.platform == "linux" else resource.RLIMIT_AS
    used = resource.getrusage(resource.RUSAGE_SELF)
    spent = int(used.ru_utime + used.ru_stime) + 1
    for what, wanted in (
        (memory, _held() + limits["memory"]),
        (resource.RLIMIT_CPU, spent + limits["processor_s"]),
    ):
        _, most = resource.getrlimit(what)
        if most != resource.RLIM_INFINITY:
            wanted = min(wanted, most)
        resource.setrlimit(what, (wanted, most))


def _held() -> int:
    """Bytes that count against RLIMIT_DATA now; 0 on systems that do not tell."""
    if sys.platform != "linux":
        return 0
    pages = int(Path("/proc/self/statm").read_text().split()[5])
    return pages * os.sysconf("SC_PAGE_SIZE")
