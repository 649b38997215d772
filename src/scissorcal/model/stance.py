"""Blades at given openings, looked at again and again: what an edge needs there is kept."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from scissorcal.model.cutting import (
    STEEPEST_START,
    Cutting,
    damped,
    mean_share,
    settled_contact,
)
from scissorcal.model.edge import Edge, EdgeView, edge_height

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Turned:
    """Blades turned by ``beta`` (n,): its sine and cosine, which no edge changes."""

    opening: Array
    moving_blades: int
    sine: Array
    cosine: Array

    @classmethod
    def at(cls, opening: Array, moving_blades: int) -> "Turned":
        """Turn the blades to ``opening`` (n,) in rad."""
        beta = np.asarray(opening, dtype=np.float64) / moving_blades
        return cls(np.asarray(opening, dtype=np.float64), moving_blades, np.sin(beta), np.cos(beta))


@dataclass(frozen=True)
class Stance:
    """One edge on turned blades (n,).

    A straight edge stands over x at ``height0 + slope x`` with height0 = offset / (cos(beta) -
    tan(taper) sin(beta)), so that everything asked of it is in closed form; a bent one (both None)
    is searched along, see :func:`edge_height` and :func:`settled_contact`.

    >>> edge = Edge("line", offset_m=-0.008, taper_rad=0.03, length_m=0.075)
    >>> stance = take_stance(edge, Turned.at(np.array([0.5]), 2))
    >>> exact = edge_height(edge, 0.03, 0.25)
    >>> bool(np.isclose(stance.view(np.array([0.03])).height[0], exact.height))
    True
    """

    edge: Edge
    turned: Turned
    slope: Array | None
    height0: Array | None

    def of(self, index: NDArray[np.int64]) -> "Stance":
        """The same edge on a selection of the openings."""
        t = self.turned
        chosen = Turned(t.opening[index], t.moving_blades, t.sine[index], t.cosine[index])
        if self.slope is None or self.height0 is None:
            return replace(self, turned=chosen)
        return Stance(self.edge, chosen, self.slope[index], self.height0[index])

    def view(self, contact: Array) -> EdgeView:
        """Height, slope, station and lever of the edge over ``contact`` (..., n) in metres."""
        if self.slope is None or self.height0 is None:
            return edge_height(self.edge, contact, self.turned.opening / self.turned.moving_blades)
        height = self.height0 + self.slope * contact
        station = contact * self.turned.cosine + height * self.turned.sine
        return EdgeView(
            height,
            np.broadcast_to(self.slope, height.shape),
            station,
            contact + height * self.slope,
        )


@dataclass(frozen=True)
class Settled:
    """Where a crack just stands (n,): ``contact`` (m), -inf where none can advance.

    ``force`` is the mean force at the edge there (N), ``peak`` the one that starts a run, ``slope``
    tan(psi), ``view`` the edge over the contact (over 0 where there is none).
    """

    contact: Array
    force: Array
    peak: Array
    cuts: NDArray[np.bool_]
    view: EdgeView


def take_stance(edge: Edge, turned: Turned) -> Stance:
    """Put an edge on turned blades."""
    if not edge.straight:
        return Stance(edge, turned, None, None)
    tangent = np.tan(edge.taper_rad)
    run = turned.cosine - tangent * turned.sine
    slope = (turned.sine + tangent * turned.cosine) / run
    return Stance(edge, turned, np.asarray(slope), np.asarray(edge.offset_m / run))


def settle(cutting: Cutting, stance: Stance) -> Settled:
    """Where the crack settles at each opening: :func:`settled_contact`, with the forces there."""
    if cutting.fracture_energy is None:
        raise ValueError("nothing is cut here: there is no place to settle at")
    energy = np.asarray(cutting.fracture_energy) / cutting.moving_blades
    if stance.slope is None or stance.height0 is None:
        contact = settled_contact(cutting, stance.turned.opening)
        cuts = np.isfinite(contact)
        view = stance.view(np.where(cuts, contact, 0.0))
        peak = energy / np.where(cuts, view.slope, 1.0)
        return Settled(contact, peak * mean_share(cutting, peak), peak, cuts, view)
    cuts = stance.slope > STEEPEST_START
    slope = np.where(cuts, stance.slope, 1.0)
    peak = energy / slope
    force = peak * mean_share(cutting, peak)
    depth = cutting.upper_face_m - cutting.response.indentation_at(force)
    contact = (depth - stance.height0) / slope
    view = stance.view(np.where(cuts, contact, 0.0))
    return Settled(np.where(cuts, contact, -np.inf), force, peak, cuts, view)


def torque_of(cutting: Cutting, view: EdgeView, contact: Array, force: Array) -> Array:
    """Torque of a force at the edge over ``contact``, by the cutting's closure."""
    if cutting.closure == "work":
        return np.asarray(force * view.lever)
    taper = cutting.edge.slope_at(view.station)
    return np.asarray(force * contact / np.sqrt(1.0 + taper**2))


def held_torque(
    cutting: Cutting, stance: Stance, contact: Array, rate: Array | None = None
) -> Array:
    """Torque with the crack held at ``contact`` (..., n): the response alone, whatever it bears.

    With the opening's ``rate`` (n,) in rad/s the response is damped, see :func:`damped`.
    """
    view = stance.view(contact)
    force = cutting.response.force_at(cutting.upper_face_m - view.height)
    if rate is not None:
        force = damped(cutting, view, force, rate)
    return torque_of(cutting, view, contact, force)
