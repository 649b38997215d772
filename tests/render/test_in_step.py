"""Rendering through a port by the servo's own process, with a rig that waits for both."""

from pathlib import Path

import numpy as np
import pytest

from scissorcal.device import RigSession, open_link
from scissorcal.kernel import ConfigKey
from scissorcal.package import ModelPackage
from scissorcal.recording import read_recording
from scissorcal.render import Rendering, VirtualStrokes, latency_of, open_writer, render
from tests.device.in_step import in_step, patient


def test_a_port_is_served_by_a_separate_process(
    paper: ModelPackage, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    patient(monkeypatch)
    path = tmp_path / "r.mcap"
    with in_step() as rig, open_link(rig.port) as link:
        with open_writer(RigSession(link, paper.recipe), paper, path) as writer:
            result = render(
                RigSession(link, paper.recipe),
                paper,
                Rendering(2.0, strokes=VirtualStrokes(1, 0.6)),
                writer=writer,
            )
        link.configure(ConfigKey.STREAM, 1.0)
        rig.pass_ticks(1)
        assert link.state().flags & 1 == 0, "the motors stayed on"
    recording = read_recording(path)
    samples = recording.samples
    assert np.all(np.diff(samples["sequence"].astype(np.int64)) == 1)
    assert result.frames >= 1900
    assert result.fallback_frames == 0
    assert result.overrun == 0
    assert result.latency is not None
    assert 0.0 < result.latency.p50 <= result.latency.p99 <= result.latency.worst
    assert latency_of(samples["latency_ns"]) is not None
    assert np.any(samples["torque_command"] != 0.0)
    assert np.all(np.abs(samples["torque_command"]) <= result.limits.torque_Nm)
    assert result.lag.ticks.worst == 1.0
    assert result.lag.ms.p50 > result.lag.ticks.p50
    assert result.rights is not None
    assert {result.lag.sentence, result.rights.sentence} <= set(recording.notes)
