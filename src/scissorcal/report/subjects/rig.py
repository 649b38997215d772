"""The rig as the latest probe in the recordings found it, and its pushes beside the model."""

from __future__ import annotations

import math
from collections.abc import Sequence

from scissorcal.recording.probe import ESTIMATES, FACTS, Estimate, ProbeResult, Swing, newest_probe
from scissorcal.recording.recording import Recording
from scissorcal.report.panel import (
    Axis,
    Chart,
    Look,
    Panel,
    Row,
    Series,
    Value,
    curve,
    number,
    points,
)

ID, PART, TITLE = "provenance-rig", "provenance", "The rig as it was probed"
LOOKS: tuple[Look, ...] = ("blue", "vermillion", "green", "purple", "orange", "ink")


def rig_panels(recordings: Sequence[Recording]) -> tuple[Panel, ...]:
    """What the latest probe in the recordings says; none where none was probed."""
    last = newest_probe(recording.device for recording in recordings)
    return () if last is None else (rig_panel(last),)


def rig_panel(probe: ProbeResult) -> Panel:
    """Estimates with their intervals, the facts that people ask for, pushes beside the model."""
    values = [
        (name, _estimated(estimate, scale, unit))
        for name, key, scale, unit in ESTIMATES
        if (estimate := getattr(probe, key)) is not None
    ]
    values += [
        (name, number("value", scale * probe.facts[key], unit))
        for name, key, scale, unit in FACTS
        if math.isfinite(probe.facts.get(key, math.nan))
    ]
    rows = tuple(Row(name, (value,)) for name, value in values)
    sentence = f"{probe.device}, probed at {probe.made_at}."
    return Panel(
        ID, PART, TITLE, sentence, rows, _charts(probe), caption="Estimates: intervals of 90 %."
    )


def _estimated(estimate: Estimate, scale: float, unit: str) -> Value:
    mean, sd, low, high = (scale * v for v in (estimate.mean, estimate.sd, *estimate.interval))
    return number("value", mean, unit, sd=sd, low=low, high=high)


def _charts(probe: ProbeResult) -> tuple[Chart, ...]:
    if not probe.swings:
        return ()
    chart = Chart(
        "provenance-rig-swings",
        "Pushes of the probe",
        Axis("time", "ms"),
        Axis("opening, from where it stood", "mrad"),
        tuple(
            series
            for place, (swing, look) in enumerate(zip(probe.swings, LOOKS, strict=False), start=1)
            for series in _series(place, swing, look)
        ),
        "The strongest pushes of the probe, as the encoder showed them (marks), and as the fitted "
        "joint goes (lines).",
    )
    return (chart,)


def _series(place: int, swing: Swing, look: Look) -> tuple[Series, Series]:
    times = [1e3 * value for value in swing.times_s]
    name = f"{place}: {1e3 * swing.torque_Nm:+.3g} mN m"
    places = [1e3 * value for value in swing.places_rad]
    goes = [1e3 * value for value in swing.model_rad]
    return points(name, times, places, look), curve(f"{name}, model", times, goes, look)
