"""Plain values between two processes: JSON and raw bytes, nothing that runs when it is read.

A frame is a magic word, the lengths of its JSON head and of each block of bytes, the head, the
blocks. Values are None, bool, int, float, str, bytes, lists, dicts with text as keys, and numeric
arrays; an array is its type and shape in the head, and a block.
"""

import json
import math
import struct
from collections.abc import Callable
from typing import IO, TYPE_CHECKING, Any

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
        if len(sizes) != count or not all(isinstance(one, int) and one >= 0 for one in sizes):
            raise FrameError("blocks without lengths")
    except (ValueError, TypeError, RecursionError) as error:
        raise FrameError("no head") from error
    if sum(sizes) > most_bytes:
        raise MemoryError(f"{sum(sizes)} bytes")
    blocks = [_exactly(read_into, one) for one in sizes]
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
        return [_packed(one, blocks) for one in value]
    if isinstance(value, dict) and all(isinstance(key, str) for key in value):
        return {"dict": {key: _packed(one, blocks) for key, one in value.items()}}
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
        return [_unpacked(one, blocks) for one in tree]
    if not isinstance(tree, dict):
        return tree
    ((kind, content),) = tree.items()
    if kind == "dict":
        return {key: _unpacked(one, blocks) for key, one in content.items()}
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
