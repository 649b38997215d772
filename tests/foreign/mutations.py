"""Changes of a file's bytes, as damage and malice make them; each follows from its seed alone."""

import random
import re
from collections.abc import Callable

NUMBERS = (b"1e308", b"-1", b"0", b"nan", b"inf", b"1e-300", b"9" * 400, b"9" * 6000, b"0x7f", b"")
EXTREMES = (0, 1, 2**15, 2**16 - 1, 2**31 - 1, 2**31, 2**32 - 1, 2**62, 2**63 - 1, 2**64 - 1)
MARKS = b'{}[]()<>,:;="&*!%#\n\t\x00\x1b\xff'


def mutate(data: bytes, seed: str) -> bytes:
    """Change bytes in one to four ways; the same seed gives the same bytes."""
    rng = random.Random(seed)
    for _ in range(rng.choice((1, 1, 1, 2, 4))):
        data = rng.choice(WAYS)(data, rng) if data else data
    return data


def _flip(data: bytes, rng: random.Random) -> bytes:
    changed = bytearray(data)
    for _ in range(rng.choice((1, 1, 2, 8, 64))):
        changed[_place(changed, rng)] ^= 1 << rng.randrange(8)
    return bytes(changed)


def _cut(data: bytes, rng: random.Random) -> bytes:
    at = _place(data, rng)
    return data[:at] if rng.random() < 0.7 else data[at:]


def _insert(data: bytes, rng: random.Random) -> bytes:
    at = _place(data, rng)
    size = rng.choice((1, 2, 8, 100, 5000))
    kind = rng.random()
    new = rng.randbytes(size) if kind < 0.5 else bytes([rng.choice(MARKS)]) * size
    return data[:at] + new + data[at:]


def _remove(data: bytes, rng: random.Random) -> bytes:
    at = _place(data, rng)
    return data[:at] + data[at + rng.choice((1, 2, 4, 8, 64, 1000)) :]


def _splice(data: bytes, rng: random.Random) -> bytes:
    """A block of the file over, or between, other bytes of it."""
    start, at = _place(data, rng), _place(data, rng)
    block = data[start : start + rng.choice((4, 16, 64, 512, 4096))]
    over = len(block) if rng.random() < 0.5 else 0
    return data[:at] + block + data[at + over :]


def _length(data: bytes, rng: random.Random) -> bytes:
    """A number of two, four or eight bytes at an extreme, or off by a little."""
    size = rng.choice((2, 4, 8))
    at = _place(data, rng)
    order = rng.choice(("little", "big"))
    now = int.from_bytes(data[at : at + size], order)  # type: ignore[arg-type]
    wanted = rng.choice(EXTREMES) if rng.random() < 0.6 else now + rng.choice((-8, -1, 1, 8, 256))
    new = (wanted % 2 ** (8 * size)).to_bytes(size, order)  # type: ignore[arg-type]
    return data[:at] + new + data[at + size :]


def _number(data: bytes, rng: random.Random) -> bytes:
    """A number in text becomes another one."""
    found = list(re.finditer(rb"-?\d+\.?\d*(?:[eE][-+]?\d+)?", data[:200_000]))
    if not found:
        return _flip(data, rng)
    one = rng.choice(found)
    return data[: one.start()] + rng.choice(NUMBERS) + data[one.end() :]


def _deepen(data: bytes, rng: random.Random) -> bytes:
    at = _place(data, rng)
    return data[:at] + rng.choice((b"[", b"{", b"<a>", b'{"a":')) * 20_000 + data[at:]


def _repeat(data: bytes, rng: random.Random) -> bytes:
    at = _place(data, rng)
    return data[:at] + data[at : at + rng.choice((1, 9, 50, 200))] * 500 + data[at:]


WAYS: tuple[Callable[[bytes, random.Random], bytes], ...] = (
    _flip,
    _flip,
    _cut,
    _insert,
    _remove,
    _splice,
    _length,
    _length,
    _number,
    _deepen,
    _repeat,
)


def _place(data: bytes | bytearray, rng: random.Random) -> int:
    """Anywhere; half of the time in the first or last 2 kB, where formats keep their structure."""
    last = len(data) - 1
    kind = rng.random()
    if kind < 0.35:
        return rng.randint(0, min(last, 2000))
    if kind < 0.5:
        return rng.randint(max(0, last - 2000), last)
    return rng.randint(0, last)
