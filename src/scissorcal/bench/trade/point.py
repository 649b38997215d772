"""What a benchmark measures: samples, and the points that repeats of a setting make."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from statistics import median
from typing import Any

TIMES_S = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9}
"""Units of time, in seconds: costs in these are also given as multiples of the baseline step."""


@dataclass(frozen=True)
class Quantity:
    """A measured number with its unit."""

    value: float
    unit: str


@dataclass(frozen=True)
class Error:
    """An error against the reference: ``value`` in ``unit``, which is empty for a plain ratio.

    ``share`` is the error as a share of the scene's largest torque (of the largest force for a
    linear joint), None where the error is not one of torque. ``guarded`` errors are needed over
    allowed: no setting is recommended where one is above 1 and above that of the present setting.
    Settings of larger size need less. The value of a guarded error is infinite where nothing is
    allowed and NaN where it is not known; `Point.unbounded` then has it in words.
    """

    value: float
    unit: str
    share: float | None = None
    guarded: bool = False


@dataclass(frozen=True)
class Setting:
    """One position of a knob.

    ``label`` names it within its knob, ``size`` places it among the others. Settings of equal
    ``method`` are joined by a line. ``value`` is what the knob itself needs to apply it; plain
    values only, which pickle and JSON hold. ``present`` marks what the workspace uses now.
    ``accuracy`` orders settings by how good a reference they are: the errors of a knob are counted
    against the measured setting of the highest accuracy above 0 that fails no check which the
    present one passes. ``remark`` is said with the recommendation of the setting.
    """

    label: str
    size: float
    value: Any = None
    method: str = ""
    present: bool = False
    accuracy: int = 0
    remark: str = ""


@dataclass(frozen=True)
class Sample:
    """One repeat of one setting, as a knob measures it.

    ``costs`` by name. ``outcome`` is what errors are counted from: plain values only (numbers,
    words, lists, objects; None for a number that does not exist), so that a killed run can go on.
    ``rejected`` names the checks that failed: a setting that fails one which the present setting
    passes is not recommended.
    """

    costs: Mapping[str, Quantity]
    outcome: Mapping[str, Any]
    notes: tuple[str, ...] = ()
    rejected: tuple[str, ...] = ()


@dataclass(frozen=True)
class Spread:
    """Median, lowest and highest of the repeats, in ``unit``.

    ``ratio`` is the median over the baseline step that the same run timed; None where the cost is
    not a time.
    """

    median: float
    low: float
    high: float
    unit: str
    repeats: int = 1
    ratio: float | None = None

    @property
    def words(self) -> str:
        """The median with its unit, in three digits.

        >>> Spread(11140.0, 1.0, 1.0, "").words, Spread(2.4382, 1.0, 1.0, "min").words
        ('11,100', '2.44 min')
        """
        value = float(f"{self.median:.3g}")
        text = f"{value:,.0f}" if abs(value) >= 1000.0 else f"{value:.3g}"
        return f"{text} {self.unit}".rstrip()

    @classmethod
    def of(cls, values: Sequence[Quantity], baseline_s: float | None = None) -> "Spread":
        """Summarise repeats, all of one unit.

        >>> Spread.of([Quantity(2.0, "s"), Quantity(4.0, "s"), Quantity(3.0, "s")], 0.5)
        Spread(median=3.0, low=2.0, high=4.0, unit='s', repeats=3, ratio=6.0)
        """
        numbers = [value.value for value in values]
        unit, middle = values[0].unit, float(median(numbers))
        ratio = None
        if baseline_s and unit in TIMES_S:
            ratio = middle * TIMES_S[unit] / baseline_s
        return cls(middle, min(numbers), max(numbers), unit, len(numbers), ratio)


@dataclass(frozen=True)
class NextCapture:
    """What a setting gives on the next capture, by so many simulated ``captures``.

    In shares of the scene's largest torque: the limits that the worst error of the torque against
    the truth (``error``), and how much larger it is than with the present setting (``loss``, 0
    where it is not larger), do not exceed on 9 of 10 captures.
    """

    captures: int
    error: float
    loss: float


@dataclass(frozen=True)
class Point:
    """A setting as it was measured: costs with their spread, errors (median of the repeats).

    ``failed`` says why the setting gave nothing, empty where it did; ``front`` marks the Pareto
    front, ``recommended`` the setting that the recommendation names, ``reference`` the one that
    errors are counted against, ``rejected`` the checks that failed. ``unbounded`` are the guarded
    errors that have no number, in words: infinite, or not known. A setting that has one and is of
    a smaller size than the present one is not recommended. ``next_capture`` is None where no
    capture was simulated with the setting.
    """

    setting: Setting
    costs: Mapping[str, Spread]
    errors: Mapping[str, Error]
    failed: str = ""
    front: bool = False
    recommended: bool = False
    reference: bool = False
    notes: tuple[str, ...] = ()
    rejected: tuple[str, ...] = ()
    unbounded: tuple[str, ...] = ()
    next_capture: NextCapture | None = None


@dataclass(frozen=True)
class Curve:
    """All points of one knob, and what to say of them.

    ``cost`` and ``error`` name the main cost and the main error, the axes of the diagram.
    ``against`` says in words what the errors are counted against. ``missing`` says why the scene
    does not have the knob, empty where it does; ``unmeasured`` are the labels that the budget left
    out. ``sentences`` are the recommendations.
    """

    knob: str
    title: str
    cost: str
    error: str
    points: tuple[Point, ...] = ()
    against: str = ""
    missing: str = ""
    unmeasured: tuple[str, ...] = ()
    sentences: tuple[str, ...] = field(default=())
