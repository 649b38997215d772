"""Serial ports and pseudo-terminals: open one for a rig, or raise an error with the reason."""

import errno
import os
import time
from contextlib import suppress
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any

from scissorcal.errors import DeviceError, needs_unix

if TYPE_CHECKING:
    import serial

BUSY = (errno.EBUSY, errno.EAGAIN)
BUSY_PATIENCE_S = 0.5


def open_port(port: str, baud: int) -> "serial.Serial":
    """Open a port exclusively, raw, non-blocking, with the adapter's latency at its least.

    A busy port is retried for half a second, until a capture that was killed has released it.
    Raises DeviceError, with what to do next, where it is missing, busy, forbidden or no port.
    """
    if find_spec("termios") is None:
        raise needs_unix(f"A rig on {port}")
    import serial

    patient_until = time.monotonic() + BUSY_PATIENCE_S
    while True:
        try:
            opened = serial.Serial(port, baud, timeout=0, write_timeout=1.0, exclusive=True)
            break
        except (OSError, ValueError) as error:
            if _errno_of(error) not in BUSY or time.monotonic() > patient_until:
                raise DeviceError(_why_not_open(port, baud, error)) from error
        time.sleep(0.02)
    # Adapters hold data back for up to 16 ms unless told not to. What a line has of it counts with
    # the delay that a probe measures: ValueError where a driver or pty has no such setting,
    # NotImplementedError on a system other than Linux.
    with suppress(ValueError, NotImplementedError):
        opened.set_low_latency_mode(True)
    os.set_blocking(opened.fileno(), False)
    return opened


def known_ports() -> tuple[str, ...]:
    """Return the serial ports that this machine has now, sorted.

    Raises DeviceError where the system's ports cannot be listed.
    """
    try:
        from serial.tools import list_ports
    except ImportError as error:
        raise DeviceError(
            f"The ports of this system cannot be listed ({error}): name one with --device."
        ) from None

    return tuple(sorted(info.device for info in list_ports.comports()))


def adapter_timer_ms(port: str, sys_root: Path = Path("/sys")) -> float | None:
    """Latency timer (ms) of the USB adapter behind a port, None where there is none."""
    path = adapter_timer_path(port, sys_root)
    try:
        return float(path.read_text(encoding="ascii"))
    except (OSError, ValueError):
        return None


def adapter_timer_path(port: str, sys_root: Path = Path("/sys")) -> Path:
    """Return the file in which Linux keeps the latency timer of a USB serial adapter."""
    return sys_root / "bus/usb-serial/devices" / Path(port).resolve().name / "latency_timer"


def modem_manager_runs(proc_root: Path = Path("/proc")) -> bool:
    """Whether ModemManager runs, which opens new serial ports and writes to them."""
    for path in proc_root.glob("[0-9]*/comm"):
        with suppress(OSError):  # the process has ended
            if path.read_text(encoding="utf-8", errors="replace").strip() == "ModemManager":
                return True
    return False


MODEM_MANAGER = (
    "ModemManager runs on this computer: it opens a new serial port for up to 30 s and writes to "
    "it. Wait and try again, or have it ignore the rig with the udev rule of docs/protocol.md."
)


def _why_not_open(port: str, baud: int, error: Exception) -> str:
    number = _errno_of(error)
    if number in (errno.ENOENT, errno.ENODEV, errno.ENXIO):
        found = known_ports()
        there = f"Ports found: {', '.join(found)}." if found else "No port was found."
        return f"There is no port {port}. {there} Plug the rig in, or use --device sim."
    if number in (errno.EACCES, errno.EPERM):
        return (
            f"You may not open {port}: join the group that owns it (on most Linux systems "
            "'sudo usermod -aG dialout $USER'), log in again, and retry; or add the udev rule of "
            "docs/protocol.md."
        )
    if number in BUSY and modem_manager_runs():
        return f"{port} is in use by another program. {MODEM_MANAGER}"
    if number in BUSY:
        return f"{port} is in use by another program: close that program first."
    if number in (errno.ENOTTY, errno.EINVAL, errno.EISDIR):
        return f"{port} is not a serial port, or does not support {baud} baud: name the rig's port."
    return f"{port} cannot be opened ({error}): check the cable and the port's name."


def _errno_of(error: BaseException | None) -> int | None:
    """Find the error number, which may be pyserial's own or in an exception that it wraps."""
    while error is not None:
        number: Any = getattr(error, "errno", None)
        if number is None and error.args and isinstance(error.args[0], int):
            number = error.args[0]
        if isinstance(number, int):
            return number
        if "exclusively lock" in str(error):
            return errno.EBUSY
        error = error.__cause__ or error.__context__
    return None
