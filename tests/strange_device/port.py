"""A strange device in virtual time, as a link that scissorcal takes."""

from scissorcal.device import check_echo, check_identity
from scissorcal.errors import DeviceError
from scissorcal.kernel import Config, ConfigEcho, Hello, Identity, LoadEcho, decode, encode

from . import wire
from .device import StrangeDevice

ASK_AGAIN_TICKS = 200
ATTEMPTS = 5


class VirtualPort:
    """One exchange, one tick. The handshake and settings are the product's own messages."""

    def __init__(self, device: StrangeDevice) -> None:
        self.device = device
        self.name = "The strange device"
        self._splitter = wire.Splitter()
        self._nonce = 0
        answer = self._ask(lambda nonce: encode(Hello(nonce=nonce)), Identity)
        assert isinstance(answer, Identity)
        self.identity: Identity = check_identity(self.name, answer)

    @property
    def virtual_time(self) -> float:
        return self.device.time_s

    @property
    def garbled(self) -> int:
        return self._splitter.garbled

    def exchange(self, command_frame: bytes | None) -> list[bytes]:
        """Send a frame (or none), pass a tick, return the STATE payloads that arrive."""
        if self.device.unplugged:
            raise DeviceError(f"{self.name} was unplugged.")
        found = self._splitter.payloads(self.device.tick(command_frame or b""))
        return [payload for payload in found if payload[0] == wire.STATE]

    def configure(self, key: int, value: float) -> float:
        """Set a value of the device and return the value in force."""
        answer = self._ask(lambda nonce: encode(Config(int(key), nonce, float(value))), ConfigEcho)
        assert isinstance(answer, ConfigEcho)
        check_echo(self.name, answer, int(key), float(value))
        return float(answer.value)

    def load(self, message: object) -> LoadEcho:
        """It renders nothing itself."""
        raise DeviceError(f"{self.name} takes no package.")

    def close(self) -> None:
        """Nothing to release."""

    def _ask(self, question, kind):  # type: ignore[no-untyped-def]
        for _ in range(ATTEMPTS):
            self._nonce += 1
            sent = question(self._nonce)
            for _ in range(ASK_AGAIN_TICKS):
                for payload in self._splitter.payloads(self.device.tick(sent)):
                    reply = decode(payload) if payload[0] != wire.STATE else None
                    if isinstance(reply, kind):
                        return reply
                sent = b""
        raise DeviceError(f"{self.name} does not answer.")
