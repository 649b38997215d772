"""Derivatives by finite differences with Richardson extrapolation, at a polished optimum."""

from collections.abc import Callable

import numpy as np

from scissorcal.aliases import Array


def gradient(function: Callable[[Array], Array], point: Array, step: Array) -> Array:
    """Derivatives of a vector function by each parameter, shape (n, p).

    Central differences at ``step`` and ``step`` / 2, extrapolated to fourth order
    (Richardson 1911, doi:10.1098/rsta.1911.0009). ``step`` has shape (p,).
    """
    columns = []
    for index in range(len(point)):
        reach = np.zeros_like(point)
        reach[index] = step[index]
        wide = (function(point + reach) - function(point - reach)) / (2 * step[index])
        near = (function(point + reach / 2) - function(point - reach / 2)) / step[index]
        columns.append((4 * near - wide) / 3)
    return np.moveaxis(np.stack(columns), 0, -1)


def hessian(
    function: Callable[[Array], float],
    point: Array,
    step: Array,
    many: Callable[[Array], Array] | None = None,
) -> Array:
    """Second derivatives of a scalar function, shape (p, p), of fourth order in ``step`` (p,).

    ``many`` gives the function at points (k, p) at once, shape (k,), where that is cheaper.
    """
    every = many or (lambda points: np.array([function(u) for u in points]))
    wide = _hessian_once(every, point, step)
    near = _hessian_once(every, point, step / 2)
    return (4 * near - wide) / 3


def natural_step(
    function: Callable[[Array], float], point: Array, first: Array, fall: float = 0.3
) -> Array:
    """Steps (p,) over which ``function`` falls by about ``fall`` from its optimum at ``point``.

    Differences at this step rise well above rounding and stay well within the quadratic
    neighbourhood. A parameter on which the function does not depend keeps its ``first`` step.
    """
    value = function(point)
    steps = np.array(first, dtype=np.float64)
    for index in range(len(point)):
        for _ in range(12):
            reach = np.zeros_like(point)
            reach[index] = steps[index]
            lost = value - 0.5 * (function(point + reach) + function(point - reach))
            if not np.isfinite(lost):
                steps[index] *= 0.1
                continue
            if 0.2 * fall < lost < 5 * fall:
                break
            factor = np.sqrt(fall / lost) if lost > 0 else 4.0
            steps[index] = min(steps[index] * float(np.clip(factor, 0.02, 4.0)), first[index])
            if steps[index] == first[index] and lost < fall:
                break
    return steps


def _hessian_once(many: Callable[[Array], Array], point: Array, step: Array) -> Array:
    size = len(point)
    reach = np.diag(step)
    pairs = [(i, j) for i in range(size) for j in range(i)]
    both = [reach[i] + reach[j] for i, j in pairs]
    away = np.vstack([np.zeros((1, size)), reach, *([both] if both else [])])
    values = many(np.vstack([point + away, point - away[1:]]))
    centre, sums = values[0], values[1 : len(away)] + values[len(away) :]
    single = sums[:size]
    result = np.diag((single - 2 * centre) / step**2)
    for (i, j), sum_both in zip(pairs, sums[size:], strict=True):
        mixed = sum_both - single[i] - single[j] + 2 * centre
        result[i, j] = result[j, i] = mixed / (2 * step[i] * step[j])
    return result
