"""An upload that is torn leaves no package in force, never a half one, and the next one renders."""

import struct
import zlib
from collections.abc import Callable

import numpy as np
import pytest

from scissorcal.kernel import (
    ConfigKey,
    ConfigStatus,
    LoadBegin,
    LoadChunk,
    LoadCommit,
    LoadEcho,
    LoadStatus,
    model_image,
)
from tests.firmware.bench import CHUNK_BYTES, ENABLE, IMAGE_BYTES, Bench, rendering
from tests.firmware.test_rendering import PAPER, PLAIN, closing, loaded, torque_of
from tests.kernel.zoo import make_tables

RELEASE = ENABLE._replace(flags=0)
BEFORE = model_image(PAPER, PLAIN)
IMAGE = model_image(make_tables(kappa=0.4, render_friction=True, rate_damping=0.3), PLAIN)
assert len(IMAGE) == len(BEFORE) > 4 * CHUNK_BYTES

Parts = list[LoadBegin | LoadChunk | LoadCommit]


def parts(image: bytes = IMAGE) -> Parts:
    """What a host sends to load an image."""
    starts = range(0, len(image), CHUNK_BYTES)
    pieces = [image[start : start + CHUNK_BYTES] for start in starts]
    return [
        LoadBegin(1, 0, len(image), zlib.crc32(image)),
        *(LoadChunk(len(p), 0, at, p) for at, p in zip(starts, pieces, strict=True)),
        LoadCommit(0),
    ]


def announced(**changes: int) -> Callable[[], Parts]:
    """Make an upload whose LOAD_BEGIN has other fields."""

    def make() -> Parts:
        begin, *rest = parts()
        assert isinstance(begin, LoadBegin)
        return [begin._replace(**changes), *rest]

    return make


def without(*which: int) -> Callable[[], Parts]:
    """Make an upload without these parts."""
    return lambda: [part for i, part in enumerate(parts()) if i not in which]


LAST = len(parts()) - 2
TORN: dict[str, tuple[Callable[[], Parts], LoadStatus]] = {
    "last piece missing": (without(LAST), LoadStatus.TORN),
    "a piece missing in the middle": (without(2), LoadStatus.TORN),
    "begun as announced, ended by the older one": (
        lambda: [LoadBegin(1, 0, len(IMAGE), zlib.crc32(IMAGE[:192])), parts()[1], LoadCommit(0)],
        LoadStatus.TORN,
    ),
    "no piece": (without(*range(1, LAST + 1)), LoadStatus.TORN),
    "wrong checksum": (announced(crc32=zlib.crc32(IMAGE) ^ 1), LoadStatus.TORN),
    "another image format": (announced(image_format=2), LoadStatus.NOT_ANNOUNCED),
    "tables of another layout": (
        lambda: parts(IMAGE[:4] + struct.pack("<I", 2) + IMAGE[8:]),
        LoadStatus.OTHER_FORMAT,
    ),
    "too large": (announced(size=IMAGE_BYTES + 1), LoadStatus.NOT_ANNOUNCED),
    "cut off after a half": (without(*range(3, LAST + 2)), LoadStatus.OK),
}


def torques(bench: Bench) -> list[float]:
    """Close the blades from rest, and return each tick's torque."""
    return [state.motor_torque for state in closing(bench, 400, ENABLE)]


def rested(bench: Bench) -> Bench:
    """Let the blades rest with the motors off."""
    closing(bench, 1)
    for _ in range(300):
        bench.tick(RELEASE)
    return bench


@pytest.mark.parametrize("what", TORN)
def test_a_torn_upload_renders_nothing_and_the_next_one_renders(what: str) -> None:
    make, status = TORN[what]
    bench = loaded()
    assert torque_of(bench) > 0.01
    bench.tick(RELEASE)
    echoes: list[LoadEcho] = [bench.load(part) for part in make()]
    assert (LoadStatus(echoes[-1].status), echoes[-1].crc32) == (status, 0)
    states = closing(bench, 400, ENABLE)
    assert not any(state.motor_torque or rendering(state) for state in states)
    bench.tick(RELEASE)
    assert bench.configure(ConfigKey.RENDER, 1.0).status == ConfigStatus.VALUE_REFUSED
    assert bench.load(LoadCommit(0)).crc32 == 0

    assert bench.upload(IMAGE).crc32 == zlib.crc32(IMAGE)
    assert not any(torques(bench)), "RENDER is 0 again"
    rested(bench)
    assert bench.configure(ConfigKey.RENDER, 1.0).status == ConfigStatus.OK
    fresh = Bench()
    fresh.upload(IMAGE)
    fresh.configure(ConfigKey.RENDER, 1.0)
    fresh.configure(ConfigKey.STREAM, 1.0)
    again = torques(bench)
    assert again == torques(rested(fresh))
    assert max(again) > 0.01


@pytest.mark.parametrize("what", ["another image format", "too large"])
def test_what_is_refused_when_announced_has_its_reason(what: str) -> None:
    reason = {"too large": LoadStatus.TOO_LARGE}.get(what, LoadStatus.OTHER_FORMAT)
    assert loaded().load(TORN[what][0]()[0]).status == reason


@pytest.mark.parametrize("pieces", [0, 2, LAST])
def test_a_loss_of_power_while_loading_leaves_nothing_to_commit(pieces: int) -> None:
    before, after = Bench(), Bench()
    for part in parts()[: 1 + pieces]:
        assert before.load(part).status == LoadStatus.OK
    for part in parts()[1 + pieces :]:
        echo = after.load(part)
        assert (echo.status, echo.received) == (LoadStatus.NOT_ANNOUNCED, 0)
    assert after.configure(ConfigKey.RENDER, 1.0).status == ConfigStatus.VALUE_REFUSED


def test_pieces_that_come_after_the_commit_change_nothing() -> None:
    bench, other = loaded(), np.random.default_rng(1).bytes(CHUNK_BYTES)
    first = torques(bench)
    bench.tick(RELEASE)
    for offset in range(0, len(BEFORE) + CHUNK_BYTES, CHUNK_BYTES):
        assert bench.load(LoadChunk(CHUNK_BYTES, 0, offset, other)).crc32 == zlib.crc32(BEFORE)
    rested(bench)
    bench.configure(ConfigKey.RENDER, 1.0)
    assert torques(bench) == first
