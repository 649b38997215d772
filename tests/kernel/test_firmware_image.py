"""The image of a package in the firmware: what it refuses, and steps as the kernel makes them."""

import struct
import zlib
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from scissorcal.kernel import (
    STEP_DTYPE,
    Capability,
    ConfigKey,
    ConfigStatus,
    Hello,
    Identity,
    Kernel,
    LoadBegin,
    LoadChunk,
    LoadCommit,
    LoadEcho,
    LoadStatus,
    PassivityConfig,
    ServoConfig,
    model_image,
)
from scissorcal.kernel import tables as layout
from scissorcal.kernel._firmware import ffi, lib
from tests.firmware.bench import ENABLE, Bench
from tests.kernel.golden import model_cases
from tests.kernel.zoo import make_tables

DRIVE = ServoConfig(
    torque_limit=0.7, torque_slew=150.0, force_limit=9.0, force_slew=80.0, ramp_s=0.25,
    rate_cutoff_Hz=90.0, motor_sign=-1,
    passivity=PassivityConfig(
        is_measured=True, rig_damping=0.002, rig_coulomb=0.013, margin_J=1e-4, most_damping=0.02,
        friction_width=0.004,
    ),
)  # fmt: skip
CASES = model_cases()


def opened(image: bytes) -> tuple[int, Any, Any]:
    """The status of an image in memory of its size, its view, and the memory to keep."""
    memory, view = ffi.new("float[]", max(1, len(image) // 4)), ffi.new("fw_image *")
    ffi.memmove(memory, image, len(image) // 4 * 4)
    return int(lib.fw_image_open(memory, len(image) // 4 * 4, view)), view, memory


@pytest.mark.parametrize("name", CASES)
def test_the_image_holds_the_model_of_the_kernel(name: str) -> None:
    tables = CASES[name][0]
    status, view, _memory = opened(model_image(tables, DRIVE))
    assert status == LoadStatus.OK
    mine, (own, _keep) = view.model, layout.model_struct(tables)
    for field, _ in ffi.typeof("sc_model").fields:
        if field not in layout.TABLE_NAMES:
            assert getattr(mine, field) == getattr(own, field), field
    for table in layout.TABLE_NAMES:
        size = getattr(own, table).size
        assert getattr(mine, table).size == size
        for row in ("x", "y", "slope", *(("area",) if table == "response" else ())):
            here, there = getattr(getattr(mine, table), row), getattr(getattr(own, table), row)
            assert list(here[0:size]) == list(there[0:size])
    for field, _ in ffi.typeof("fw_drive").fields:
        home = DRIVE.passivity if hasattr(DRIVE.passivity, field) else DRIVE
        assert getattr(view.drive, field) == np.float32(getattr(home, field)), field


@pytest.mark.parametrize("name", CASES)
def test_steps_are_those_of_the_kernel_bit_for_bit(name: str) -> None:
    """10,000 random states, the crack going on from one to the next; a fresh sheet every 100."""
    tables = CASES[name][0]
    rng = np.random.default_rng(len(name))
    opening = rng.uniform(tables.opening_min - 0.05, tables.opening_max + 0.05, 10_000)
    rate, advance = rng.normal(0.0, 1.0, 10_000), rng.uniform(-0.07, 0.01, 10_000)
    columns = [np.ascontiguousarray(c, dtype=np.float32) for c in (opening, rate, advance)]
    _, view, _memory = opened(model_image(tables, DRIVE))
    kernel, model = Kernel(tables), ffi.addressof(view, "model")
    touching = 0
    for start in range(0, 10_000, 100):
        part = [column[start : start + 100] for column in columns]
        kernel.reset(0.0)
        expected = kernel.step_many(*part)
        found = np.zeros(100, dtype=STEP_DTYPE)
        lib.sc_model_step_many(
            model,
            ffi.new("sc_crack *"),
            100,
            *(ffi.from_buffer("float[]", column) for column in part),
            ffi.from_buffer("sc_step_output[]", found, require_writable=True),
        )
        assert found.tobytes() == expected.tobytes()
        touching += int(np.count_nonzero(found["torque"]))
    assert touching > 100


def test_an_image_is_put_in_force_and_named_by_its_checksum() -> None:
    bench, image = Bench(), model_image(make_tables(), DRIVE)
    assert bench.configure(ConfigKey.RENDER, 1.0).status == ConfigStatus.VALUE_REFUSED
    echo = bench.upload(image)
    assert (echo.status, echo.crc32, echo.received) == (0, zlib.crc32(image), len(image))
    assert bench.load(LoadCommit(0)).crc32 == zlib.crc32(image)
    assert bench.configure(ConfigKey.RENDER, 1.0).status == ConfigStatus.OK
    (identity,) = (r for r in bench.tick(Hello(1))[0] if isinstance(r, Identity))
    assert identity.capabilities & Capability.RENDERS


def test_a_core_without_memory_refuses_an_upload() -> None:
    bench = Bench(image_bytes=0)
    (echo,) = bench.tick(LoadCommit(0))[0]
    assert echo == LoadEcho(LoadStatus.NOT_ANNOUNCED, 0, received=0, capacity=0, crc32=0)
    assert bench.configure(ConfigKey.RENDER, 1.0).status == ConfigStatus.UNKNOWN_KEY
    (identity,) = (r for r in bench.tick(Hello(1))[0] if isinstance(r, Identity))
    assert not identity.capabilities & Capability.RENDERS


def changed(at: int, value: bytes) -> Callable[[bytes], bytes]:
    return lambda image: image[:at] + value + image[at + len(value) :]


REFUSED = {
    "another magic": (changed(0, b"XXXX"), LoadStatus.OTHER_FORMAT),
    "another layout": (changed(4, struct.pack("<I", 2)), LoadStatus.OTHER_FORMAT),
    "another order of bytes": (changed(12, struct.pack(">f", 1.0)), LoadStatus.OTHER_FORMAT),
    "a wrong size": (changed(8, struct.pack("<I", 8)), LoadStatus.TORN),
    "too many knots": (changed(16, struct.pack("<I", 257)), LoadStatus.TORN),
    "one knot": (changed(20, struct.pack("<I", 1)), LoadStatus.TORN),
    "another number of knots": (changed(24, struct.pack("<I", 9)), LoadStatus.TORN),
    "its end missing": (lambda image: image[:-4], LoadStatus.TORN),
    "nothing but a header": (lambda image: image[:148], LoadStatus.TORN),
    "half a header": (lambda image: image[:80], LoadStatus.TORN),
    "nothing": (lambda image: b"", LoadStatus.TORN),
    "three blades": (changed(36, struct.pack("<I", 3)), LoadStatus.NOT_SOUND),
    "no number in a table": (changed(160, struct.pack("<f", np.nan)), LoadStatus.NOT_SOUND),
    "a limit below 0": (changed(96, struct.pack("<f", -1.0)), LoadStatus.NOT_SOUND),
    "a sign of 0": (changed(144, struct.pack("<f", 0.0)), LoadStatus.NOT_SOUND),
}


@pytest.mark.parametrize("what", REFUSED)
def test_an_image_is_refused_with(what: str) -> None:
    change, status = REFUSED[what]
    image = change(model_image(make_tables(), DRIVE))
    bench = Bench()
    echo = bench.upload(image)
    assert (LoadStatus(echo.status), echo.crc32) == (status, 0)
    assert bench.configure(ConfigKey.RENDER, 1.0).status == ConfigStatus.VALUE_REFUSED


def test_damaged_images_are_opened_without_reading_beyond_them() -> None:
    """Random bytes changed and ends cut off: a status, or a model that is sound."""
    image, rng = bytearray(model_image(make_tables(), DRIVE)), np.random.default_rng(4)
    for _ in range(500):
        other = bytearray(image[: rng.integers(0, len(image) + 1) if rng.random() < 0.3 else None])
        for at in rng.integers(0, max(1, len(other)), size=rng.integers(1, 6)):
            other[at : at + 1] = bytes([rng.integers(0, 256)])
        status, view, _memory = opened(bytes(other))
        if status == LoadStatus.OK:
            assert lib.sc_model_is_sound(ffi.addressof(view, "model"))


def test_a_torn_upload_leaves_nothing_in_force() -> None:
    bench, image = Bench(), model_image(make_tables(), DRIVE)
    assert bench.upload(image).crc32
    assert bench.upload(image, crc32=zlib.crc32(image) ^ 1).status == LoadStatus.TORN
    assert bench.load(LoadCommit(0)).status == LoadStatus.NOT_ANNOUNCED
    assert bench.load(LoadCommit(0)).crc32 == 0
    begin = LoadBegin(1, 0, len(image), zlib.crc32(image))
    assert bench.load(begin).status == LoadStatus.OK
    assert bench.load(LoadChunk(192, 0, 0, image[:192])).received == 192
    assert bench.load(LoadCommit(0)).status == LoadStatus.TORN


def test_pieces_come_in_order_and_may_come_again() -> None:
    bench, image = Bench(), model_image(make_tables(), DRIVE)
    assert bench.load(LoadChunk(192, 0, 0, image[:192])).status == LoadStatus.NOT_ANNOUNCED
    bench.load(LoadBegin(1, 0, len(image), zlib.crc32(image)))
    for count, offset in ((192, 192), (0, 0), (193, 0)):
        piece = image[offset : offset + min(count, 192)]
        assert bench.load(LoadChunk(count, 0, offset, piece)).status == LoadStatus.OUT_OF_ORDER
    for _ in range(2):
        echo = bench.load(LoadChunk(192, 0, 0, image[:192]))
        assert (echo.status, echo.received) == (LoadStatus.OK, 192)
    beyond = LoadChunk(192, 0, len(image) - 100, bytes(192))
    assert bench.load(beyond).status == LoadStatus.OUT_OF_ORDER


def test_what_does_not_fit_or_is_of_another_layout_is_refused_when_announced() -> None:
    image = model_image(make_tables(), DRIVE)
    bench = Bench(image_bytes=len(image) - 4)
    echo = bench.upload(image)
    assert (echo.status, echo.capacity) == (LoadStatus.TOO_LARGE, len(image) - 4)
    assert bench.upload(image, image_format=2).status == LoadStatus.OTHER_FORMAT


def test_the_largest_model_has_the_size_that_is_stated() -> None:
    assert lib.FW_IMAGE_MOST_BYTES == 4 * (37 + 16 * 256) == 16532


def test_nothing_is_loaded_while_the_motors_are_on() -> None:
    bench, image = Bench(), model_image(make_tables(), DRIVE)
    checksum = bench.upload(image).crc32
    bench.tick(ENABLE)
    for message in (LoadBegin(1, 0, 4, 0), LoadChunk(4, 0, 0, bytes(4)), LoadCommit(0)):
        bench.tick(ENABLE)
        echo = bench.load(message)
        assert (echo.status, echo.crc32) == (LoadStatus.BUSY, checksum)
    bench.tick(ENABLE._replace(flags=0))
    assert bench.load(LoadCommit(0)).status == LoadStatus.OK
