"""Load the image of a package into a device that renders by itself, and check what it holds."""

import zlib
from typing import Protocol, runtime_checkable

from scissorcal.device.link import Link, LoadMessage
from scissorcal.errors import DeviceError
from scissorcal.kernel import (
    IMAGE_FORMAT,
    Capability,
    Command,
    ConfigKey,
    Identity,
    LoadBegin,
    LoadChunk,
    LoadCommit,
    LoadEcho,
    LoadStatus,
)

CHUNK_BYTES = 192
FROM_HOST = "leave --on-device out to render from this computer"


@runtime_checkable
class Loading(Protocol):
    """A link to a device that may take an image."""

    @property
    def identity(self) -> Identity: ...

    def send(self, message: Command) -> None: ...

    def load(self, message: LoadMessage) -> LoadEcho: ...


class ShowShare(Protocol):
    """Called with the share done (0 to 1) and a sentence."""

    def __call__(self, done: float, sentence: str, /) -> None: ...


def refuse_without_rendering(identity: Identity) -> None:
    """Raise DeviceError where a device does not render by itself."""
    if not identity.capabilities & Capability.RENDERS:
        raise DeviceError(
            f"{identity.name} {identity.serial} does not render by itself (its identity lacks "
            f"RENDERS): {FROM_HOST}, or flash a firmware that does (firmware/README.md)."
        )


def load_image(link: Link, image: bytes, tell: ShowShare) -> int:
    """Have the device hold an image in force, and return the checksum that both have of it.

    The motors are switched off first: a host that was cut off leaves ENABLE in force, and also
    after the watchdog's fault the device would refuse. A device that holds the image already is
    sent no piece of it. ``tell`` is called after each piece. Raises DeviceError, with what to do,
    where the device refuses the image or holds another one afterwards.
    """
    refuse_without_rendering(link.identity)
    if not isinstance(link, Loading):
        raise TypeError(f"A {type(link).__name__} loads nothing.")
    wanted = zlib.crc32(image)
    link.send(Command(0, 0, 0.0, 0.0))
    if in_force(link) != wanted:
        _send(link, image, wanted, tell)
    held = in_force(link)
    if held != wanted:
        raise DeviceError(
            f"{_name(link)} holds another package than the one that was sent (checksum "
            f"{held:08x}, sent {wanted:08x}): restart the device, and start again."
        )
    return wanted


def end_rendering(link: Link) -> None:
    """Set RENDER = 0 where a device renders by itself.

    A rendering that was cut off leaves RENDER at 1, and the package's torque would add to the
    commands of what runs next.
    """
    if link.identity.capabilities & Capability.RENDERS:
        link.configure(ConfigKey.RENDER, 0.0)


def in_force(link: Loading) -> int:
    """Checksum of the image that a device holds in force, 0 without one."""
    return link.load(LoadCommit(0)).crc32


def _send(link: Loading, image: bytes, checksum: int, tell: ShowShare) -> None:
    begin = LoadBegin(image_format=IMAGE_FORMAT, nonce=0, size=len(image), crc32=checksum)
    _confirmed(link, link.load(begin), image)
    for offset in range(0, len(image), CHUNK_BYTES):
        piece = image[offset : offset + CHUNK_BYTES]
        chunk = LoadChunk(count=len(piece), nonce=0, offset=offset, bytes=piece)
        _confirmed(link, link.load(chunk), image)
        tell((offset + len(piece)) / len(image), "loading the package into the device")
    _confirmed(link, link.load(LoadCommit(0)), image)


def _confirmed(link: Loading, echo: LoadEcho, image: bytes) -> None:
    """Raise DeviceError with the reason and the remedy unless the device took a message."""
    if echo.status == LoadStatus.OK:
        return
    again = "start again"
    forgot = f"it restarted meanwhile. Check its supply, and {again}"
    if echo.received:  # a restart would have left it at 0
        forgot = (
            f"it refused what it had of it ({echo.received} bytes), and its answer was lost or "
            f"went to another program. Check the cable, close other programs, and {again}"
        )
    why: dict[int, str] = {
        LoadStatus.NOT_ANNOUNCED: f"knows of no package that is being loaded: {forgot}",
        LoadStatus.OTHER_FORMAT: "renders packages of another layout than this scissorcal's "
        f"({IMAGE_FORMAT}): update its firmware, or {FROM_HOST}",
        LoadStatus.TOO_LARGE: f"has room for {echo.capacity} bytes, and the package needs "
        f"{len(image)}: build the package with a larger tolerance, or {FROM_HOST}",
        LoadStatus.OUT_OF_ORDER: f"has {echo.received} bytes of the package, and not those before "
        f"the next piece: another program loads one, too. Close it, and {again}",
        LoadStatus.TORN: f"received the package torn: check the cable, and {again}",
        LoadStatus.NOT_SOUND: "found numbers in the package that no model has: update its "
        f"firmware, or {FROM_HOST}",
        LoadStatus.BUSY: f"loads no package while its motors are on: another program drives "
        f"them. Close it, and {again}",
    }
    unknown = f"refused the package with status {echo.status}: {FROM_HOST}"
    raise DeviceError(f"{_name(link)} {why.get(echo.status, unknown)}.")


def _name(link: Loading) -> str:
    return f"{link.identity.name} {link.identity.serial}"
