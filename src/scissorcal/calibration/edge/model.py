"""How probable an edge's cells are under a family of edges, with its gradient, and the search."""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from scissorcal.aliases import Array
from scissorcal.calibration.edge.cells import EdgeCells
from scissorcal.inference import Cluster, Effort, Optimum, Problem
from scissorcal.inference.problem import SearchStatus
from scissorcal.model.bspline import spline_design
from scissorcal.recipe.priors import BladePriors

Family = Literal["line", "arc", "cubic", "spline"]

FAMILIES: tuple[Family, ...] = ("line", "arc", "cubic", "spline")
KNOT_SHARE = 0.1
"""Distance of the spline's knots, in shares of the measured length."""

MOVING = ("tilt", "pivot", "centreline", "size")
"""Common errors that move, turn or stretch an edge as a whole."""

SEARCH_EVALUATIONS = 150
"""Evaluations of the likelihood with its gradient that each start of a search may take."""

MOST_EVALUATIONS: dict[Effort, int] = {"draft": 0, "standard": 20_000, "thorough": 200_000}
"""Evaluations of the likelihood that sampling the sizes of the errors may take."""

_HALF_LOG_TWO_PI = 0.5 * float(np.log(2.0 * np.pi))
_BOUND = 5.0
_START_BOUND = 4.0
_FLOOR = 0.1
_APART = 0.5
_NOWHERE = 1e12


class CellData:
    """All cells stacked, with the parts of their covariance that do not depend on parameters."""

    def __init__(self, photographs: tuple[EdgeCells, ...], length_m: float) -> None:
        self.length = length_m
        self.station = np.concatenate([cells.station for cells in photographs])
        self.offset = np.concatenate([cells.offset for cells in photographs])
        self.variance = np.concatenate([cells.sd for cells in photographs]) ** 2
        self.photo = np.repeat(np.arange(len(photographs)), [len(c.station) for c in photographs])
        self.several = len(photographs) > 1
        self.start = float(self.station.min())
        self.apart = np.abs(self.station[:, None] - self.station[None, :])
        same = self.photo[:, None] == self.photo[None, :]
        self._fixed, self._moving = self._moved_together(photographs)
        tilt = self.station / length_m
        self.between = same * (1.0 + np.outer(tilt, tilt))
        spacing = float(np.median(np.diff(photographs[0].station)))
        self.streaks = same * np.exp(-self.apart / (3.0 * spacing))

    def known(self, columns: Array) -> Array:
        """Covariance (n, n) of the common errors, for edges of the family ``columns`` (n, k).

        What moves, turns or stretches an edge as a whole makes it another edge of its family: of
        such a column the projection on the family counts, in each photograph. What lies outside is
        noise of the slope by which it was computed, or of second order; kept, least squares would
        take the points' own noise for a measurement of the pivot or of the tilt.
        """
        moving = np.zeros_like(self._moving)
        for number in range(int(self.photo[-1]) + 1):
            here = self.photo == number
            weights = np.linalg.lstsq(columns[here], self._moving[here], rcond=None)[0]
            moving[here] = columns[here] @ weights
        return np.asarray(self._fixed @ self._fixed.T + moving @ moving.T)

    def _moved_together(self, photographs: tuple[EdgeCells, ...]) -> tuple[Array, Array]:
        """Columns (n, k) of common errors: those that stay as they are, and those of `MOVING`."""
        shared: dict[tuple[str, int], Array] = {}
        columns: list[tuple[str, Array]] = []
        for number, cells in enumerate(photographs):
            here = self.photo == number
            counts: dict[str, int] = {}
            for column, name in zip(cells.modes.T, cells.mode_names, strict=True):
                full = np.zeros(len(self.station))
                full[here] = column
                if name in ("shared mapping", "tone"):
                    key = (name, counts.setdefault(name, 0))
                    counts[name] += 1
                    shared[key] = shared.get(key, np.zeros_like(full)) + full
                else:
                    columns.append((name, full))
        fixed = [*shared.values(), *(column for name, column in columns if name not in MOVING)]
        moving = [column for name, column in columns if name in MOVING]
        nothing = np.zeros((len(self.station), 0))
        return tuple(np.stack(c, axis=1) if c else nothing for c in (fixed, moving))  # type: ignore[return-value]

    def disagreement(self) -> tuple[float, float]:
        """Rms of what photographs leave of one cubic: of their shifts and tilts, and within each.

        Both are sizes to begin a search with, in metres (or blade lengths).
        """
        s = self.station / self.length
        design = np.vander(s, 4)
        off = self.offset - design @ np.linalg.lstsq(design, self.offset, rcond=None)[0]
        moved = []
        for number in range(int(self.photo[-1]) + 1):
            here = self.photo == number
            line = np.vander(s[here], 2)
            line_of_photograph = np.linalg.lstsq(line, off[here], rcond=None)[0]
            off[here] -= line @ line_of_photograph
            moved.extend(line_of_photograph)
        return float(np.sqrt(np.mean(np.square(moved)))), float(np.sqrt(np.mean(off**2)))


@dataclass(frozen=True)
class Basis:
    """Columns (n, k) of a family and its prior: mean 0, ``prior`` (k, k) by the stiffness."""

    columns: Array
    loose: Array
    bent: Array | None

    def prior(self, bend: float) -> Array:
        return self.loose if self.bent is None else self.loose + bend**2 * self.bent


def basis_of(data: CellData, family: Family, priors: BladePriors = BladePriors()) -> Basis:
    """A family's columns at the cells' stations."""
    s = data.station
    shape_sd = (
        0.01 * priors.offset_sd_percent,
        priors.slope_sd,
        priors.curvature_sd_per_length,
        priors.bend_sd_per_length2,
    )
    if family != "spline":
        powers = (np.ones_like(s), s, 0.5 * s**2, s**3 / 6.0)
        count = FAMILIES.index(family) + 2
        sd = np.array(shape_sd) * data.length ** (1.0 - np.arange(4))
        return Basis(np.stack(powers[:count], axis=1), np.diag(sd[:count] ** 2), None)
    count = max(round((data.length - data.start) / (KNOT_SHARE * data.length)), 2) + 3
    columns = spline_design(count, data.start, data.length, s)
    width = (data.length - data.start) / (count - 3)
    place = data.start + width * (np.arange(count) - 1.0)
    straight = np.stack([np.ones(count), place], axis=1)
    loose = straight @ np.diag([(shape_sd[0] * data.length) ** 2, shape_sd[1] ** 2]) @ straight.T
    curve = np.diff(np.eye(count), 2, axis=0)
    return Basis(columns, loose, np.asarray(np.linalg.pinv(curve.T @ curve) * width**4))


class EdgeEvidence:
    """Posterior of the sizes of the errors, the edge's own parameters integrated out.

    Cells are normal with a covariance that is a sum of fixed matrices, each times the square of a
    size, and of the roughness, whose correlation length is a parameter too. ``names`` are those of
    the logarithms of the sizes; ``middle`` and ``sd`` (p,) their normal prior.
    """

    def __init__(self, data: CellData, basis: Basis, priors: BladePriors = BladePriors()) -> None:
        self.data, self.basis = data, basis
        percent = 0.01 * data.length
        rows = [
            ("noise_factor", 1.0, priors.noise_factor),
            ("roughness_m", percent, priors.roughness_percent),
            ("roughness_length_m", percent, priors.roughness_length_percent),
            ("streak_m", percent, priors.streak_percent),
        ]
        if data.several:
            rows.append(("between_m", percent, priors.between_percent))
        if basis.bent is not None:
            rows.append(("bending_per_m", 1.0 / data.length, priors.bending_per_length))
        self.names = tuple(name for name, _, _ in rows)
        self.middle = np.array([prior.normal()[0] + np.log(unit) for _, unit, prior in rows])
        self.sd = np.array([prior.log_sd for _, _, prior in rows])
        columns = basis.columns
        self._known = data.known(columns)
        self._fixed: Array = self._known + columns @ basis.loose @ columns.T
        self._bent = None if basis.bent is None else columns @ basis.bent @ columns.T

    def problem(self) -> Problem:
        """The posterior as inference takes it."""
        count = len(self.data.station)
        return Problem(
            names=self.names,
            log_prior=self.log_prior,
            log_likelihood_terms=self.terms,
            series=np.zeros(count, dtype=np.int64),
            prior_sd=self.sd,
            starts=self.middle[None, :],
            lower=self.middle - _BOUND * self.sd,
            upper=self.middle + _BOUND * self.sd,
            independent=True,
        )

    def log_prior(self, u: Array) -> float:
        z = (u - self.middle) / self.sd
        return float(-0.5 * z @ z - np.sum(np.log(self.sd)) - len(u) * _HALF_LOG_TWO_PI)

    def terms(self, u: Array) -> Array:
        """One term of the log-likelihood for each cell given those before it, (n,)."""
        from scipy.linalg.lapack import dpotrf, dtrtrs

        root, failed = dpotrf(self._total(u)[0], lower=1, clean=0)
        if failed:
            return np.array([-np.inf])
        white = dtrtrs(root, self.data.offset, lower=1)[0]
        return np.asarray(-0.5 * white**2 - np.log(np.diag(root)) - _HALF_LOG_TWO_PI)

    def with_gradient(self, u: Array) -> tuple[float, Array]:
        """Log-posterior and its gradient (p,); -inf and zeros where it is not finite.

        With T the covariance and a = T^-1 y, a size's derivative is a' dT a / 2 - tr(T^-1 dT) / 2
        (Rasmussen and Williams 2006, equation 5.9).
        """
        from scipy.linalg.lapack import dpotrf, dpotri, dpotrs

        total, rough = self._total(u)
        root, failed = dpotrf(total, lower=1, clean=1)
        if failed:
            return -np.inf, np.zeros_like(u)
        solved = dpotrs(root, self.data.offset, lower=1)[0]
        half = dpotri(root, lower=1)[0]
        inverse = half + half.T
        inverse[np.diag_indices_from(inverse)] *= 0.5
        value = -0.5 * self.data.offset @ solved - np.sum(np.log(np.diag(root)))
        pull = np.outer(solved, solved) - inverse
        size = np.exp(u)
        slope = [
            size[0] ** 2 * np.diag(pull) @ self.data.variance,
            np.vdot(pull, rough),
            0.5 * np.vdot(pull, rough * self.data.apart) / size[2],
            size[3] ** 2 * np.vdot(pull, self.data.streaks),
        ]
        if self.data.several:
            slope.append(size[4] ** 2 * np.vdot(pull, self.data.between))
        if self._bent is not None:
            slope.append(size[-1] ** 2 * np.vdot(pull, self._bent))
        value += self.log_prior(u) - len(self.data.offset) * _HALF_LOG_TWO_PI
        return float(value), np.array(slope) - (u - self.middle) / self.sd**2

    def covariances(self, u: Array) -> tuple[Array, Array]:
        """Covariance (n, n) of the cells about the edge, and the edge's prior (k, k)."""
        prior = self.basis.prior(float(np.exp(u[-1])) if self._bent is not None else 0.0)
        return self._about_edge(u, self._known)[0], prior

    def _total(self, u: Array) -> tuple[Array, Array]:
        """Covariance of the cells, the edge integrated out, and the roughness's part of it."""
        total, rough = self._about_edge(u, self._fixed)
        if self._bent is not None:
            total += float(np.exp(2.0 * u[-1])) * self._bent
        return total, rough

    def _about_edge(self, u: Array, fixed: Array) -> tuple[Array, Array]:
        data, size = self.data, np.exp(u)
        rough: Array = data.apart * (-1.0 / size[2])
        np.exp(rough, out=rough)
        rough *= size[1] ** 2
        total = fixed + rough
        total += size[3] ** 2 * data.streaks
        if data.several:
            total += size[4] ** 2 * data.between
        total[np.diag_indices_from(total)] += size[0] ** 2 * data.variance
        return total, rough

    def starts(self) -> Array:
        """Where searches begin, (2, p): the prior's median, and what photographs plainly say."""
        between, within = self.data.disagreement()
        observed = self.middle.copy()
        observed[3] = np.log(max(within, 1e-12))
        if self.data.several:
            observed[4] = np.log(max(between, 1e-12))
        reach = _START_BOUND * self.sd
        return np.stack([self.middle, np.clip(observed, self.middle - reach, self.middle + reach)])


def search(evidence: EdgeEvidence) -> tuple[Optimum, float]:
    """The most probable sizes, from each start by a quasi-Newton method, and the log evidence.

    The evidence is by Laplace's approximation.

    Distinct optima are kept, since disagreement of photographs can be explained in two ways.
    """
    from scipy.optimize import minimize

    sd, middle = evidence.sd, evidence.middle

    def fallen(z: Array) -> tuple[float, Array]:
        value, slope = evidence.with_gradient(middle + sd * z)
        return (-value, -slope * sd) if np.isfinite(value) else (_NOWHERE, np.zeros_like(z))

    ends = [
        minimize(
            fallen,
            (start - middle) / sd,
            jac=True,
            method="L-BFGS-B",
            bounds=[(-_BOUND, _BOUND)] * len(sd),
            options={"maxfun": SEARCH_EVALUATIONS, "ftol": 1e-11, "gtol": 1e-4},
        )
        for start in evidence.starts()
    ]
    ends.sort(key=lambda end: float(end.fun))
    clusters: list[Cluster] = []
    for end in ends:
        if not any(np.linalg.norm(end.x - (c.point - middle) / sd) < _APART for c in clusters):
            clusters.append(Cluster(middle + sd * end.x, -float(end.fun), 1, bool(end.success)))
    best = ends[0]
    on_bound = bool(np.any(np.abs(best.x) > _BOUND - 1e-6))
    used_up = int(best.nfev) >= SEARCH_EVALUATIONS
    status = (
        SearchStatus.AT_BOUNDS
        if on_bound
        else SearchStatus.ROUNDS_USED_UP
        if used_up
        else SearchStatus.SETTLED
    )
    volume = _log_volume(evidence, best.x)
    evaluations = sum(int(end.nfev) for end in ends) + 2 * len(sd)
    agreeing = sum(float(end.fun) < float(best.fun) + _APART for end in ends)
    optimum = Optimum(
        clusters[0].point,
        clusters[0].value,
        status.found,
        status.value,
        agreeing,
        len(ends),
        evaluations,
        status,
        tuple(clusters),
    )
    return optimum, clusters[0].value + len(sd) * _HALF_LOG_TWO_PI + volume


def _log_volume(evidence: EdgeEvidence, z: Array) -> float:
    """Half the logarithm of the determinant of the sizes' covariance at an optimum."""
    middle, sd, step = evidence.middle, evidence.sd, 1e-3
    curvature = [
        (
            evidence.with_gradient(middle + sd * (z - reach))[1]
            - evidence.with_gradient(middle + sd * (z + reach))[1]
        )
        * sd
        / (2.0 * step)
        for reach in step * np.eye(len(z))
    ]
    matrix = np.array(curvature)
    levels = np.maximum(np.linalg.eigvalsh(0.5 * (matrix + matrix.T)), _FLOOR)
    return float(np.sum(np.log(sd)) - 0.5 * np.sum(np.log(levels)))
