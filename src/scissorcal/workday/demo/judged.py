"""An estimate of the demo beside the truth."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Judged:
    """An estimate in ``unit`` with its 90 % interval, of a fit's parameter or of photographs.

    ``truth`` is None where the chosen law has no such thing.
    """

    name: str
    unit: str
    truth: float | None
    estimate: float
    low: float
    high: float

    @property
    def inside(self) -> bool | None:
        """Whether the truth lies in the interval; None where there is no truth."""
        return None if self.truth is None else self.low <= self.truth <= self.high
