"""The doctor measures what is there, and names the remedy for what is wrong."""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from scissorcal.device import doctor as room
from scissorcal.device.doctor import (
    Examination,
    Measurements,
    adapter_timer_ms,
    brake_after_ms,
    clock_drift,
    diagnose,
    examine,
)
from scissorcal.device.link import open_link
from scissorcal.device.lockstep import LockstepLink
from scissorcal.device.sim.process import SimProcess
from scissorcal.device.sim.rig import TICK_S
from scissorcal.device.sim.sensors import Faults
from scissorcal.device.timing import Percentiles
from scissorcal.kernel import Hello, State, decode, encode
from scissorcal.verdicts import failed

GOOD = Percentiles(0.9, 1.2, 1.5, 3.0)
BAD = Percentiles(9.0, 17.0, 18.0, 30.0)
SOUND = Measurements(
    simulated=False,
    tick_ms=1.0,
    round_trip=GOOD,
    round_trips=100,
    unanswered=0,
    interval=GOOD,
    frames=5000,
    lost=0,
    garbled=0,
    drift_ppm=30.0,
    drift_se_ppm=2.0,
    adapter_timer_ms=1.0,
    lateness=Percentiles(0.05, 0.1, 0.2, 5.0),
    timer_resolution_ns=1.0,
    realtime_priority=50,
)


def test_a_healthy_rig_passes_every_check() -> None:
    assert {verdict.status for verdict in diagnose(SOUND, "/dev/ttyUSB0")} == {"pass"}


@pytest.mark.parametrize(
    ("wrong", "check", "remedy"),
    [
        ({"round_trip": BAD}, "round trip", "latency timer to 1 ms"),
        ({"unanswered": 2}, "round trip", "no hub"),
        ({"interval": BAD}, "frame intervals", "latency timer to 1 ms"),
        ({"lost": 50}, "lost frames", "cable"),
        ({"garbled": 1}, "lost frames", "baud rate"),
        ({"adapter_timer_ms": 16.0}, "latency timer", "echo 1 | sudo tee /sys/bus/usb-serial"),
        ({"drift_ppm": -900.0}, "drift", "oscillator"),
        ({"timer_resolution_ns": 4e6}, "resolution", "CONFIG_HIGH_RES_TIMERS"),
        ({"lateness": BAD}, "wake-up lateness", "real-time priority"),
    ],
)
def test_each_problem_fails_its_check_and_names_the_remedy(
    wrong: dict[str, object], check: str, remedy: str
) -> None:
    measured = Measurements(**{**vars(SOUND), **wrong})
    (verdict,) = failed(diagnose(measured, "/dev/ttyUSB0"))
    assert verdict.check == check
    assert remedy in verdict.why


def test_a_busy_computer_fails_no_virtual_rig() -> None:
    busy = replace(
        SOUND,
        simulated=True,
        round_trip=Percentiles.of(np.full(100, 30.0)),
        interval=Percentiles.of(np.full(100, 40.0)),
        lateness=Percentiles.of(np.full(100, 20.0)),
        unanswered=1,
        lost=20,
    )
    verdicts = {verdict.check: verdict for verdict in diagnose(busy, "sim")}
    times = ("round trip", "frame intervals", "lost frames", "wake-up lateness")
    assert {verdicts[name].status for name in times} == {"not_evaluated"}
    assert all("'scissorcal device doctor --device sim' again" in verdicts[n].why for n in times)
    real = {v.check: v.status for v in diagnose(replace(busy, simulated=False), "/dev/ttyUSB0")}
    assert {real[name] for name in times} == {"fail"}


def test_what_was_not_measured_is_not_judged() -> None:
    measured = Measurements(
        **{
            **vars(SOUND),
            "adapter_timer_ms": None,
            "drift_ppm": float("nan"),
            "realtime_priority": 0,
        }
    )
    open_checks = [v.check for v in diagnose(measured, "p") if v.status == "not_evaluated"]
    assert open_checks == ["latency timer", "drift", "real-time rights"]


@pytest.mark.parametrize(
    ("worst_wait", "worst_trip", "recommended"),
    [(0.3, 1.2, 10.0), (8.0, 2.0, 25.0), (20.0, float("nan"), 45.0), (900.0, 1.0, 1000.0)],
)
def test_a_late_computer_needs_a_device_that_waits_longer(
    worst_wait: float, worst_trip: float, recommended: float
) -> None:
    late, trip = Percentiles(0.1, 0.2, 0.3, worst_wait), Percentiles(1.0, 1.0, 1.0, worst_trip)
    measured = Measurements(**{**vars(SOUND), "lateness": late, "round_trip": trip})
    assert brake_after_ms(measured) == recommended


class Listened(LockstepLink):
    """A rig in virtual time with what a port has: round trips, and waits in which states come."""

    def __init__(self, faults: Faults | None = None) -> None:
        super().__init__("office-paper", np.random.default_rng(3), faults)
        self._kept: list[bytes] = []

    def flush(self) -> None:
        """Nothing waits."""

    def keep_streaming(self) -> None:
        self._device.receive(encode(Hello(1)))

    def round_trip(self) -> float:
        self._pass()
        return TICK_S

    def receive(self, timeout: float) -> Iterator[State]:
        for _ in range(max(1, round(timeout / TICK_S))):
            self._pass()
            payloads, self._kept = self._kept, []
            for payload in payloads:
                state = decode(payload)
                assert isinstance(state, State)
                yield state

    def _pass(self) -> None:
        self._kept += self.exchange(None)


def examined(link: Any, seconds: float, monkeypatch: pytest.MonkeyPatch, **how: Any) -> Examination:
    """Examine a rig by its own virtual time; waits of this computer are exact."""
    clock = SimpleNamespace(
        perf_counter=lambda: link.virtual_time,
        clock_getres=lambda which: 1e-9,
        CLOCK_MONOTONIC=0,
    )
    monkeypatch.setattr(room, "time", clock)
    monkeypatch.setattr(room, "select", SimpleNamespace(select=lambda *_: link._pass()))
    return examine(link, seconds, **how)


def test_listening_keeps_the_stream_going(monkeypatch: pytest.MonkeyPatch) -> None:
    """A device streams for 5 s to a host of which it hears nothing."""
    found = examined(Listened(), 6.5, monkeypatch)
    measured = found.measurements
    assert measured.frames == pytest.approx(6500, abs=30)
    assert measured.lost == measured.garbled == measured.unanswered == 0
    assert measured.interval.worst == pytest.approx(1.0)
    assert measured.lateness.worst == pytest.approx(0.0, abs=1e-6)
    assert measured.simulated


def test_a_line_with_losses_fails_its_checks(monkeypatch: pytest.MonkeyPatch) -> None:
    told: list[float] = []
    link = Listened(Faults(drop_share=0.01, garble_share=0.01))
    found = examined(link, 1.0, monkeypatch, progress=lambda done, sentence: told.append(done))
    assert found.measurements.lost > 0
    assert found.measurements.garbled > 0
    assert "lost frames" in {verdict.check for verdict in failed(found.verdicts)}
    assert told == sorted(told)
    assert told[-1] == 1.0


@pytest.mark.realtime
def test_a_served_rig_is_listened_to_for_longer_than_it_streams_unheard() -> None:
    with SimProcess("office-paper", seed=3) as sim, open_link(sim.port) as link:
        found = examine(link, seconds=6.5)
    assert found.measurements.frames > 5600


@pytest.mark.parametrize("true_ppm", [-200.0, 0.0, 30.0, 400.0])
def test_drift_is_found_under_one_sided_jitter(true_ppm: float) -> None:
    rng = np.random.default_rng(7)
    device_us = np.arange(5000) * 1000
    host = device_us * 1e-6 / (1 + true_ppm * 1e-6) + 12.5
    late = rng.exponential(3e-4, 5000) + 0.016 * (rng.random(5000) < 0.02)
    ppm, error = clock_drift(host + late, device_us)
    assert error < 2.0
    assert ppm == pytest.approx(true_ppm, abs=5 * error + 0.5)
    assert np.isnan(clock_drift(host[:50], device_us[:50])[0])


def test_adapter_timer_is_read_from_its_file(tmp_path: Path) -> None:
    folder = tmp_path / "bus/usb-serial/devices/ttyUSB7"
    folder.mkdir(parents=True)
    assert adapter_timer_ms("/dev/ttyUSB7", tmp_path) is None
    (folder / "latency_timer").write_text("16\n")
    assert adapter_timer_ms("/dev/ttyUSB7", tmp_path) == 16.0


@pytest.mark.realtime
def test_a_served_line_with_losses_fails_its_checks() -> None:
    told: list[float] = []
    with (
        SimProcess("office-paper", seed=3, faults=("drop=0.01", "garble=0.01")) as sim,
        open_link(sim.port) as link,
    ):
        found = examine(link, seconds=1.0, progress=lambda done, sentence: told.append(done))
    assert found.measurements.lost > 0
    assert found.measurements.garbled > 0
    assert "lost frames" in {verdict.check for verdict in failed(found.verdicts)}
    assert told == sorted(told)
    assert told[-1] == 1.0
