"""A person at a strange device who follows what a probe asks."""

from .device import StrangeDevice

HALF_OPEN_RAD = 0.6


class Person:
    """A confirm callback: moves the blades to the stop that a sentence names, and remembers it."""

    def __init__(self, device: StrangeDevice) -> None:
        self._device = device
        self.heard: list[str] = []

    def __call__(self, request: str) -> None:
        self.heard.append(request)
        blades = self._device.blades
        if "close the blades by hand" in request:
            blades.place = blades.low
        elif "open the blades by hand" in request:
            blades.place = blades.high
        elif "half open" in request:
            blades.place = HALF_OPEN_RAD
        blades.rate = 0.0
