"""Lost frames are put down to the line, or to a pause that explains them."""

from types import SimpleNamespace
from typing import Any

import pytest

from scissorcal.device.loop_verdicts import loop_verdicts
from scissorcal.device.timing import Percentiles


@pytest.mark.parametrize(
    ("stalls", "worst_ms", "said"),
    [(0, 2.0, "Check the cable"), (1, 100.0, "Check the cable"), (1, 1000.0, "held up")],
)
def test_lost_frames_are_the_cable_s_unless_a_pause_explains_them(
    stalls: int, worst_ms: float, said: str
) -> None:
    counters = SimpleNamespace(misses=870, frames=5000, faults=0, fallback_frames=0)
    interval = Percentiles(1000.0, 1100.0, 1200.0, 1000.0 * worst_ms)
    report: Any = SimpleNamespace(counters=counters, stalls=stalls, interval=interval)
    verdicts = {v.check: v for v in loop_verdicts("render", report, None, 1000)}
    assert verdicts["misses"].status == "fail"
    assert said in verdicts["misses"].why
