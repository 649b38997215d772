"""Parsers that do everything wrong, for the child process of `scissorcal.foreign`."""

import ctypes
import mmap
import os
import tempfile
import time
from typing import Any

import numpy as np

from scissorcal.errors import InputError

_KEPT: list[mmap.mmap] = []


def good(data: bytes, factor: int = 1) -> dict[str, Any]:
    numbers = np.frombuffer(data, np.uint8).astype(np.float64) * factor
    return {"numbers": numbers, "pid": os.getpid(), "text": "µ", "flags": [True, None, 1.5]}


def crash(data: bytes) -> None:
    ctypes.string_at(0)


def abort(data: bytes) -> None:
    os.abort()


def grow(data: bytes) -> int:
    kept = []
    while True:
        kept.append(bytes(50_000_000))


def keep(data: bytes, size: int) -> int:
    """Reserves memory for good, as the pools of some libraries do."""
    _KEPT.append(mmap.mmap(-1, size, flags=mmap.MAP_PRIVATE | mmap.MAP_ANONYMOUS))
    return os.getpid()


def need(data: bytes, size: int) -> int:
    return len(bytes(size))


def large(data: bytes) -> Any:
    return np.zeros(20_000_000)


def spin(data: bytes) -> None:
    while True:
        pass


def wait(data: bytes) -> None:
    time.sleep(100.0)


def fail(data: bytes) -> None:
    raise AttributeError("no such thing\nand more")


def refuse(data: bytes) -> None:
    raise InputError("a.bin has the wrong colour.")


def leave(data: bytes) -> None:
    os._exit(7)


def talk(data: bytes) -> str:
    os.write(1, b"noise of a library")
    os.write(2, b"noise of a library")
    return "said"


def write_a_file(data: bytes) -> None:
    with tempfile.TemporaryFile() as file:
        file.write(b"a")
        file.flush()


def nothing_plain(data: bytes) -> Any:
    return {1, 2}
