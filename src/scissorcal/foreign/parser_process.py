"""The child's side of `parse_isolated`: one request after the other, until the input ends."""

import importlib
import json
import math
import os
import signal
import struct
import sys
from collections.abc import Callable
from pathlib import Path
from typing import IO, TYPE_CHECKING, Any

from scissorcal.errors import InputError, MissingError

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

MAGIC = b"scPlain1"
_LENGTHS = struct.Struct("<8sIQ")
LARGEST_HEAD = 256_000_000
MOST_BLOCKS = 1_000_000
_NUMERIC = "fiubc"


class FrameError(ValueError):
    """What was sent is no frame, or no value in one."""


def write_frame(stream: IO[bytes], value: Any) -> None:
    """Write a value and flush; TypeError where it is not plain."""
    blocks: list[Any] = []
    tree = _packed(value, blocks)
    head = json.dumps([tree, [memoryview(block).nbytes for block in blocks]]).encode()
    for part in (_LENGTHS.pack(MAGIC, len(blocks), len(head)), head, *blocks):
        left = memoryview(part)
        while left.nbytes:  # a signal may end a write to a pipe in the middle
            left = left[stream.write(left) :]
    stream.flush()


def read_frame(read_into: Callable[[memoryview], int | None], most_bytes: int) -> Any:
    """Read a value; EOFError where the other side has ended, FrameError where it sent no frame.

    ``read_into`` fills a buffer as far as it can. More than ``most_bytes`` are not taken.
    """
    magic, count, size = _LENGTHS.unpack(_exactly(read_into, _LENGTHS.size))
    if magic != MAGIC or size > min(LARGEST_HEAD, most_bytes) or count > MOST_BLOCKS:
        raise FrameError("no frame")
    try:
        tree, sizes = json.loads(bytes(_exactly(read_into, size)))
        if len(sizes) != count or not all(isinstance(size, int) and size >= 0 for size in sizes):
            raise FrameError("blocks without lengths")
    except (ValueError, TypeError, RecursionError) as error:
        raise FrameError("no head") from error
    if sum(sizes) > most_bytes:
        raise MemoryError(f"{sum(sizes)} bytes")
    blocks = [_exactly(read_into, size) for size in sizes]
    try:
        return _unpacked(tree, blocks)
    except (ValueError, TypeError, IndexError, KeyError) as error:
        raise FrameError("no value") from error


def _packed(value: Any, blocks: list[Any]) -> Any:
    if value is None or isinstance(value, bool | int | float | str):
        return value
    if isinstance(value, bytes | bytearray | memoryview):
        blocks.append(value)
        return {"bytes": len(blocks) - 1}
    if isinstance(value, list | tuple):
        return [_packed(item, blocks) for item in value]
    if isinstance(value, dict) and all(isinstance(key, str) for key in value):
        return {"dict": {key: _packed(item, blocks) for key, item in value.items()}}
    if getattr(getattr(value, "dtype", None), "kind", "?") in _NUMERIC:
        return _packed_array(value, blocks)
    raise TypeError(f"{type(value).__name__} is no plain value")


def _packed_array(value: "NDArray[Any] | np.generic", blocks: list[Any]) -> Any:
    import numpy as np

    array = np.asarray(value)
    little = np.require(array, array.dtype.newbyteorder("<"), "C")
    blocks.append(little.reshape(-1).view(np.uint8))
    return {"array": [len(blocks) - 1, little.dtype.str, list(array.shape)]}


def _unpacked(tree: Any, blocks: list[memoryview]) -> Any:
    if isinstance(tree, list):
        return [_unpacked(item, blocks) for item in tree]
    if not isinstance(tree, dict):
        return tree
    ((kind, content),) = tree.items()
    if kind == "dict":
        return {key: _unpacked(item, blocks) for key, item in content.items()}
    if kind == "bytes":
        return bytes(blocks[content])
    return _unpacked_array(content, blocks)


def _unpacked_array(content: Any, blocks: list[memoryview]) -> Any:
    import numpy as np

    index, name, shape = content
    dtype = np.dtype(name)
    if dtype.kind not in _NUMERIC or math.prod(shape) * dtype.itemsize != len(blocks[index]):
        raise FrameError("an array that is not as long as its shape")
    return np.frombuffer(blocks[index], dtype).reshape(shape)


def _exactly(read_into: Callable[[memoryview], int | None], size: int) -> memoryview:
    buffer = memoryview(bytearray(size))
    at = 0
    while at < size:
        count = read_into(buffer[at:])
        if not count:
            raise EOFError
        at += count
    return buffer


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
