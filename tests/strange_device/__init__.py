"""A device of other construction, written from docs/protocol.md alone, with faults on request.

It shares no code with scissorcal: own frames, own mechanics, own watchdog, own hand and sheet. It
runs in virtual time (`VirtualPort`, which the product takes as a link) or on a pseudo-terminal in
real time (`serve_on_pty`).

    device = StrangeDevice(FAULTS["motor reversed"], seed=1)
    with open_motion(VirtualPort(device), config) as motion: ...
    device.largest_torque, device.largest_rate
"""

from .device import StrangeDevice
from .faults import FAULTS, Faults
from .person import Person
from .port import VirtualPort
from .terminal import serve_on_pty

__all__ = ["FAULTS", "Faults", "Person", "StrangeDevice", "VirtualPort", "serve_on_pty"]
