"""The rig's panel: what the last probe found, and its pushes beside the model."""

from dataclasses import replace

import pytest

from scissorcal.recording import PROBE_KEY, Estimate, ProbeResult, Swing
from scissorcal.report.inputs import RecordingSummary
from scissorcal.report.subjects.rig import rig_panels

EARLY, LATE = "2026-01-02T08:00:00+00:00", "2026-01-02T14:00:00+00:00"


def probed(made_at: str, inertia: float, swings: tuple[Swing, ...] = ()) -> ProbeResult:
    found = Estimate(inertia, 0.1 * inertia)
    return ProbeResult("a rig", "id", made_at, inertia_kg_m2=found, swings=swings)


def recorded(probe: ProbeResult | None) -> RecordingSummary:
    device = {} if probe is None else {PROBE_KEY: probe.as_dict()}
    return RecordingSummary(
        source="a.mcap", content_hash="", kind="friction", joint="rotary", samples=1,
        duration_s=1.0, strokes=(), device=device, recipe_toml="", notes=(),
    )  # fmt: skip


def test_the_latest_probe_is_shown_with_its_interval() -> None:
    (panel,) = rig_panels([recorded(probed(LATE, 3e-4)), recorded(probed(EARLY, 9e-4))])
    assert panel.sentence == f"a rig, probed at {LATE}."
    row = panel.row("inertia")
    assert row is not None
    value = row.value("value")
    assert value is not None
    assert value.number == pytest.approx(300.0)
    assert (value.low, value.high) == pytest.approx((250.7, 349.3), abs=0.1)
    assert panel.row("delay") is None
    assert not panel.charts


def test_pushes_stand_beside_the_model() -> None:
    swing = Swing(0.02, (0.0, 0.001), (0.0, 0.003), (0.0, 0.0029))
    (panel,) = rig_panels([recorded(probed(EARLY, 3e-4, (swing, replace(swing, torque_Nm=-0.02))))])
    (chart,) = panel.charts
    assert [one.name for one in chart.series] == [
        "1: +20 mN m", "1: +20 mN m, model", "2: -20 mN m", "2: -20 mN m, model",
    ]  # fmt: skip
    assert chart.series[0].y == (0.0, 3.0)
    assert chart.series[1].y == (0.0, 2.9)


def test_recordings_without_a_probe_have_no_panel() -> None:
    assert rig_panels([recorded(None)]) == ()
