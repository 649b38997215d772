"""Faults to simulate: lost, garbled or late frames, an unplugged cable, a stuck encoder."""

import math
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from scissorcal.errors import InputError

_KINDS = {
    "drop": "drop_share",
    "garble": "garble_share",
    "delay": "delay_ms",
    "unplug": "unplug_s",
    "stuck-encoder": "stuck_encoder_s",
}
_MEANINGS = (
    "drop=P and garble=P (a share from 0 to 1 of all frames), delay=MS (milliseconds), "
    "unplug=S and stuck-encoder=S (seconds after streaming begins)"
)


@dataclass(frozen=True)
class Faults:
    """Which faults a virtual rig has; none by default.

    ``drop_share`` and ``garble_share`` (0 to 1) are probabilities per frame, either way on the
    line. ``delay_ms`` holds back every frame to the host, as an adapter with a long latency timer
    does. ``unplug_s`` and ``stuck_encoder_s`` count from the first STREAM.
    """

    drop_share: float = 0.0
    garble_share: float = 0.0
    delay_ms: float = 0.0
    unplug_s: float | None = None
    stuck_encoder_s: float | None = None


def parse_faults(options: Iterable[str]) -> Faults:
    """Read faults from words such as ``drop=0.01``; InputError where one is not valid.

    >>> parse_faults(["drop=0.01", "unplug=2.5"])
    Faults(drop_share=0.01, garble_share=0.0, delay_ms=0.0, unplug_s=2.5, stuck_encoder_s=None)
    """
    values: dict[str, float] = {}
    for option in options:
        kind, equals, number = option.partition("=")
        if kind not in _KINDS or not equals:
            raise InputError(f"The fault {option!r} is not known. Give {_MEANINGS}.")
        if _KINDS[kind] in values:
            raise InputError(f"The fault {kind} is given twice: give it once.")
        try:
            value = float(number)
        except ValueError:
            value = math.nan
        highest = 1.0 if kind in ("drop", "garble") else 1e6
        if not 0.0 <= value <= highest:
            raise InputError(
                f"The fault {option!r} needs a number from 0 to {highest:g} after the equals sign: "
                f"give {_MEANINGS}."
            )
        values[_KINDS[kind]] = value
    return Faults(**values)


class FaultyLine:
    """A serial line that drops and garbles frames at random."""

    def __init__(self, faults: Faults, rng: np.random.Generator) -> None:
        self._faults = faults
        self._rng = rng

    def drops(self) -> bool:
        """Whether the next frame is lost."""
        share = self._faults.drop_share
        return share > 0.0 and bool(self._rng.random() < share)

    def garbled(self, data: bytes) -> bytes:
        """The bytes as they arrive: at random with one of them changed."""
        share = self._faults.garble_share
        if not data or share == 0.0 or self._rng.random() >= share:
            return data
        place = int(self._rng.integers(len(data)))
        changed = data[place] ^ int(self._rng.integers(1, 256))
        return data[:place] + bytes([changed]) + data[place + 1 :]
