"""What ``scissorcal fit`` was asked for, as every kind of fit takes it."""

from dataclasses import dataclass
from pathlib import Path
from typing import Literal


@dataclass(frozen=True)
class FitRequest:
    """Options of one call of ``scissorcal fit``.

    ``folder`` is the workspace's (None: the current one), ``effort`` None the recipe's;
    ``limit_s`` is the time that each fit may take, in seconds.
    """

    folder: Path | None
    effort: Literal["draft", "standard", "thorough"] | None
    seed: int
    force: bool
    limit_s: float
