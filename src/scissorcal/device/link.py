"""The link to a rig: open a serial port or pseudo-terminal, shake hands, set values."""

import itertools
import math
import os
import secrets
import select
import time
from collections.abc import Iterator
from contextlib import AbstractContextManager, suppress
from typing import TYPE_CHECKING, Protocol, Self

from scissorcal.device.answers import check_echo, check_identity, key_name, refuse_other_version
from scissorcal.device.ports import (
    MODEM_MANAGER,
    adapter_timer_ms,
    adapter_timer_path,
    modem_manager_runs,
    open_port,
)
from scissorcal.errors import DeviceError
from scissorcal.kernel import (
    Config,
    ConfigEcho,
    FrameDecoder,
    Hello,
    Identity,
    LoadBegin,
    LoadChunk,
    LoadCommit,
    LoadEcho,
    Message,
    State,
    decode,
    encode,
)

if TYPE_CHECKING:
    import serial

DEFAULT_BAUD = 921600
CONFIGURE_ATTEMPTS = 5
CONFIGURE_WAIT_S = 0.2
HELLO_WAIT_S = 0.2
BOOT_S = 4.0
"""Many boards restart when their port is opened (DTR), and have a boot loader that waits for two
seconds; a device then answers within another."""
FIRST_BYTES = 256
TEXT_BYTES, TEXT_SHARE = 16, 0.9
"""So many bytes, and so large a share of printable ones, are text. Of random bytes 0.38 are."""
READ_BYTES = 65536

LoadMessage = LoadBegin | LoadChunk | LoadCommit


class Link(Protocol):
    """What every link to a rig has; see PortLink for a port, LockstepLink for virtual time."""

    @property
    def identity(self) -> Identity: ...

    @property
    def garbled(self) -> int: ...

    def configure(self, key: int, value: float) -> float: ...

    def close(self) -> None: ...


def open_link(port: str, baud: int = DEFAULT_BAUD, timeout: float = BOOT_S) -> "PortLink":
    """Open a port, discard what waits in it, and ask the device for its identity.

    The port is locked against a second user. ``timeout`` (s) bounds the wait for the answer, in
    which a device may boot; the text that it sends meanwhile is discarded. Raises DeviceError, with
    the remedy, where the port is missing, busy or forbidden, where nothing or something else
    answers, and where the device has another wire version or schema.
    """
    link = PortLink(open_port(port, baud), port)
    try:
        link.shake_hands(timeout)
    except BaseException:
        link.close()
        raise
    return link


class PortLink(AbstractContextManager["PortLink"]):
    """A device on a serial port or pseudo-terminal that has answered the handshake."""

    def __init__(self, port: "serial.Serial", name: str) -> None:
        self.name = name
        self.received = FrameDecoder()
        self._port = port
        self._identity: Identity | None = None
        self._first_bytes = b""
        self._garbled_before = 0
        self._nonces = itertools.count(secrets.randbits(32))

    @property
    def identity(self) -> Identity:
        """The identity that the device stated."""
        if self._identity is None:
            raise DeviceError(
                f"{self.name}: call shake_hands() first; the device has not stated its identity."
            )
        return self._identity

    @property
    def garbled(self) -> int:
        """Frames from the device that were discarded since the handshake or the last flush."""
        return self.received.garbled - self._garbled_before

    def fileno(self) -> int:
        """Return the file descriptor, for the servo loop."""
        return int(self._port.fileno())

    def close(self) -> None:
        """Close the port; no error where the port is gone."""
        with suppress(OSError):
            self._port.close()

    def __exit__(self, *_: object) -> None:
        self.close()

    def send(self, message: Message) -> None:
        """Write one message whole. DeviceError if the port is gone or accepts no data for 1 s."""
        data = encode(message)
        while data:
            try:
                if not select.select([], [self.fileno()], [], 1.0)[1]:
                    raise DeviceError(f"{self.name} accepts no data: unplug and replug the device.")
                data = data[os.write(self.fileno(), data) :]
            except (OSError, ValueError) as error:
                raise self._gone() from error

    def receive(self, timeout: float) -> Iterator[Message]:
        """Yield the messages that arrive within ``timeout`` seconds; unreadable ones are skipped.

        Payloads of unknown type are dropped: a newer device may send messages that this host does
        not know.
        """
        for payload in self._payloads(timeout):
            with suppress(ValueError):
                yield decode(payload)

    def configure(self, key: int, value: float) -> float:
        """Set one value and return the value in force; lost frames are sent again.

        Raises DeviceError where the device does not know the key, refuses the value, or does not
        answer.
        """
        for _ in range(CONFIGURE_ATTEMPTS):
            nonce = self._nonce()
            self.send(Config(key, nonce, value))
            for message in self.receive(CONFIGURE_WAIT_S):
                if isinstance(message, ConfigEcho) and message.nonce == nonce:
                    check_echo(self.name, message, key, value)
                    return message.value
        raise DeviceError(
            f"{self.name} did not confirm {key_name(key)} = {value:g} in {CONFIGURE_ATTEMPTS} "
            f"attempts ({self.received.garbled} frames were garbled): check the cable and the "
            "baud rate."
        )

    def load(self, message: LoadMessage) -> LoadEcho:
        """Send a message of an upload, with a nonce of this link, and return the device's answer.

        Lost frames are sent again. Raises DeviceError where the device does not answer.
        """
        for _ in range(CONFIGURE_ATTEMPTS):
            nonce = self._nonce()
            self.send(message._replace(nonce=nonce))
            for reply in self.receive(CONFIGURE_WAIT_S):
                if isinstance(reply, LoadEcho) and reply.nonce == nonce:
                    return reply
        raise DeviceError(
            f"{self.name} did not confirm a part of the package in {CONFIGURE_ATTEMPTS} attempts "
            f"({self.received.garbled} frames were garbled): check the cable and the baud rate."
        )

    def round_trip(self, timeout: float = 0.2) -> float:
        """Seconds from HELLO to IDENTITY, the latency of port and device together; NaN if lost."""
        nonce = self._nonce()
        sent = time.perf_counter()
        self.send(Hello(nonce))
        for message in self.receive(timeout):
            if isinstance(message, Identity) and message.nonce_echo == nonce:
                return time.perf_counter() - sent
        return math.nan

    def keep_streaming(self) -> None:
        """Say HELLO: a device stops streaming to a host of which it hears nothing for 5 s."""
        self.send(Hello(self._nonce()))

    def state(self, timeout: float = 1.0) -> State:
        """Return the next state the device sends (it must be streaming)."""
        for message in self.receive(timeout):
            if isinstance(message, State):
                return message
        raise DeviceError(
            f"{self.name} answers but sent no state for {timeout:g} s: restart the device."
        )

    def flush(self) -> None:
        """Throw away what waits to be read and what has not been sent."""
        import termios

        with suppress(termios.error):
            termios.tcflush(self.fileno(), termios.TCIOFLUSH)
        while select.select([self.fileno()], [], [], 0)[0]:
            if len(self._read()) < READ_BYTES:
                break
        self.received = FrameDecoder()
        self._garbled_before = 0

    def shake_hands(self, timeout: float) -> None:
        """Ask who is there until an answer with the right nonce comes, and check that it fits."""
        self.flush()
        deadline = time.monotonic() + timeout
        frames, first = 0, b""
        while time.monotonic() < deadline:
            nonce = self._nonce()
            self._write_delimiter()
            self.send(Hello(nonce))
            for payload in self._payloads(min(HELLO_WAIT_S, deadline - time.monotonic())):
                frames += 1
                first = first or payload[:8]
                refuse_other_version(self.name, payload)
                with suppress(ValueError):
                    message = decode(payload)
                    if isinstance(message, Identity) and message.nonce_echo == nonce:
                        self._identity = check_identity(self.name, message)
                        self._garbled_before = self.received.garbled  # boot text
                        return
        raise self._no_identity(timeout, frames)

    def _no_identity(self, timeout: float, frames: int) -> DeviceError:
        """The error where no identity came: what was seen first, then what may hold it up."""
        heard = self.received.bytes_received
        text = _boot_text(self._first_bytes)
        if heard == 0:
            seen = (
                f"{self.name} sent nothing within {timeout:g} s of the handshake. Check that the "
                "rig is powered and that this is its port."
            )
        elif frames == 0 and text:
            seen = (
                f"{self.name} sent text ({text!r}) and no valid frame within {timeout:g} s. Either "
                "this is another device, or a board that restarted when its port was opened (DTR) "
                "and did not answer in time: flash the rig's firmware, which must answer HELLO "
                "within a second of power-on, or keep DTR from the board's reset line."
            )
        elif frames == 0:
            seen = (
                f"{self.name} sent {heard} bytes but no valid frame: another device, or another "
                "baud rate. Check the port and the baud rate (921600 by default)."
            )
        else:
            seen = (
                f"{self.name} sends valid frames ({frames}) but does not answer the handshake: "
                "restart the device, and check that its receive line is connected."
            )
        delay_ms = adapter_timer_ms(self.name)
        if delay_ms is not None and delay_ms > 1.0:
            seen += (
                f" Its adapter holds data back for up to {delay_ms:g} ms: echo 1 | sudo tee "
                f"{adapter_timer_path(self.name)}"
            )
        return DeviceError(f"{seen} {MODEM_MANAGER}" if modem_manager_runs() else seen)

    def _payloads(self, timeout: float) -> Iterator[bytes]:
        """Yield payloads until ``timeout``; what has arrived at once is always given whole."""
        deadline = time.monotonic() + timeout
        while True:
            left = max(deadline - time.monotonic(), 0.0)
            try:
                ready = select.select([self.fileno()], [], [], left)[0]
            except (OSError, ValueError) as error:
                raise self._gone() from error
            if not ready:
                return
            data = self._read()
            if self._identity is None and len(self._first_bytes) < FIRST_BYTES:
                self._first_bytes += data[:FIRST_BYTES]
            yield from self.received.feed(data)
            if time.monotonic() > deadline:
                return

    def _read(self) -> bytes:
        try:
            data = os.read(self.fileno(), READ_BYTES)
        except BlockingIOError:
            return b""
        except (OSError, ValueError) as error:
            raise self._gone() from error
        if not data:
            raise self._gone()
        return data

    def _write_delimiter(self) -> None:
        """End an incomplete frame that the device may still hold from an earlier connection."""
        with suppress(BlockingIOError):
            try:
                os.write(self.fileno(), b"\0")
            except BlockingIOError:
                raise
            except (OSError, ValueError) as error:
                raise self._gone() from error

    def _gone(self) -> DeviceError:
        return DeviceError(
            f"{self.name} is gone: the device was unplugged or switched off. Plug it in and start "
            "again."
        )

    def _nonce(self) -> int:
        return next(self._nonces) & 0xFFFFFFFF

    def __enter__(self) -> Self:
        return self


def _boot_text(data: bytes) -> str:
    """The first line of what a device sent, where that is text; else empty.

    >>> _boot_text(b"ESP-ROM:esp32s3-20210327\\r\\nrst:0x1 (POWERON)")
    'ESP-ROM:esp32s3-20210327'
    """
    printable = sum(32 <= byte < 127 or byte in b"\t\r\n" for byte in data)
    if len(data) < TEXT_BYTES or printable < TEXT_SHARE * len(data):
        return ""
    return data.decode("ascii", "replace").strip().splitlines()[0][:60]
