"""Cutting: where the crack tip settles, and the torque that the blades feel there."""

from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray

from scissorcal.aliases import Array
from scissorcal.model.checks import SMALLEST, check_moving_blades, check_name, check_numbers
from scissorcal.model.edge import Edge, EdgeView, edge_height
from scissorcal.model.response import Response

Closure = Literal["work", "eq4"]
_CLOSURES = get_args(Closure)

SETTLING_STEPS = 200
STEEPEST_START = 1e-9
NEARLY_EQUAL = 0.05
"""Share of an indentation up to which a cycle is averaged over the force, not from energies."""

_GAUSS = (
    0.5 * (1.0 + np.polynomial.legendre.leggauss(8)[0]),
    0.5 * np.polynomial.legendre.leggauss(8)[1],
)
FARTHEST = 100.0
"""Blade lengths beyond which no contact is looked for: a bent edge may have none at all."""

ROUNDING = 1e-16
SETTLED = 1e-14
CLOSE = 1e-13
"""Newton ends at a last step of the share ``ROUNDING`` of the station, or where steps below
``SETTLED`` (m) shrink no more; above ``CLOSE`` blade lengths it is not taken."""

PLACES = 257
HALVINGS = 60
BETWEEN = tuple((np.arange(8) + 0.5) / 8)
"""Places along the blade among which the first interval is looked for, and how often it is halved;
shares of a crack's run at which its release is looked at."""


@dataclass(frozen=True)
class Cutting:
    """Everything that fixes the torque of a cut.

    ``moving_blades`` is 1 or 2, ``upper_face_m`` the plate's upper face y_top, ``fracture_energy``
    is J_c h in J per metre of cut (newtons), None where nothing is cut. ``kappa`` is the share of
    the fracture energy at which a running crack stops: 1 is smooth, below 1 ripples. ``closure`` is
    the torque's law: ``work`` derives from the stored energy, ``eq4`` is tau = x_c g cos(alpha).
    ``rate_damping`` c (s/m) makes the force at the edge g (1 + c d(delta)/dt), never below 0.
    ModelError for other blades or closures, for a fracture energy that is not above 0, a kappa
    below 0 or above 1, a negative upper face or damping, and what is not finite.
    """

    edge: Edge
    response: Response
    moving_blades: int
    upper_face_m: float
    fracture_energy: float | Array | None
    kappa: float | Array = 1.0
    closure: Closure = "work"
    rate_damping: float | Array = 0.0

    def __post_init__(self) -> None:
        check_moving_blades(self.moving_blades)
        check_numbers("the height of the plate's upper face (m)", self.upper_face_m, 0.0)
        if self.fracture_energy is not None:
            check_numbers("the fracture energy of a cut (J/m)", self.fracture_energy, SMALLEST)
        check_numbers("kappa, the share at which a crack stops,", self.kappa, 0.0, 1.0)
        check_name("closure of a cut", self.closure, _CLOSURES)
        check_numbers("the rate damping of a cut (s/m)", self.rate_damping, 0.0)


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
    straight edge, from where it meets the plate so that no longer length is rounded; along a bent
    one where they do not end, by halving the first interval in which the release falls to that
    energy, from the pivot outwards. Where the edges are parallel or open towards the tip
    (tan(psi) <= 0) no force along the cut arises, the crack cannot advance, and the result is -inf.
    """
    if cutting.fracture_energy is None:
        raise ValueError("nothing is cut here: settled_contact needs a fracture energy")
    theta = np.asarray(opening, dtype=np.float64)
    beta = theta / cutting.moving_blades
    sine, cosine = np.sin(beta), np.cos(beta)
    edge = cutting.edge
    shape = np.broadcast_shapes(
        theta.shape, np.shape(cutting.fracture_energy), np.shape(cutting.kappa), edge.shape
    )
    station = np.full(shape, 0.5 * edge.length_m)
    far = FARTHEST * edge.length_m
    moved, still = np.full(shape, np.inf), np.zeros(shape, dtype=bool)
    with np.errstate(all="ignore"):
        if edge.straight:
            rise = sine + edge.slope_at(0.0) * cosine
            meets = (cutting.upper_face_m - edge.offset_at(0.0) * cosine) / rise
            station = np.where(np.isfinite(meets), np.clip(meets, -far, far), station)
        for _ in range(1 if edge.straight else SETTLING_STEPS):
            gap, rise = _gap(cutting, station, sine, cosine)
            cuts = np.isfinite(gap)
            step = np.where(cuts, gap / np.where(cuts, rise, 1.0), 0.0)
            station = np.clip(station + step, -far, far)
            moved, before = np.abs(step), moved
            still |= (moved < SETTLED) & (moved > 0.5 * before)  # what is left is rounding
            if np.all(still | (moved <= ROUNDING * np.abs(station))):
                break
        if not edge.straight:
            gap, _ = _gap(cutting, station, sine, cosine)
            settled = cuts & (np.abs(step) < CLOSE * edge.length_m) & np.isfinite(gap)
            if not np.all(settled):
                slow = _settled_by_halving(cutting, sine, cosine, shape)
                station = np.where(settled, station, slow)
                cuts = settled | np.isfinite(slow)
    x = station * cosine - edge.offset_at(np.where(cuts, station, 0.0)) * sine
    return np.where(cuts, x, -np.inf)


def contact_after_run(cutting: Cutting, opening: ArrayLike, contact: ArrayLike) -> Array:
    """Contact after the crack has run outwards from ``contact`` to where it rests.

    It runs if the release at ``contact`` exceeds the mean fracture energy, to the first place
    outwards that does not. Along a straight edge, and along any whose slope falls outwards, that
    is the larger of ``contact`` and :func:`settled_contact`. Elsewhere the release may rise again
    along the blade: then the places between are looked at, too. NaN where no edge stands over
    ``contact``.
    """
    start = np.asarray(contact, dtype=np.float64)
    settled = settled_contact(cutting, opening)
    edge = cutting.edge
    if edge.straight:
        return np.asarray(np.maximum(start, settled))
    beta = np.asarray(opening, dtype=np.float64) / cutting.moving_blades
    near = edge_height(edge, start, beta).station
    falls = edge.family == "arc" and bool(np.all(np.asarray(edge.curvature_per_m) <= 0.0))
    sine, cosine = np.sin(beta), np.cos(beta)
    with np.errstate(all="ignore"):
        far = edge_height(edge, np.where(np.isfinite(settled), settled, start), beta).station
        runs = (_gap(cutting, near, sine, cosine)[0] > 0.0) & (near < edge.length_m)
        first = runs & (far > near)
        for share in () if falls else BETWEEN:
            first &= _gap(cutting, near + share * (far - near), sine, cosine)[0] > 0.0
        place = np.where(runs, settled, start)
        if np.any(runs & ~first):
            shape = np.broadcast_shapes(place.shape, near.shape)
            found = _settled_by_halving(cutting, sine, cosine, shape, near)
            x = found * cosine - edge.offset_at(found) * sine
            place = np.where(runs & ~first, x, place)
    return np.where(np.isnan(near), np.nan, place)


def _gap(cutting: Cutting, station: Array, sine: Array, cosine: Array) -> tuple[Array, Array]:
    """How much deeper (m) the edge sits than where its release pays for the crack, and its rise.

    The gap is -inf where nothing is released: the edge is parallel or opens outwards, or is
    upright. The rise is dy/ds.
    """
    taper = cutting.edge.slope_at(station)
    run, rise = cosine - taper * sine, sine + taper * cosine
    slope = rise / run
    cuts = (run > 0.0) & (slope > STEEPEST_START)
    energy = np.asarray(cutting.fracture_energy)
    peak = energy / (cutting.moving_blades * np.where(cuts, slope, 1.0))
    target = cutting.response.indentation_at(peak * mean_share(cutting, peak))
    height = station * sine + cutting.edge.offset_at(station) * cosine
    return np.where(cuts, cutting.upper_face_m - target - height, -np.inf), rise


def _settled_by_halving(
    cutting: Cutting, sine: Array, cosine: Array, shape: tuple[int, ...], start: ArrayLike = 0.0
) -> Array:
    """The first station outwards from ``start`` at which the gap closes; NaN if open nowhere.

    Where it stays open up to the tip, the tip: material there is out of reach.
    """
    length = cutting.edge.length_m
    low, high = np.full(shape, np.nan), np.full(shape, np.nan)
    was_open = np.zeros(shape, dtype=bool)
    inner = np.asarray(start, dtype=np.float64)
    for share in np.linspace(0.0, 1.0, PLACES):
        at = np.broadcast_to(inner + share * (length - inner), shape)
        opened = _gap(cutting, at, sine, cosine)[0] > 0.0
        closes = was_open & ~opened & np.isnan(high)
        low = np.where(opened & np.isnan(high), at, low)
        high = np.where(closes, at, high)
        was_open = opened
    high = np.where(np.isnan(high), np.where(was_open, length, np.nan), high)
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        opened = _gap(cutting, middle, sine, cosine)[0] > 0.0
        low, high = np.where(opened, middle, low), np.where(opened, high, middle)
    return np.asarray(high)


def torque_at(
    cutting: Cutting, opening: ArrayLike, contact: ArrayLike, rate: ArrayLike | None = None
) -> Array:
    """Torque with the crack held at ``contact``: the response alone, whatever it bears.

    ``work``: tau = g (x_c + phi tan(psi)), the gradient of the stored energy m * integral of g.
    ``eq4``: tau = x_c g cos(alpha). At rest, unless the opening's ``rate`` (rad/s) is given.
    """
    theta = np.asarray(opening, dtype=np.float64)
    x = np.asarray(contact, dtype=np.float64)
    reached = ~np.isneginf(x)
    x = np.where(reached, x, 0.0)
    view = edge_height(cutting.edge, x, theta / cutting.moving_blades)
    force = cutting.response.force_at(np.where(reached, cutting.upper_face_m - view.height, -1.0))
    if rate is not None:
        force = damped(cutting, view, force, np.asarray(rate, dtype=np.float64))
    if cutting.closure == "work":
        return np.asarray(force * view.lever)
    taper = cutting.edge.slope_at(view.station)
    return np.asarray(force * x / np.sqrt(1.0 + taper**2))


def torque_on_blade(
    cutting: Cutting, opening: ArrayLike, place: ArrayLike, rate: ArrayLike | None = None
) -> Array:
    """The torque of :func:`torque_at`; 0 where the crack stands beyond the blade's tip.

    Material there is out of reach. NaN where no edge stands over ``place``.
    """
    theta = np.asarray(opening, dtype=np.float64)
    view = edge_height(cutting.edge, place, theta / cutting.moving_blades)
    beyond = view.station >= cutting.edge.length_m
    return np.where(beyond, 0.0, torque_at(cutting, theta, place, rate))


def within_thickness(cutting: Cutting, indentation: Array) -> NDArray[np.bool_]:
    """Whether the blades together sink in by no more than the material's thickness.

    Into what is only pressed nothing sinks deeper. Where something is cut, what bounds the
    indentation is the fracture energy: a thin sheet bends between blades that have passed each
    other by more than its thickness.
    """
    whole = cutting.moving_blades * cutting.upper_face_m
    pressed_only = cutting.fracture_energy is None
    return np.asarray(indentation <= whole) if pressed_only else np.ones_like(indentation, bool)


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
    with np.errstate(divide="ignore", invalid="ignore"):
        if response.family == "power":
            power = np.asarray(response.exponent)
            fall = np.log(kappa) / power
            share = np.expm1((power + 1.0) * fall) / ((power + 1.0) * np.expm1(fall))
        else:
            force = np.asarray(peak, dtype=np.float64)
            bottom, top = response.indentation_at(kappa * force), response.indentation_at(force)
            share = _mean_force(response, bottom, top) / force
    return np.where(kappa >= 1.0, 1.0, share)


def _mean_force(response: Response, bottom: Array, top: Array) -> Array:
    """Mean force (N) between two indentations, also where they are hardly apart.

    A difference of energies loses as many digits as they share; then the force itself is averaged,
    by the eight points of Gauss and Legendre.
    """
    width = top - bottom
    apart = (response.energy_at(top) - response.energy_at(bottom)) / width
    near = np.zeros(())
    for place, weight in zip(*_GAUSS, strict=True):
        near = near + weight * response.force_at(bottom + place * width)
    return np.where(width > NEARLY_EQUAL * top, apart, near)
