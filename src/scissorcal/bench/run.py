"""How a benchmark was run."""

from dataclasses import dataclass
from datetime import datetime


@dataclass(frozen=True)
class Run:
    """Facts about a run that its jobs do not tell; ``budget_s`` is None where time was no limit."""

    created: datetime
    version: str
    machine: str
    workers: int
    seed: int
    seconds: float
    planned: int
    budget_s: float | None = None
