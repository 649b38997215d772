"""A response law of one's own, as the spline that fits, proofs and tables work with."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Protocol, runtime_checkable

import numpy as np

from scissorcal.aliases import Array
from scissorcal.errors import InputError, ModelError
from scissorcal.model.checks import LARGEST, SMALLEST
from scissorcal.model.response import Response
from scissorcal.model.stated_numbers import as_pair

MOST_KNOTS = 16
"""What a manifest stores of a spline."""

FEWEST_KNOTS = 4
FIT_SPAN = (0.02, 20.0)
"""Indentations of a law in a fit, in multiples of the reference: what lies below carries no force
that is felt, and a cut does not reach beyond."""

SLOPES = (1e-3, 1e2)
"""Exponents that a trial of a search is held to; a law that falls is refused before."""

PLACES = 20
"""Places between two knots at which the spline is compared with the law."""


@runtime_checkable
class ResponseLaw(Protocol):
    """A law of the force at the edge against the indentation: a class with two methods.

    ``parameters`` gives what the law depends on, each above 0: a number, or a number and its
    standard deviation. ``force_N`` gives the force at the indentations (m), an array, for values of
    these by name; it must rise, and be above 0 where the indentation is.

    >>> class Hertz:
    ...     def parameters(self):
    ...         return {"modulus_Pa": (2e6, 2e5), "radius_m": 1e-4}
    ...     def force_N(self, indentation_m, modulus_Pa, radius_m):
    ...         return 16 / 9 * modulus_Pa * radius_m**0.5 * indentation_m**1.5
    >>> isinstance(Hertz(), ResponseLaw)
    True
    """

    def parameters(self) -> Mapping[str, float | tuple[float, float]]: ...

    def force_N(self, indentation_m: Array, **values: float) -> Array: ...


def spline_of(
    law: ResponseLaw, draws: Mapping[str, Array], depths_m: tuple[float, float], allowed: float
) -> tuple[Array, Array, Array, tuple[float, ...], float]:
    """A law as a spline: forces (draws,), exponents (draws,), shapes (draws, k - 2), knots, error.

    The spline (:class:`scissorcal.model.Response`) has the law's force at the knots, spread evenly
    in the logarithm of the indentation over ``depths_m``, as many as the share ``allowed`` of the
    force takes at places between them, and at most 16. The error is the largest such share.

    Raises ModelError where the law gives no number, does not rise, or takes more knots.
    """
    low, high = depths_m
    reference = math.sqrt(low * high)
    worst, where = math.inf, low
    for count in range(FEWEST_KNOTS, MOST_KNOTS + 1):
        knots = np.geomspace(low, high, count)
        force, exponent, shape = _through(_forces(law, knots, draws), knots, reference)
        unit = _unit(exponent[:, None], shape[:, None, :], knots, reference)
        between = np.exp(_refined(np.log(knots)))
        wanted = _forces(law, between, draws)
        off = np.abs(force[:, None] * unit.force_at(between) / wanted - 1.0)
        worst, where = float(off.max()), float(between[int(off.max(axis=0).argmax())])
        if worst <= allowed:
            return force, exponent, shape, tuple(knots.tolist()), worst
    raise ModelError(
        f"The law {type(law).__name__} cannot be rendered: a spline of {MOST_KNOTS} knots is "
        f"{worst:.1%} off at {1e3 * where:.3g} mm, and {allowed:.1%} is allowed. Give a law "
        "without a step, or a narrower range of indentations in Material.depths_mm."
    )


def response_of(law: ResponseLaw, values: Mapping[str, Array], reference_m: float) -> Response:
    """A law as the spline of 16 knots that a fit evaluates, from 0.02 to 20 times the reference.

    ``values`` by name are scalars or arrays (k,). A trial of a search may be where the law gives no
    number: it is held at the ends of what a response can have, and the search leaves it.
    """
    knots = fit_knots(reference_m)
    columns = np.broadcast_arrays(
        *(np.asarray(value, dtype=np.float64) for value in values.values())
    )
    rows = zip(*(column.ravel() for column in columns), strict=True)
    with np.errstate(all="ignore"):
        forces = np.array(
            [law.force_N(knots, **dict(zip(values, map(float, row), strict=True))) for row in rows]
        )
    finite = np.where(np.isfinite(forces), forces, LARGEST)
    force, exponent, shape = _through(np.clip(finite, SMALLEST, LARGEST), knots, reference_m)
    given = columns[0].shape
    return Response(
        "spline",
        force.reshape(given),
        exponent.reshape(given),
        reference_m,
        shape.reshape((*given, -1)),
        tuple(knots.tolist()),
    )


def fit_knots(reference_m: float) -> Array:
    """Knots (m) of a law in a fit: what a cut and its teeth reach, about the reference."""
    return np.geomspace(FIT_SPAN[0] * reference_m, FIT_SPAN[1] * reference_m, MOST_KNOTS)


def _through(forces: Array, knots: Array, reference: float) -> tuple[Array, Array, Array]:
    """Force at the reference, exponent and shape of splines through ``forces`` (rows, knots)."""
    rises = np.diff(np.log(forces), axis=-1) / np.diff(np.log(knots))
    slopes = np.clip(rises, *SLOPES)
    shape = np.diff(np.log(slopes), axis=-1)
    exponent = np.exp(np.mean(np.log(slopes), axis=-1))
    unit = _unit(exponent[:, None], shape[:, None, :], knots, reference)
    middle = knots[len(knots) // 2 : len(knots) // 2 + 1]
    at_middle = forces[:, len(knots) // 2] / unit.force_at(middle)[:, 0]
    return np.clip(at_middle, SMALLEST, LARGEST), exponent, shape


def _unit(exponent: Array, shape: Array, knots: Array, reference: float) -> Response:
    knots_m = tuple(knots.tolist())
    return Response("spline", np.ones_like(exponent), exponent, reference, shape, knots_m)


def law_parameters(law: ResponseLaw) -> dict[str, tuple[float, float]]:
    """What a law depends on: value and standard deviation by name.

    Raises InputError for an object without both methods, or without parameters.
    """
    if not isinstance(law, ResponseLaw):
        raise InputError(
            f"The law {law!r} needs two methods: parameters() and force_N(indentation_m, "
            "**values). See scissorcal.ResponseLaw for an example."
        )
    given = dict(law.parameters())
    if not given:
        raise InputError(f"The law {type(law).__name__} has no parameters: give one at least.")
    return {name: as_pair(name, value) for name, value in given.items()}


def refuse_falling(law: ResponseLaw, depths: Array, draws: Mapping[str, Array]) -> None:
    """Raise ModelError, a sentence with the place, where a law gives no number or does not rise."""
    _forces(law, depths, draws)


def _forces(law: ResponseLaw, depths: Array, draws: Mapping[str, Array]) -> Array:
    """Forces (draws, depths) of a law, after checking that they are numbers that rise."""
    count = len(next(iter(draws.values())))
    rows = []
    for row in range(count):
        values = {name: float(column[row]) for name, column in draws.items()}
        with np.errstate(all="ignore"):  # what is no number is refused with its place
            force = np.asarray(law.force_N(depths, **values), dtype=np.float64)
        _refuse_unusable(law, depths, force, values)
        rows.append(force)
    return np.stack(rows)


def _refuse_unusable(
    law: ResponseLaw, depths: Array, force: Array, values: Mapping[str, float]
) -> None:
    at = ", ".join(f"{name} = {value:.3g}" for name, value in values.items())
    name = f"The law {type(law).__name__} with {at}"
    if force.shape != depths.shape:
        raise ModelError(
            f"{name} gives an array of shape {force.shape} for indentations of shape "
            f"{depths.shape}: give one force for each."
        )
    bad = ~np.isfinite(force) | (force <= 0.0)
    if bad.any():
        first = int(np.argmax(bad))
        raise ModelError(
            f"{name} gives {force[first]:g} N at {1e3 * depths[first]:.3g} mm: a force must be a "
            "number above 0 wherever the blade sinks in."
        )
    falls = np.diff(force) <= 0.0
    if falls.any():
        first = int(np.argmax(falls))
        raise ModelError(
            f"{name} does not rise: {force[first]:.4g} N at {1e3 * depths[first]:.3g} mm and "
            f"{force[first + 1]:.4g} N at {1e3 * depths[first + 1]:.3g} mm. A law that falls would "
            "push the blades on; let it rise over Material.depths_mm."
        )


def _refined(places: Array) -> Array:
    """``PLACES`` places between each two of ``places``, and these."""
    steps = np.linspace(0.0, 1.0, PLACES, endpoint=False)
    inner = places[:-1, None] + np.diff(places)[:, None] * steps
    return np.append(inner.ravel(), places[-1])
