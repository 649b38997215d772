"""The served rig, end to end: a real process, a real pseudo-terminal, real frames.

What it serves and when, without a clock: test_serving.py.
"""

import contextlib
import itertools
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from scissorcal.device.link import open_link
from scissorcal.device.sim.process import SimProcess
from scissorcal.errors import DeviceError, InputError
from scissorcal.kernel import ConfigKey, State
from tests.guard import GUARD_S

pytestmark = pytest.mark.skipif(not hasattr(os, "openpty"), reason="needs pseudo-terminals")

COMMAND = [sys.executable, "-m", "scissorcal.device.sim.server", "office-paper"]


def states_in(link: object, seconds: float) -> list[State]:
    states = []
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        states += [m for m in link.receive(0.1) if isinstance(m, State)]  # type: ignore[attr-defined]
    return states


def steps_of(states: list[State]) -> set[int]:
    return {after.sequence - before.sequence for before, after in itertools.pairwise(states)}


def ended(pid: int, seconds: float = GUARD_S) -> bool:
    """Whether a process ends; zombies, which init may reap late, count as ended."""
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        try:
            if Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()[0] == "Z":
                return True
        except OSError:
            return True
        time.sleep(0.02)
    return False


@pytest.mark.realtime
def test_a_day_on_the_pty() -> None:
    with SimProcess("office-paper", seed=3) as sim:
        with open_link(sim.port) as link:
            link.configure(ConfigKey.MATERIAL, 1.0)
            link.configure(ConfigKey.HAND_SPEED_rad_per_s, 1.0)
            link.configure(ConfigKey.STREAM, 1.0)
            states = states_in(link, 0.6)
            assert len(states) > 50
            assert steps_of(states) == {1}
            assert link.received.garbled == 0
        time.sleep(0.05)
        with open_link(sim.port) as link:  # the same rig goes on, and nothing stale arrives
            first = link.state()
            assert first.sequence > states[-1].sequence
        pid = sim.pid
    assert ended(pid)
    assert not sim.running


@pytest.mark.realtime
def test_it_stays_alive_while_a_reader_does_not_read() -> None:
    with SimProcess("office-paper") as sim, open_link(sim.port) as link:
        link.configure(ConfigKey.STREAM, 1.0)
        time.sleep(1.5)
        assert sim.running
        link.flush()
        late = states_in(link, 0.5)
        assert late[-1].sequence > 1_000
        assert min(steps_of(late)) >= 1  # what waited in buffers comes first, in order


@pytest.mark.realtime
def test_a_port_unplugged_in_use_is_a_device_error() -> None:
    with SimProcess("office-paper", faults=["unplug=0.2"]) as sim:
        with open_link(sim.port) as link:
            link.configure(ConfigKey.STREAM, 1.0)
            with pytest.raises(DeviceError, match="is gone"):
                states_in(link, 10.0)
        assert ended(sim.pid)
        assert not Path(sim.port).exists()


def test_it_ends_with_a_killed_parent() -> None:
    parent = subprocess.Popen(
        [
            sys.executable,
            "-c",
            "import sys\n"
            "from scissorcal.device.sim.process import SimProcess\n"
            "sim = SimProcess('office-paper')\n"
            "print(sim.pid, flush=True)\n"
            "sys.stdin.read()\n",
        ],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
    )
    with parent:
        assert parent.stdout is not None
        pid = int(parent.stdout.readline())
        parent.kill()
    assert ended(pid)


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT])
def test_signals_end_it_cleanly(number: int) -> None:
    server = subprocess.Popen(COMMAND, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE)
    assert server.stdout is not None
    with server.stdout as stdout:
        assert stdout.readline().startswith(b"/dev/")
        with contextlib.suppress(subprocess.TimeoutExpired):
            server.wait(0.2)  # a stdin that is no pipe does not end it
        assert server.poll() is None
        server.send_signal(number)
        assert server.wait(GUARD_S) == 0


def test_mistakes_are_reported_before_anything_starts() -> None:
    with pytest.raises(InputError, match="Did you mean"):
        SimProcess("office-papr")
    with pytest.raises(InputError, match="drop=P"):
        SimProcess("office-paper", faults=["dorp=1"])
