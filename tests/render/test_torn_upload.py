"""An upload that is torn is named with its cause and remedy, and the next one succeeds."""

import zlib
from collections.abc import Callable

import numpy as np
import pytest

from scissorcal.device import LockstepLink, in_force, load_image
from scissorcal.errors import DeviceError
from scissorcal.kernel import (
    IMAGE_FORMAT,
    Command,
    CommandFlag,
    ConfigKey,
    Drive,
    LoadBegin,
    LoadChunk,
    LoadCommit,
    LoadEcho,
    encode,
)
from scissorcal.package import ModelPackage, image_of
from tests.render.test_on_device import PLAIN, RenderingSide, device

LoadMessage = LoadBegin | LoadChunk | LoadCommit
Load = Callable[[LoadMessage], LoadEcho]


class TornLink(LockstepLink):
    """A link that passes messages of an upload through ``tear``, with the way to the device."""

    tear: Callable[[LoadMessage, Load], LoadEcho] | None = None

    def load(self, message: LoadMessage) -> LoadEcho:
        return super().load(message) if self.tear is None else self.tear(message, super().load)


def damaged(message: LoadMessage, load: Load) -> LoadEcho:
    """Flip a bit of the first piece."""
    if isinstance(message, LoadChunk) and message.offset == 0:
        message = message._replace(bytes=bytes([message.bytes[0] ^ 1]) + message.bytes[1:])
    return load(message)


class Swallowed:
    """Pieces from one on do not arrive, and are confirmed all the same."""

    def __init__(self, first: int) -> None:
        self.first, self.echo = first, LoadEcho(0, 0, 0, 0, 0)

    def __call__(self, message: LoadMessage, load: Load) -> LoadEcho:
        if not isinstance(message, LoadChunk) or message.offset < self.first:
            self.echo = load(message)
        return self.echo


def another_format(message: LoadMessage, load: Load) -> LoadEcho:
    """Announce what a later scissorcal would."""
    is_begin = isinstance(message, LoadBegin)
    return load(message._replace(image_format=IMAGE_FORMAT + 1) if is_begin else message)


class Asked:
    """Damaged, and the answer to the first commit of the whole is lost."""

    begun = False

    def __call__(self, message: LoadMessage, load: Load) -> LoadEcho:
        self.begun |= isinstance(message, LoadBegin)
        if isinstance(message, LoadCommit) and self.begun:
            load(message)
        return damaged(message, load)


class Interrupted:
    """Before the third piece something else happens to the device."""

    def __init__(self, event: Callable[[Load], object]) -> None:
        self.event = event

    def __call__(self, message: LoadMessage, load: Load) -> LoadEcho:
        if isinstance(message, LoadChunk) and message.offset == 2 * len(message.bytes):
            self.event(load)
        return load(message)


def enable(side: RenderingSide) -> None:
    side.receive(encode(Command(int(CommandFlag.ENABLE), 0, 0.0, 0.0, 0)))
    side.tick()


TEARS: dict[str, tuple[Callable[[RenderingSide], Callable[[LoadMessage, Load], LoadEcho]], str]] = {
    "a piece is damaged": (lambda _: damaged, "received the package torn: check the cable"),
    "the end is missing": (lambda _: Swallowed(200), "received the package torn: check the cable"),
    "no piece comes": (lambda _: Swallowed(0), "received the package torn: check the cable"),
    "another format": (
        lambda _: another_format,
        "another layout than this scissorcal's .1.: update its firmware, or leave --on-device out",
    ),
    "damaged, and the answer is lost": (
        lambda _: Asked(),
        r"it refused what it had of it \(\d+ bytes\), and its answer was lost .* Check the cable",
    ),
    "a restart": (
        lambda side: Interrupted(lambda _: side.power_on()),
        "it restarted meanwhile. Check its supply, and start again",
    ),
    "another program": (
        lambda _: Interrupted(lambda load: load(LoadBegin(IMAGE_FORMAT, 0, 400, 1))),
        "has 0 bytes of the package, .*: another program loads one, too. Close it",
    ),
    "motors on": (
        lambda side: Interrupted(lambda _: enable(side)),
        "loads no package while its motors are on: another program drives them. Close it",
    ),
}


@pytest.mark.parametrize("what", TEARS)
def test_a_torn_upload_is_named_with_its_remedy_and_the_next_one_succeeds(
    paper: ModelPackage, what: str
) -> None:
    tear, sentence = TEARS[what]
    link, side = device(link=TornLink)
    before, image = image_of(paper, PLAIN), image_of(paper)
    load_image(link, before, lambda *_: None)
    link.configure(ConfigKey.RENDER, 1.0)
    link.tear = tear(side)
    with pytest.raises(DeviceError, match=sentence):
        load_image(link, image, lambda *_: None)
    link.tear = None
    assert in_force(link) == 0
    with pytest.raises(DeviceError, match="refused"):
        link.configure(ConfigKey.RENDER, 1.0)
    assert load_image(link, image, lambda *_: None) == zlib.crc32(image)
    link.configure(ConfigKey.RENDER, 1.0)


@pytest.mark.parametrize("silent_ticks", [1, 100, 6000])
def test_a_host_that_was_cut_off_with_the_motors_on_leaves_a_device_that_loads(
    paper: ModelPackage, silent_ticks: int
) -> None:
    """ENABLE stands, under the watchdog's fault, too, until another COMMAND comes."""
    link, side = device()
    load_image(link, image_of(paper, PLAIN), lambda *_: None)
    enable(side)
    for _ in range(silent_ticks):
        side.tick()
    assert side.drawn.drive[-1] is (Drive.DRIVE if silent_ticks == 1 else Drive.BRAKE)
    assert load_image(link, image_of(paper), lambda *_: None) == in_force(link)
    assert side.drawn.drive[-1] is not Drive.DRIVE


def test_a_package_with_numbers_that_no_model_has_is_refused(paper: ModelPackage) -> None:
    link, _ = device()
    image = bytearray(image_of(paper, PLAIN))
    image[96:100] = np.float32(-1.0).tobytes()  # a limit
    with pytest.raises(DeviceError, match="found numbers in the package that no model has: update"):
        load_image(link, bytes(image), lambda *_: None)
    assert in_force(link) == 0
