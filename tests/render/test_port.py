"""Rendering through a real pseudo-terminal, in real time. No time is asserted.

Without a clock: test_in_step.py and, in virtual time, test_engine.py and test_plate_rendering.py.
"""

import time
from pathlib import Path

import numpy as np
import pytest

from scissorcal.device import Operator, RigSession, SimProcess, open_link
from scissorcal.kernel import ConfigKey
from scissorcal.package import ModelPackage
from scissorcal.recording import read_recording
from scissorcal.render import Rendering, VirtualStrokes, latency_of, open_writer, render
from tests.render.plate_motion import Move, Tracker

pytestmark = pytest.mark.realtime


def test_a_port_is_served_by_a_separate_process(paper: ModelPackage, tmp_path: Path) -> None:
    path = tmp_path / "r.mcap"
    with SimProcess("office-paper", seed=1) as sim, open_link(sim.port) as link:
        link.configure(ConfigKey.BRAKE_AFTER_MS, 500.0)  # a busy machine is not what is tested
        with open_writer(RigSession(link, paper.recipe), paper, path) as writer:
            result = render(
                RigSession(link, paper.recipe),
                paper,
                Rendering(3.0, strokes=VirtualStrokes(1, 0.6)),
                writer=writer,
            )
        link.configure(ConfigKey.STREAM, 1.0)
        assert link.state().flags & 1 == 0, "the motors stayed on"
    recording = read_recording(path)
    assert result.frames >= 2500
    assert result.latency is not None
    assert 0.0 < result.latency.p50 <= result.latency.p99 <= result.latency.worst
    assert latency_of(recording.samples["latency_ns"]) is not None
    assert np.any(recording.samples["torque_command"] != 0.0)
    assert np.all(np.abs(recording.samples["torque_command"]) <= result.limits.torque_Nm)
    assert result.lag.ticks.p50 >= 1.0
    assert result.lag.ms.p50 > result.lag.ticks.p50
    assert result.rights is not None
    assert {result.lag.sentence, result.rights.sentence} <= set(recording.notes)


def test_a_supervisor_that_is_slow_for_a_moment_changes_nothing(paper: ModelPackage) -> None:
    slept: list[float] = []

    def slow_once(done: float, sentence: str) -> None:
        if not slept:
            slept.append(done)
            time.sleep(0.6)  # three times the servo's patience

    with SimProcess("office-paper", seed=1) as sim, open_link(sim.port) as link:
        link.configure(ConfigKey.BRAKE_AFTER_MS, 500.0)
        strokes = VirtualStrokes(1, 0.6)
        result = render(
            RigSession(link, paper.recipe, Operator(progress=slow_once)),
            paper,
            Rendering(2.0, strokes=strokes),
        )
    assert slept
    assert result.fallback_frames == 0
    assert result.overrun == 0


def test_an_estimated_plate_is_followed_through_a_port(upper_paper: ModelPackage) -> None:
    """The source is asked with the host's clock, some hundred times a second."""
    face = upper_paper.tables.upper_face
    tracker = Tracker(Move((0.0, face, 0.0)), np.random.default_rng(1))
    with SimProcess("office-paper", seed=1) as sim, open_link(sim.port) as link:
        link.configure(ConfigKey.BRAKE_AFTER_MS, 500.0)
        before_s = time.monotonic()
        strokes = VirtualStrokes(1, 0.6)
        result = render(
            RigSession(link, upper_paper.recipe),
            upper_paper,
            Rendering(3.0, strokes=strokes),
            plate=tracker,
        )
    assert before_s < tracker.asked_s < time.monotonic()
    assert result.plate is not None
    assert result.plate.estimates > 100
    assert tracker.samples > 2000
    assert result.largest_torque_Nm > 0.01
