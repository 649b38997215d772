"""Start a virtual rig in a separate process, and end it in every case."""

import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from importlib.util import find_spec
from pathlib import Path
from select import select
from typing import IO

from scissorcal.errors import DeviceError, InputError, needs_unix

START_TIMEOUT_S = 30.0
STOP_TIMEOUT_S = 5.0


class SimProcess:
    """A virtual rig on a pseudo-terminal, served by another process; a context manager.

    ``specimen`` is a name or a path. The process is started at once; :attr:`port` is its path.
    It ends with :meth:`close`, and when this process ends, even if killed.

    >>> with SimProcess("office-paper", seed=1) as sim:
    ...     sim.port.startswith("/dev/")
    True
    """

    def __init__(self, specimen: str | Path, seed: int = 0, faults: Sequence[str] = ()) -> None:
        """Start it with ``faults`` such as "drop=0.01".

        Raises InputError for a bad specimen or fault, DeviceError if nothing starts.
        """
        if find_spec("termios") is None:
            raise needs_unix("A virtual rig")
        command = [sys.executable, "-m", "scissorcal.device.sim.server", str(specimen)]
        command += [f"--seed={seed}", *(f"--fault={option}" for option in faults)]
        self._errors: IO[bytes] = tempfile.TemporaryFile()  # noqa: SIM115 - closed in close()
        self._process = subprocess.Popen(
            command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=self._errors
        )
        try:
            self.port = self._first_line()
        except BaseException:
            self.close()
            raise

    @property
    def pid(self) -> int:
        """Process id of the server."""
        return self._process.pid

    @property
    def running(self) -> bool:
        """Whether the server still runs; False once its faults have unplugged it."""
        return self._process.poll() is None

    def close(self) -> None:
        """End the server and wait for it; may be called twice."""
        process = self._process
        if process.stdin is not None and not process.stdin.closed:
            process.stdin.close()
        try:
            process.wait(STOP_TIMEOUT_S)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()
        if process.stdout is not None:
            process.stdout.close()
        self._errors.close()

    def __enter__(self) -> "SimProcess":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _first_line(self) -> str:
        stdout = self._process.stdout
        assert stdout is not None
        deadline = time.monotonic() + START_TIMEOUT_S
        while not select([stdout], [], [], 0.05)[0]:
            if time.monotonic() > deadline:
                raise DeviceError(
                    f"The virtual rig did not start within {START_TIMEOUT_S:g} s: close "
                    "programs that load the processor, and start again."
                )
        line = stdout.readline().decode().strip()
        if line:
            return line
        self._process.wait(STOP_TIMEOUT_S)
        self._errors.seek(0)
        said = self._errors.read().decode(errors="replace").strip()
        if self._process.returncode == InputError.exit_code:
            raise InputError(said)
        raise DeviceError(f"The virtual rig did not start. {said}")
