"""The edge over the sheet, linearised about an estimate of the crack's place."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike

from scissorcal.aliases import Array
from scissorcal.model import Edge, EdgeDistribution, edge_height
from scissorcal.recipe.schema import Recipe

NEWTON_STEPS = 12
STEP_M = 1e-6
"""Step of the derivatives by the crack's place: the second derivative is below 1 /m over 1 mm."""
EDGE_STEP_SDS = 0.1


@dataclass(frozen=True)
class Spans:
    """Indentation at both ends of segments (k, 2), lever of each (k,), and their derivatives.

    ``_dx`` are by the crack's place, ``_de`` (k, 2, q) and (k, q) by the uncertain parameters of
    the edge. The lever times the response's mean over the depths between the ends is the mean
    torque. ``sinking`` (k,) in m/s is how fast the edge sinks in.
    """

    depth: Array
    depth_dx: Array
    lever: Array
    lever_dx: Array
    sinking: Array
    depth_de: Array
    lever_de: Array


@dataclass(frozen=True)
class Running:
    """Lever and slope (k,) where the indentation is the reference's, and their derivatives.

    ``_dd`` are by the indentation, ``_de`` (k, q) by the edge; ``place`` is the contact (m).
    """

    place: Array
    lever: Array
    lever_dd: Array
    slope: Array
    slope_dd: Array
    lever_de: Array
    slope_de: Array
    place_de: Array


@dataclass(frozen=True)
class Geometry:
    """The edge with its uncertainty, the sheet, and the lever of the closure.

    ``upper_face_m`` is y_top, ``reference_m`` the indentation that places are expanded about.
    """

    edge_prior: EdgeDistribution
    upper_face_m: float
    moving_blades: int
    reference_m: float
    closure: Literal["work", "eq4"] = "work"

    @property
    def edge(self) -> Edge:
        """The most probable edge."""
        return self.edge_prior.edge

    def at(self, values: Mapping[str, float]) -> "Geometry":
        """The geometry with the edge that parameters by name give, those that are missing as here.

        Cracks are placed by it: where the blades have nearly closed, an edge off by 30 um moves a
        crack by 0.3 mm, and loading would seem to end where the crack runs already.
        """
        edge = self.edge_prior.with_values(
            {
                name: values[f"edge_{name}"]
                for name in self.edge_prior.names
                if f"edge_{name}" in values
            }
        )
        return replace(self, edge_prior=replace(self.edge_prior, edge=edge))

    def depth_and_lever(self, edge: Edge, opening: Array, contact: Array) -> tuple[Array, Array]:
        """Indentation (m) at a contact, and the lever (m) by which force becomes torque."""
        view = edge_height(edge, contact, opening / self.moving_blades)
        depth = self.upper_face_m - view.height
        if self.closure == "work":
            return depth, view.lever
        return depth, contact / np.sqrt(1.0 + edge.slope_at(view.station) ** 2)

    def slope(self, opening: Array, contact: Array) -> Array:
        """Slope tan(psi) of the edge at a contact."""
        return edge_height(self.edge, contact, opening / self.moving_blades).slope

    def place(self, opening: ArrayLike, depth: ArrayLike, edge: Edge | None = None) -> Array:
        """Contact (m) at which the indentation is ``depth`` (m); both broadcast."""
        edge = self.edge if edge is None else edge
        theta, wanted = np.broadcast_arrays(
            np.asarray(opening, dtype=np.float64), np.asarray(depth, dtype=np.float64)
        )
        sine, cosine = np.sin(theta / self.moving_blades), np.cos(theta / self.moving_blades)
        station = np.full(theta.shape, 0.5 * edge.length_m)
        for _ in range(NEWTON_STEPS):
            height = station * sine + edge.offset_at(station) * cosine
            rise = sine + edge.slope_at(station) * cosine
            rise = np.where(np.abs(rise) > 1e-9, rise, 1e-9)
            step = (self.upper_face_m - wanted - height) / rise
            station = np.clip(station + step, -edge.length_m, 3.0 * edge.length_m)
            if np.all(np.abs(step) < 1e-14):
                break
        return np.asarray(station * cosine - edge.offset_at(station) * sine)

    def spans(self, opening: Array, rate: Array, contact: Array) -> Spans:
        """Expand segments about contacts (k, 2) at openings (k, 2) that change at ``rate`` (k,)."""
        depth, lever = self._depths_and_lever(self.edge, opening, contact)
        ahead = self._depths_and_lever(self.edge, opening, contact + STEP_M)
        behind = self._depths_and_lever(self.edge, opening, contact - STEP_M)
        pairs = [
            [self._depths_and_lever(self.edge_off(i, s), opening, contact) for s in (1, -1)]
            for i in self._uncertain
        ]
        middle = 0.5 * opening.sum(axis=1) / self.moving_blades
        arm = edge_height(self.edge, 0.5 * contact.sum(axis=1), middle).lever
        return Spans(
            depth=depth,
            depth_dx=(ahead[0] - behind[0]) / (2 * STEP_M),
            lever=lever,
            lever_dx=(ahead[1] - behind[1]) / (2 * STEP_M),
            sinking=-arm * rate / self.moving_blades,
            depth_de=self._by_edge([a[0] - b[0] for a, b in pairs]),
            lever_de=self._by_edge([a[1] - b[1] for a, b in pairs]),
        )

    def running(self, opening: Array, depth: float | Array | None = None) -> Running:
        """Expand about an indentation at openings (k,): the reference's where none is given."""
        about = self.reference_m if depth is None else depth
        place, lever, slope = self._at_depth(self.edge, opening, about)
        step = 0.01 * self.reference_m
        high = self._at_depth(self.edge, opening, about + step)
        low = self._at_depth(self.edge, opening, about - step)
        above = [self._at_depth(self.edge_off(i, 1), opening, about) for i in self._uncertain]
        below = [self._at_depth(self.edge_off(i, -1), opening, about) for i in self._uncertain]
        pairs = list(zip(above, below, strict=True))
        return Running(
            place=place,
            lever=lever,
            lever_dd=(high[1] - low[1]) / (2 * step),
            slope=slope,
            slope_dd=(high[2] - low[2]) / (2 * step),
            lever_de=self._by_edge([a[1] - b[1] for a, b in pairs]),
            slope_de=self._by_edge([a[2] - b[2] for a, b in pairs]),
            place_de=self._by_edge([a[0] - b[0] for a, b in pairs]),
        )

    def resting(self, opening: Array, near: Array) -> Running:
        """As :meth:`running`, expanded about the indentations at places ``near`` (k,).

        ``place`` is where the line through such a place, with the slope there, has the reference's
        indentation: the same for a straight edge. Where ``near`` is NaN, or the indentation there
        no positive number, the reference's is taken.
        """
        with np.errstate(invalid="ignore"):
            depth = self.depth_and_lever(self.edge, opening, near)[0]
            depth = np.where(depth > 0.0, depth, self.reference_m)
        found = self.running(opening, depth)
        return replace(found, place=found.place + (depth - self.reference_m) / found.slope)

    def edge_off(self, index: int, sign: int) -> Edge:
        """The edge with one parameter off by ``EDGE_STEP_SDS`` standard deviations."""
        values = self.edge_prior.mean.copy()
        values[index] += sign * self._edge_steps[index]
        return self.edge_prior.with_values(values)

    def _depths_and_lever(self, edge: Edge, opening: Array, contact: Array) -> tuple[Array, Array]:
        """Depths (k, 2) at the ends of segments, and the lever (k,) of each.

        Torque is -dE/d(theta) of the stored energy E = m G(delta), so that mean force times
        -m d(delta)/d(theta) is the mean torque; the difference is taken with the contact held, at
        either end. Equation 4 has no energy: its lever is the mean of those at both ends.
        """
        depth, lever = self.depth_and_lever(edge, opening, contact)
        if self.closure == "eq4":
            return depth, lever.mean(axis=1)
        crossed, _ = self.depth_and_lever(edge, opening, contact[:, ::-1])
        sunk = 0.5 * (depth[:, 1] - crossed[:, 0] + crossed[:, 1] - depth[:, 0])
        return depth, -self.moving_blades * sunk / np.diff(opening)[:, 0]

    @property
    def _uncertain(self) -> range:
        return range(len(self.edge_prior.names))

    @cached_property
    def _edge_steps(self) -> Array:
        return np.asarray(EDGE_STEP_SDS * np.sqrt(np.diag(self.edge_prior.covariance)))

    def _by_edge(self, differences: list[Array]) -> Array:
        if not differences:
            return np.zeros((0, 0))
        return np.stack(differences, axis=-1) / (2.0 * self._edge_steps)

    def _at_depth(self, edge: Edge, opening: Array, depth: ArrayLike) -> tuple[Array, Array, Array]:
        place = self.place(opening, depth, edge)
        _, lever = self.depth_and_lever(edge, opening, place)
        view: Any = edge_height(edge, place, opening / self.moving_blades)
        return place, lever, view.slope


def geometry_of_prior(recipe: Recipe, edge_prior: EdgeDistribution) -> Geometry:
    """The geometry of a recipe and an edge with its uncertainty."""
    return Geometry(
        edge_prior,
        recipe.upper_face_m,
        recipe.rig.moving_blades,
        recipe.fit.cut.reference_indentation_mm * 1e-3,
        recipe.scene.closure,
    )
