"""The rungs of the ladder that were compared, and what choosing another would cost."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from scissorcal.calibration.result import FitResult
from scissorcal.report.numbers import Number, finite


@dataclass(frozen=True)
class RungRow:
    """One rung: ``bic_excess`` is its BIC above the lowest, ``held_out_rms`` in the effort unit.

    ``held_out_score`` is the log density of unseen strokes, higher where they are predicted better;
    ``loo`` the same by the posterior without each stroke (PSIS), with its standard error.
    ``equivalent`` rungs cannot be told from the best.
    """

    name: str
    parameters: int | None
    bic: Number
    bic_excess: Number
    held_out_rms: Number
    held_out_score: Number
    loo: Number
    loo_se: Number
    equivalent: bool
    chosen: bool


def compare_rungs(fit: FitResult) -> tuple[RungRow, ...]:
    """Rungs in the fit's order, cheapest first."""
    values = [finite(rung.get("bic")) for rung in fit.rungs]
    lowest = min((value for value in values if value is not None), default=None)
    return tuple(_row(rung, lowest) for rung in fit.rungs)


def _row(rung: Mapping[str, Any], lowest: Number) -> RungRow:
    bic = finite(rung.get("bic"))
    excess = None if bic is None or lowest is None else bic - lowest
    count = finite(rung.get("parameters"))
    return RungRow(
        str(rung.get("name", "unnamed")),
        None if count is None else int(count),
        bic,
        excess,
        finite(rung.get("held_out_rms")),
        finite(rung.get("held_out_score")),
        finite(rung.get("loo")),
        finite(rung.get("loo_se")),
        bool(rung.get("equivalent", rung.get("chosen", False))),
        bool(rung.get("chosen", False)),
    )
