"""A core on a bench: its board, a host that asks, and blades that are where a test puts them."""

import zlib
from dataclasses import replace
from typing import Any

from scissorcal.kernel import (
    IMAGE_FORMAT,
    Capability,
    Command,
    CommandFlag,
    Config,
    ConfigEcho,
    FirmwareBoard,
    FirmwareCore,
    FirmwareInputs,
    FirmwareOutputs,
    FrameDecoder,
    LoadBegin,
    LoadChunk,
    LoadCommit,
    LoadEcho,
    LoadStatus,
    Message,
    State,
    StateFlag,
    decode,
    encode,
)

ENABLE = Command(
    flags=int(CommandFlag.ENABLE), echo_sequence=0, torque=0.0, force=0.0, hold_ticks=0
)
CLEAR = ENABLE._replace(flags=int(CommandFlag.ENABLE | CommandFlag.CLEAR_FAULT))
IMAGE_BYTES = 20 * 1024
CHUNK_BYTES = 192
BOARD = FirmwareBoard(
    "bench", "1", tick_us=1000, capabilities=int(Capability.ADVANCE_MOTOR), torque_limit=2.0,
    opening_min=-0.2, opening_max=1.6, opening_resolution=1e-4, handle_radius=0.06,
    torque_slew=1e6, overspeed=1e3, opening_leap=10.0, torque_per_A=1.0, resistance=0.1,
    current_limit=10.0, current_continuous=5.0, i2t_limit=100.0, supply_min=10.0,
    force_limit=50.0, force_slew=1e6, advance_min=-0.2, advance_max=0.2,
    advance_resolution=1e-6, advance_leap=10.0,
)  # fmt: skip


class Bench:
    """A core with memory for an image; ``board`` as in `BOARD` but for ``changes``."""

    def __init__(self, image_bytes: int = IMAGE_BYTES, **changes: Any) -> None:
        self.core = FirmwareCore(replace(BOARD, **changes), image_bytes)
        self.opening, self.advance = 0.5, -0.02
        self.ticks = 0
        self._decoder = FrameDecoder()
        self.out: FirmwareOutputs = self.tick()[1]

    def tick(self, *messages: Message, flags: int = 0) -> tuple[list[Message], FirmwareOutputs]:
        """Send messages, pass a tick, and return what came back and what the motors do."""
        self.ticks += 1
        inputs = FirmwareInputs(1000 * self.ticks, self.opening, self.advance, flags=flags)
        self.out = self.core.tick(inputs, b"".join(encode(message) for message in messages))
        return [decode(payload) for payload in self._decoder.feed(self.out.sent)], self.out

    def state(self, *messages: Message, flags: int = 0) -> State:
        """The STATE of a tick; streaming must be on."""
        (state,) = (reply for reply in self.tick(*messages, flags=flags)[0] if type(reply) is State)
        return state

    def configure(self, key: int, value: float) -> ConfigEcho:
        """Set a value and return the echo."""
        replies = self.tick(Config(int(key), 1, value))[0]
        (echo,) = (reply for reply in replies if isinstance(reply, ConfigEcho))
        return echo

    def load(self, message: LoadBegin | LoadChunk | LoadCommit) -> LoadEcho:
        """Send a part of an upload and return the echo."""
        (echo,) = (reply for reply in self.tick(message)[0] if isinstance(reply, LoadEcho))
        return echo

    def upload(self, image: bytes, **changes: Any) -> LoadEcho:
        """Load an image; ``changes`` replace fields of LOAD_BEGIN. The first refusal ends it."""
        begin = LoadBegin(IMAGE_FORMAT, 0, len(image), zlib.crc32(image))
        echo = self.load(begin._replace(**changes))
        for offset in range(0, len(image), CHUNK_BYTES):
            piece = image[offset : offset + CHUNK_BYTES]
            if echo.status == LoadStatus.OK:
                echo = self.load(LoadChunk(len(piece), 0, offset, piece))
        return self.load(LoadCommit(0)) if echo.status == LoadStatus.OK else echo


def rendering(state: State) -> bool:
    """Whether a state says that the package gives torque."""
    return bool(state.flags & StateFlag.RENDERING)
