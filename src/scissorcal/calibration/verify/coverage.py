"""Do intervals hold the truth as often as they say? Simultaneous bands over all of them."""

from collections.abc import Mapping
from dataclasses import dataclass

from scissorcal.calibration.verify.rank_tests import acceptance


@dataclass(frozen=True)
class Held:
    """How often the intervals of one parameter at one level held the truth, and its band.

    ``low`` and ``high`` are shares of the fits; ``inside`` says whether ``share`` lies between.
    """

    parameter: str
    level: float
    share: float
    low: float
    high: float

    @property
    def inside(self) -> bool:
        """Whether the share is one that right intervals may have."""
        return self.low <= self.share <= self.high


def judge_coverage(
    held: Mapping[str, Mapping[float, int]], fits: int, false_alarm: float = 0.05
) -> tuple[Held, ...]:
    """Hold counts of intervals that contain the truth against simultaneous binomial bands.

    ``held`` gives, by parameter and level (0.5, 0.9), in how many of ``fits`` independent fits the
    interval held the truth. Each of the m counts gets a two-sided band of level 1 - false_alarm / m
    (Bonferroni), so that right intervals leave any of the bands with probability ``false_alarm`` at
    most, however the parameters depend on one another. ValueError where a count exceeds ``fits`` or
    there is none.

    >>> found = judge_coverage({"force": {0.5: 150, 0.9: 250}}, 300)
    >>> [(row.level, round(row.low, 2), round(row.high, 2), row.inside) for row in found]
    [(0.5, 0.44, 0.56, True), (0.9, 0.86, 0.94, False)]
    """
    rows = [(name, level, count) for name, by in held.items() for level, count in by.items()]
    if not rows or fits < 1 or any(not 0 <= count <= fits for _, _, count in rows):
        raise ValueError(
            f"Counts must be given, each from 0 to the number of fits, which is {fits}."
        )
    found = []
    for name, level, count in rows:
        low, high = acceptance(fits, level, false_alarm / len(rows))
        found.append(Held(name, level, count / fits, low, high))
    return tuple(found)
