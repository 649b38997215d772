"""The rig as the latest probe in the recordings found it, and its pushes beside the model."""

from __future__ import annotations

from collections.abc import Sequence

from scissorcal.recording.probe import ESTIMATES, Estimate, ProbeResult, Swing, newest_probe
from scissorcal.report.inputs import RecordingSummary
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


def rig_panels(recordings: Sequence[RecordingSummary]) -> tuple[Panel, ...]:
    """What the latest probe in the recordings says; none where none was probed."""
    last = newest_probe(one.device for one in recordings)
    if last is None:
        return ()
    rows = [
        _row(name, found, scale, unit)
        for name, key, scale, unit in ESTIMATES
        if isinstance(found := getattr(last, key), Estimate)
    ]
    said = f"{last.device}, probed at {last.made_at}."
    shown = _charts(last)
    return (Panel(ID, PART, TITLE, said, tuple(rows), shown, caption="Intervals of 90 %."),)


def _row(name: str, found: Estimate, scale: float, unit: str) -> Row:
    low, high = found.interval
    told: Value = number(
        "value", scale * found.mean, unit, sd=scale * found.sd, low=scale * low, high=scale * high
    )
    return Row(name, (told,))


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
    seen = [1e3 * value for value in swing.places_rad]
    goes = [1e3 * value for value in swing.model_rad]
    return points(name, times, seen, look), curve(f"{name}, model", times, goes, look)
