"""Cutting: where the crack tip settles, and the torque that the blades feel there."""

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from scissorcal.model.edge import Edge, EdgeView, edge_height
from scissorcal.model.response import Response

Array = NDArray[np.float64]

SETTLING_STEPS = 200
STEEPEST_START = 1e-9
FARTHEST = 100.0
"""Blade lengths beyond which no contact is looked for: a bent edge may have none at all."""


@dataclass(frozen=True)
class Cutting:
    """Everything that fixes the torque of a cut.

    ``moving_blades`` is 1 or 2, ``upper_face_m`` the plate's upper face y_top, ``fracture_energy``
    is J_c h in J per metre of cut (newtons), None where nothing is cut. ``kappa`` is the share of
    the fracture energy at which a running crack stops: 1 is smooth, below 1 ripples. ``closure`` is
    the torque's law: ``work`` derives from the stored energy, ``eq4`` is tau = x_c g cos(alpha).
    ``rate_damping`` c (s/m) makes the force at the edge g (1 + c d(delta)/dt), never below 0.
    """

    edge: Edge
    response: Response
    moving_blades: int
    upper_face_m: float
    fracture_energy: float | Array | None
    kappa: float | Array = 1.0
    closure: Literal["work", "eq4"] = "work"
    rate_damping: float | Array = 0.0


def cut_torque_along(
    cutting: Cutting, opening: Array, advance: Array, crack: float
) -> tuple[Array, Array]:
    """Average torque and crack tip along one motion, shape (N,) each.

    ``opening`` (rad) and ``advance`` (m) are samples in order of time, ``crack`` the tip's place
    in the plate (m) before. With kappa = 1 the tip is the running maximum of where it settles,
    so that no step depends on the sampling; material once cut gives no torque again.
    """
    if cutting.fracture_energy is None:
        tip = np.full(opening.shape, crack)
    else:
        settled = settled_contact(cutting, opening) + advance
        tip = np.maximum(np.maximum.accumulate(settled), crack)
    return torque_at(cutting, opening, tip - advance), tip


def settled_contact(cutting: Cutting, opening: ArrayLike) -> Array:
    """Contact x_c at which the crack just stands: m g(delta) tan(psi) = mean fracture energy.

    With a ripple (kappa < 1) the energy is the mean over a cycle, see :func:`mean_share`.
    Solved along the edge by Newton steps on y(s) = y_top - delta_c(psi(s)), one step for a
    straight edge. Where the edges are parallel or open towards the tip (tan(psi) <= 0) no force
    along the cut arises, the crack cannot advance, and the result is -inf.
    """
    if cutting.fracture_energy is None:
        raise ValueError("nothing is cut here: settled_contact needs a fracture energy")
    theta = np.asarray(opening, dtype=np.float64)
    beta = theta / cutting.moving_blades
    sine, cosine = np.sin(beta), np.cos(beta)
    edge = cutting.edge
    energy = np.asarray(cutting.fracture_energy)
    shape = np.broadcast_shapes(theta.shape, energy.shape, np.shape(cutting.kappa), edge.shape)
    station = np.full(shape, 0.5 * edge.length_m)
    far = FARTHEST * edge.length_m
    cuts = np.ones(shape, dtype=bool)
    for _ in range(1 if edge.straight else SETTLING_STEPS):
        taper = edge.slope_at(station)
        slope = (sine + taper * cosine) / (cosine - taper * sine)
        cuts = slope > STEEPEST_START
        peak = energy / (cutting.moving_blades * np.where(cuts, slope, 1.0))
        force = peak * mean_share(cutting, peak)
        target = cutting.upper_face_m - cutting.response.indentation_at(force)
        height = station * sine + edge.offset_at(station) * cosine
        rise = np.where(cuts, sine + taper * cosine, 1.0)
        step = np.where(cuts, (target - height) / rise, 0.0)
        station = np.clip(station + step, -far, far)
        if np.all(np.abs(step) < 1e-14):
            break
    x = station * cosine - edge.offset_at(station) * sine
    return np.where(cuts, x, -np.inf)


def torque_at(
    cutting: Cutting, opening: ArrayLike, contact: ArrayLike, rate: ArrayLike | None = None
) -> Array:
    """Torque with the crack held at ``contact``: the response alone, whatever it bears.

    ``work``: tau = g (x_c + phi tan(psi)), the gradient of the stored energy m * integral of g.
    ``eq4``: tau = x_c g cos(alpha). At rest, unless the opening's ``rate`` (rad/s) is given.
    """
    theta = np.asarray(opening, dtype=np.float64)
    x = np.asarray(contact, dtype=np.float64)
    reached = np.isfinite(x)
    view = edge_height(cutting.edge, np.where(reached, x, 0.0), theta / cutting.moving_blades)
    force = cutting.response.force_at(np.where(reached, cutting.upper_face_m - view.height, -1.0))
    if rate is not None:
        force = damped(cutting, view, force, np.asarray(rate, dtype=np.float64))
    if cutting.closure == "work":
        return np.asarray(force * view.lever)
    taper = cutting.edge.slope_at(view.station)
    return np.asarray(force * x / np.sqrt(1.0 + taper**2))


def damped(cutting: Cutting, view: EdgeView, force: Array, rate: Array) -> Array:
    """The response's force (N) while the edge sinks in or withdraws at the opening's rate.

    g (1 + c d(delta)/dt) with d(delta)/dt = -lever rate / m, and never below 0: on fast
    withdrawal contact is lost, because the material does not adhere (Hunt and Crossley 1975,
    doi:10.1115/1.3423596).
    """
    if not np.any(cutting.rate_damping):
        return force
    deepening = -view.lever * rate / cutting.moving_blades
    return np.asarray(force * np.maximum(1.0 + cutting.rate_damping * deepening, 0.0))


def mean_share(cutting: Cutting, peak: ArrayLike) -> Array:
    """Mean force over a fracture cycle as a share of its peak (N).

    Between two runs of the crack the indentation grows steadily from where g = kappa g_c to where
    g = g_c; the mean is that of g under a uniform indentation between both, exactly. A power law
    has the same share at every peak, (1 - kappa^((n+1)/n)) / ((n+1) (1 - kappa^(1/n))).
    """
    kappa = np.asarray(cutting.kappa)
    if np.all(kappa >= 1.0):
        return np.asarray(1.0)
    response = cutting.response
    if response.family == "power" and np.all(kappa < 1.0 - 1e-6):
        power = np.asarray(response.exponent)
        low = kappa ** (1.0 / power)
        return np.asarray((1.0 - kappa * low) / ((power + 1.0) * (1.0 - low)))
    force = np.asarray(peak, dtype=np.float64)
    bottom, top = response.indentation_at(kappa * force), response.indentation_at(force)
    length = np.maximum(top - bottom, 1e-30)
    mean = (response.energy_at(top) - response.energy_at(bottom)) / length
    return np.where(top - bottom <= 1e-12 * top, 1.0, mean / force)
