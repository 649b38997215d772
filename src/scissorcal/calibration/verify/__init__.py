"""The trust check: coverage of the intervals, agreement of two halves, prior sensitivity."""

from scissorcal.calibration.verify.check import assess, make_study, tasks_of
from scissorcal.calibration.verify.result import (
    Calibration,
    Check,
    Coverage,
    Halves,
    HalvesRow,
    PriorKind,
    RankBand,
    RankedQuantity,
    Sensitivity,
    SensitivityRow,
    VerifyResult,
)
from scissorcal.calibration.verify.simulator import (
    Simulator,
    cut_simulator,
    friction_simulator,
)
from scissorcal.calibration.verify.study import Study, Task, run

__all__ = [
    "Calibration",
    "Check",
    "Coverage",
    "Halves",
    "HalvesRow",
    "PriorKind",
    "RankBand",
    "RankedQuantity",
    "Sensitivity",
    "SensitivityRow",
    "Simulator",
    "Study",
    "Task",
    "VerifyResult",
    "assess",
    "cut_simulator",
    "friction_simulator",
    "make_study",
    "run",
    "tasks_of",
]
