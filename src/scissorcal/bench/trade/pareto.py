"""The Pareto front: settings that none beats in cost and error at once."""

from collections.abc import Sequence


def pareto_front(costs: Sequence[float], errors: Sequence[float]) -> tuple[bool, ...]:
    """Which of the points (n,) no other one dominates: lower in one, no higher in the other.

    >>> pareto_front([1.0, 2.0, 3.0], [0.5, 0.6, 0.1])
    (True, False, True)
    """
    points = list(zip(costs, errors, strict=True))
    return tuple(
        not any(a <= cost and b <= error and (a, b) != (cost, error) for a, b in points)
        for cost, error in points
    )
