"""Products of a friction law's columns by stroke: its likelihood without going through the bins.

At given scales a law is linear in its columns, so that a stroke's squares are a quadratic form in
their coefficients. The products are made once; from then on what an evaluation costs does not
depend on how much was recorded, and leaving strokes out is leaving out their products. Many draws
at once are scored stroke by stroke by their residuals.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np

from scissorcal.aliases import Array, Integers
from scissorcal.calibration.friction.columns import SCALES, Cell, FrictionBasis, coupled_nodes
from scissorcal.calibration.parameters import Layout
from scissorcal.inference.noise import runs
from scissorcal.model.terms import IDENTITY, Transform

Block = tuple[str, int, int]

MEASURED: Block = ("measured", 0, 0)
FIXED: Block = ("fixed", 0, 0)
STEP = 1e-4
"""Step in unconstrained parameters by which coefficients are differentiated."""
DRAWS_AT_ONCE = 32
"""Draws whose residuals are in memory together."""
LEAST = 1e-13
"""Share of the measured squares below which what is left is rounding."""


class StrokeMoments:
    """Products of columns and measurements, (strokes, columns, columns), as they are asked for.

    ``labels`` (strokes,) are the strokes, ``counts`` (strokes,) their bins.
    """

    def __init__(self, basis: FrictionBasis, measured: Array, strokes: Integers) -> None:
        """``measured`` and ``strokes`` (n,) belong to the windows of ``basis``."""
        self.basis, self.measured, self.strokes = basis, measured, strokes
        self.labels, place, counts = np.unique(strokes, return_inverse=True, return_counts=True)
        self.counts = counts.astype(np.float64)
        self._runs = [(int(place[low]), low, high) for low, high in runs(strokes)]
        self._products: dict[tuple[Block, Block], Array] = {}

    def of(self, measured: Array) -> "StrokeMoments":
        """The same columns with other measurements (n,)."""
        other = StrokeMoments(self.basis, measured, self.strokes)
        kept = {key: made for key, made in self._products.items() if MEASURED not in key}
        other._products = kept
        return other

    def products(self, a: Block, b: Block) -> Array:
        """Products of the columns of two blocks, (strokes, columns of a, columns of b)."""
        if (a, b) not in self._products:
            if (b, a) in self._products:
                return np.asarray(self._products[b, a].transpose(0, 2, 1))
            left, right = self._columns(a), self._columns(b)
            sums = np.zeros((len(self.labels), len(left), len(right)))
            for stroke, low, high in self._runs:
                sums[stroke] += left[:, low:high] @ right[:, low:high].T
            self._products[a, b] = sums
        return self._products[a, b]

    def squares(self, cell: Cell, factors: Array) -> Array:
        """Squares that factors (k, q) of a cell's columns leave in each stroke, (k, strokes)."""
        rows = [self._columns(block) for block in _blocks(cell)]
        squares = np.zeros((len(factors), len(self.labels)))
        for stroke, low, high in self._runs:  # a run at a time stays in the cache
            left = factors @ np.concatenate([row[:, low:high] for row in rows])
            squares[:, stroke] += np.einsum("kn,kn->k", left, left)
        return squares

    def assembled(
        self, cell: Cell, products: Callable[[Block, Block], Array], shape: tuple[int, ...]
    ) -> Array:
        """Put a cell's ``products`` of two blocks, (*shape, columns, columns), together."""
        blocks = _blocks(cell)
        known = {(a, b): products(a, b) for i, a in enumerate(blocks) for b in blocks[i:]}
        ends = np.cumsum([0, *(known[a, a].shape[-1] for a in blocks)]).tolist()
        places = {a: slice(*bounds) for a, bounds in zip(blocks, pairwise(ends), strict=True)}
        result = np.empty((*shape, ends[-1], ends[-1]))
        for (a, b), product in known.items():
            result[..., places[a], places[b]] = product
            result[..., places[b], places[a]] = np.swapaxes(product, -1, -2)
        return result

    def _columns(self, block: Block) -> Array:
        """Columns of a block (columns, n), each in one piece of memory."""
        kind, index, other = block
        if kind == "measured":
            return self.measured[None, :]
        if kind == "fixed":
            return self.basis.fixed.T
        if kind == "coupled":
            return self.basis.coupled(index, other).T
        scaled = self.basis.stribeck if kind == "stribeck" else self.basis.lag
        return scaled.node(index).T


@dataclass(frozen=True)
class ReducedLaw:
    """One law over the products of its columns; its noise is normal and of one size.

    ``weights`` (strokes,) are 1 for strokes that count, 0 for those that are left out.
    """

    layout: Layout
    moments: StrokeMoments
    weights: Array | None = None

    def without(self, labels: Integers) -> "ReducedLaw":
        """The law over all strokes but those of ``labels``."""
        kept = (~np.isin(self.moments.labels, labels)).astype(np.float64)
        return ReducedLaw(self.layout, self.moments, kept)

    @cached_property
    def counted(self) -> float:
        """Bins that count."""
        return float(self._weights @ self.moments.counts)

    def log_likelihood(self, u: Array) -> float:
        """Log-likelihood at ``u`` (p,), up to a constant."""
        return float(-0.5 * self.squares(u) * np.exp(-2.0 * u[-1]) - self.counted * u[-1])

    def log_likelihoods(self, points: Array) -> Array:
        """Log-likelihoods (k,) at points (k, p), up to the same constant."""
        squares = np.empty(len(points))
        for cell, here in self._by_cell(points):
            factors, products = self.factors(points[here], cell), self.summed(cell)
            left = np.einsum("kq,kq->k", factors @ products, factors)
            squares[here] = np.maximum(left, LEAST * products[0, 0])
        size = points[:, -1]
        return np.asarray(-0.5 * squares * np.exp(-2.0 * size) - self.counted * size)

    def squares(self, u: Array) -> float:
        """Sum of squared residuals at ``u`` (p,)."""
        cell = self.cell_at(u)
        factors = self.factors(u, cell)
        products = self.summed(cell)
        return max(float(factors @ products @ factors), LEAST * float(products[0, 0]))

    def by_stroke(self, draws: Array) -> Array:
        """Log-likelihood of each stroke at each draw (k, p): (k, strokes).

        By residuals: draws lie in different cells, and a cell's products cost as much as the
        residuals of several draws.
        """
        squares = np.empty((len(draws), len(self.moments.labels)))
        for cell, places in self._by_cell(draws):
            for first in range(0, len(places), DRAWS_AT_ONCE):
                here = places[first : first + DRAWS_AT_ONCE]
                squares[here] = self.moments.squares(cell, self.factors(draws[here], cell))
        size = draws[:, -1:]
        return np.asarray(-0.5 * squares * np.exp(-2.0 * size) - self.moments.counts * size)

    def slopes(self, u: Array, cell: Cell) -> Array:
        """Derivatives of the factors by each parameter but the noise, (q, p - 1)."""
        return self.factors_and_slopes(u, cell)[1]

    def factors_and_slopes(self, u: Array, cell: Cell) -> tuple[Array, Array]:
        """Factors (q,) at ``u`` (p,) and their derivatives (q, p - 1), worked out at once."""
        reach = STEP * np.eye(len(u))[:-1]
        values = self.factors(np.concatenate([u[None, :], u + reach, u - reach]), cell)
        above, below = np.split(values[1:], 2)
        return values[0], np.asarray((above - below).T / (2.0 * STEP))

    def slope(self, u: Array) -> Array:
        """Derivative of the log-likelihood at ``u`` (p,), shape (p,)."""
        cell = self.cell_at(u)
        (factors, slopes), weight = self.factors_and_slopes(u, cell), np.exp(-2.0 * u[-1])
        products = self.summed(cell) @ factors
        by_mean = -weight * slopes.T @ products
        return np.append(by_mean, weight * float(factors @ products) - self.counted)

    def information(self, u: Array) -> Array:
        """Fisher's information of the likelihood at ``u`` (p,), shape (p, p)."""
        cell = self.cell_at(u)
        slopes = self.slopes(u, cell)
        information = np.zeros((len(u), len(u)))
        information[:-1, :-1] = slopes.T @ self.summed(cell) @ slopes * np.exp(-2.0 * u[-1])
        information[-1, -1] = 2.0 * self.counted
        return information

    def cell_at(self, u: Array) -> Cell:
        """The nodes of the scales that ``u`` (p,) lies between."""
        basis = self.moments.basis
        first, second = (
            () if place is None else scaled.cell_of(float(u[place]))
            for place, scaled in zip(self._scales, (basis.stribeck, basis.lag), strict=True)
        )
        return first, second

    def _by_cell(self, points: Array) -> Iterator[tuple[Cell, Integers]]:
        """The cells that points (k, p) lie in, each with the places of its points."""
        low = np.zeros((len(points), len(self._scales)))
        basis = self.moments.basis
        for column, (place, scaled) in enumerate(
            zip(self._scales, (basis.stribeck, basis.lag), strict=True)
        ):
            if place is not None:
                low[:, column] = np.floor(points[:, place] / scaled.spacing)
        _, first, which = np.unique(low, axis=0, return_index=True, return_inverse=True)
        for index, place in enumerate(first):
            yield self.cell_at(points[place]), np.flatnonzero(which == index)

    def summed(self, cell: Cell) -> Array:
        """Products over the strokes that count, (q, q)."""
        if cell not in self._cells:
            self._cells[cell] = self.moments.assembled(cell, self._summed_pair, ())
        return self._cells[cell]

    def factors(self, u: Array, cell: Cell) -> Array:
        """Factors of a cell's columns (..., q) at ``u`` (..., p): 1 of what was measured, first."""
        known = np.ones((*u.shape[:-1], u.shape[-1] + 2))
        known[..., :-2] = u
        for transform, places in self._transformed:
            known[..., places] = transform.natural(u[..., places])
        known[..., -1] = 0.0
        fixed, stribeck, late, coupled = (
            -signs * known[..., first] * known[..., second] * known[..., third]
            for signs, first, second, third in self.moments.basis.places(self.layout.names)
        )
        parts = [np.ones((*u.shape[:-1], 1)), fixed]
        basis = self.moments.basis
        scales = [None if place is None else known[..., place] for place in self._scales]
        weighed = [
            (scaled.weights_over(scale, nodes), of_columns)
            for scale, nodes, scaled, of_columns in zip(
                scales, cell, (basis.stribeck, basis.lag), (stribeck, late), strict=True
            )
            if scale is not None and nodes
        ]
        rate, length = scales
        if rate is not None and length is not None:
            weighed.append((basis.coupled_weights(rate, length, cell), coupled))
        for weights, of_columns in weighed:
            joined = weights[..., :, None] * of_columns[..., None, :]
            parts.append(joined.reshape((*u.shape[:-1], -1)))
        return np.concatenate(parts, axis=-1)

    @cached_property
    def _scales(self) -> tuple[int | None, int | None]:
        """Places of Stribeck's speed and Dahl's length among the parameters."""
        names = self.layout.names
        rate, length = (names.index(name) if name in names else None for name in SCALES)
        return rate, length

    @cached_property
    def _transformed(self) -> list[tuple[Transform, Integers]]:
        """Each transform but the identity, with the places of its parameters."""
        transforms = [parameter.transform for parameter in self.layout.parameters]
        kinds = [used for used in dict.fromkeys(transforms) if used != IDENTITY]
        return [(kind, np.flatnonzero([used == kind for used in transforms])) for kind in kinds]

    @cached_property
    def _weights(self) -> Array:
        return np.ones(len(self.moments.labels)) if self.weights is None else self.weights

    def _summed_pair(self, a: Block, b: Block) -> Array:
        if (a, b) not in self._pairs:
            self._pairs[a, b] = np.tensordot(self._weights, self.moments.products(a, b), axes=1)
        return self._pairs[a, b]

    @cached_property
    def _pairs(self) -> dict[tuple[Block, Block], Array]:
        return {}

    @cached_property
    def _cells(self) -> dict[Cell, Array]:
        return {}


def _blocks(cell: Cell) -> list[Block]:
    """Blocks of columns that a cell needs, in the order of a law's factors."""
    return [
        MEASURED,
        FIXED,
        *(("stribeck", index, 0) for index in cell[0]),
        *(("lag", index, 0) for index in cell[1]),
        *(("coupled", rate, length) for rate, length in coupled_nodes(cell)),
    ]
