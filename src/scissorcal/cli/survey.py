"""The look at each channel of a log, in lines: of ``import`` and of ``summarise``."""

from typing import TYPE_CHECKING

from scissorcal.cli.output import table

if TYPE_CHECKING:
    from scissorcal.calibration.signals.survey import Survey


def survey_lines(found: "Survey") -> list[str]:
    """Rate and sensors, for people; angles in deg."""
    import math

    gaps = found.gaps
    lost = f"{gaps.missing} samples missing in {gaps.places} gaps" if gaps.places else "no gap"
    head = (
        f"rate: {found.rate_Hz:.4g} Hz; {found.interval_low_ms:.4g} to "
        f"{found.interval_high_ms:.4g} ms between samples (5 to 95 %), longest "
        f"{found.longest_ms:.4g} ms; {lost}"
    )
    rows = [["sensor", "unit", "step", "lowest", "highest", "cut off low", "high", "dead band"]]
    for one in found.sensors:
        unit, factor = ("deg", 180.0 / math.pi) if one.unit == "rad" else (one.unit, 1.0)
        values = [f"{factor * value:.4g}" for value in (one.low, one.high)]
        step = "constant" if one.constant else f"{factor * one.step:.3g}" if one.step else "none"
        shares = [f"{share:.1%}" for share in (one.at_low, one.at_high, one.dead)]
        rows.append([one.channel, unit, step, *values, *shares])
    return [head, table(rows, right=range(2, 8))]
