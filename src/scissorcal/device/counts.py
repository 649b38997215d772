"""Rows of what a capture planned, what was recorded of it, and what a fit uses: plain values."""

from dataclasses import dataclass
from typing import ClassVar

EXCITATION_SHARE = 0.95
"""Share of the planned excitation that must be recorded: its ramps are labelled as pauses."""


@dataclass(frozen=True)
class CellCount:
    """One planned cell: direction, speed and range of opening, with seconds needed and recorded.

    ``used_s`` is what the fit uses; None where there is no fit.
    """

    rate_unit: ClassVar[str] = "rad/s"
    unit: ClassVar[str] = "deg"
    of: ClassVar[str] = "opening"
    direction: str
    speed_rad_per_s: float
    opening_deg: tuple[float, float]
    needed_s: float
    recorded_s: float
    used_s: float | None = None

    @property
    def speed(self) -> float:
        return self.speed_rad_per_s

    @property
    def range(self) -> tuple[float, float]:
        return self.opening_deg


@dataclass(frozen=True)
class CarriageCellCount:
    """As CellCount, of the carriage: "forward" or "backward", and a range of the advance."""

    rate_unit: ClassVar[str] = "mm/s"
    unit: ClassVar[str] = "mm"
    of: ClassVar[str] = "advance"
    direction: str
    speed_mm_per_s: float
    advance_mm: tuple[float, float]
    needed_s: float
    recorded_s: float
    used_s: float | None = None

    @property
    def speed(self) -> float:
        return self.speed_mm_per_s

    @property
    def range(self) -> tuple[float, float]:
        return self.advance_mm


@dataclass(frozen=True)
class StrokeCount:
    """Strokes of one kind and speed: planned, recorded whole, and used by the fit."""

    rate_unit: ClassVar[str] = "rad/s"
    kind: str
    speed_rad_per_s: float
    planned: int
    recorded: int
    used: int | None = None

    @property
    def speed(self) -> float:
        return self.speed_rad_per_s


@dataclass(frozen=True)
class CarriageStrokeCount:
    """As StrokeCount, of the carriage: ``kind`` is "forward" or "backward"."""

    rate_unit: ClassVar[str] = "mm/s"
    kind: str
    speed_mm_per_s: float
    planned: int
    recorded: int
    used: int | None = None

    @property
    def speed(self) -> float:
        return self.speed_mm_per_s


AnyCell = CellCount | CarriageCellCount
AnyStrokes = StrokeCount | CarriageStrokeCount


@dataclass(frozen=True)
class SheetCount:
    """Closing strokes through one sheet, numbered across recordings: planned, recorded, used.

    Sheets that the plan has and the recordings lack come last; of sheets beyond the plan's number,
    those with the fewest strokes have none planned.
    """

    sheet: int
    planned: int
    recorded: int
    used: int | None = None


@dataclass(frozen=True)
class ExcitationCount:
    """Seconds of excitation: planned, recorded, and used by the fit."""

    planned_s: float
    recorded_s: float
    used_s: float | None = None

    @property
    def missing(self) -> bool:
        """Whether less is recorded than a whole capture labels."""
        return self.recorded_s < EXCITATION_SHARE * self.planned_s


@dataclass(frozen=True)
class SummaryRow:
    """How many ``unit`` of one motion or sheet are planned, recorded and used, for people."""

    name: str
    unit: str
    planned: int
    recorded: int
    used: int | None
    motion: str = ""


def motion_of(row: AnyCell | AnyStrokes) -> str:
    """A direction and its speed in words; a hand has no planned speed.

    >>> motion_of(CarriageStrokeCount("forward", speed_mm_per_s=5.0, planned=2, recorded=2))
    'forward at 5 mm/s'
    """
    way = row.direction if isinstance(row, AnyCell) else row.kind
    known = row.speed == row.speed
    return f"{way} at {row.speed:g} {row.rate_unit}" if known else f"{way} by hand"
