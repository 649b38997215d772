"""What a long recording costs: memory in proportion to it, and no pass over it for each stroke."""

import dataclasses
import tracemalloc

import numpy as np
import pytest

from scissorcal.calibration import between, fit_friction
from scissorcal.calibration.friction import columns
from scissorcal.recipe import FitFriction
from scissorcal.recording import Recording
from tests.calibration.truth import SPEEDS, Truth, friction_recording

LONG = 3
MOST_BYTES = 600
"""Memory that a sample more may take. It takes 480; it took 830 while columns of all nodes, sorted
copies of them and a mask for each stroke were kept."""


def longer(recording: Recording, times: int) -> Recording:
    """The recording so many times, one after the other, with other noise each time."""
    rng, count = np.random.default_rng(4), len(recording.strokes)
    parts = [recording.samples.copy() for _ in range(times)]
    clock = recording.samples["device_time_us"]
    for k, part in enumerate(parts):
        part["device_time_us"] += k * (clock[-1] - clock[0] + clock[1] - clock[0])
        part["motor_torque"] += 3e-4 * rng.standard_normal(len(part))
        part["stroke"] = np.where(part["stroke"] >= 0, part["stroke"] + k * count, -1)
    strokes = tuple(
        dataclasses.replace(stroke, index=stroke.index + k * count)
        for k in range(times)
        for stroke in recording.strokes
    )
    return dataclasses.replace(recording, samples=np.concatenate(parts), strokes=strokes)


@pytest.fixture(scope="module")
def short() -> Recording:
    made = friction_recording(Truth(), np.random.default_rng(1), SPEEDS[-3:])
    return dataclasses.replace(made, device={"name": "made"})


@pytest.fixture(scope="module")
def long(short: Recording) -> Recording:
    return longer(short, LONG)


def fit(recording: Recording, **settings) -> None:
    one = FitFriction(law="stribeck+angle", symmetry="asymmetric", **settings)
    fit_friction((recording,), one, effort="draft", rng=np.random.default_rng(2))


def test_a_sample_more_takes_little_memory(short, long, monkeypatch):
    """The limit of what is kept of columns is made as small as the recording is short."""
    monkeypatch.setattr(columns, "MOST_BYTES", 1e5)
    peaks = []
    fit(short)  # what is imported and made once is not counted
    for recording in (short, long):
        tracemalloc.start()
        fit(recording)
        peaks.append(tracemalloc.get_traced_memory()[1])
        tracemalloc.stop()
    more = len(long.samples) - len(short.samples)
    assert peaks[1] - peaks[0] < MOST_BYTES * more


def test_more_strokes_need_no_more_passes_and_few_more_refits(short, long, monkeypatch):
    clock, refit = Recording.device_time_s.fget, between.search_from
    counted = {"clock": 0, "refits": 0}

    def read(self):
        counted["clock"] += 1
        return clock(self)

    def search(*given):
        counted["refits"] += 1
        return refit(*given)

    monkeypatch.setattr(Recording, "device_time_s", property(read))
    monkeypatch.setattr(between, "search_from", search)
    monkeypatch.setattr(between, "MOST_GROUPS", 2 * len(short.strokes))
    found = []
    for recording in (short, long):
        counted.update(clock=0, refits=0)
        fit(recording, critic=False)
        found.append(dict(counted))
    assert found[1]["clock"] == found[0]["clock"]
    assert found[1]["refits"] <= 2 * len(short.strokes) < len(long.strokes)
