"""From bounds of the tables to a bound of the torque, proved over boxes of the scene.

Boxes of opening and contact cover the scene. In each, intervals that contain every value of
station, slope, lever, indentation, force and stiffness turn the tables' bounds into one of the
torque:

    edge       d(phi) = d(e) (cos(beta) + tan(psi) sin(beta)) at fixed x, d(tan(psi)) likewise
    response   d(g) + g'(delta) d(phi)
    lever      d(phi) tan(psi) + phi d(tan(psi))
    crack      d(X) = d(H) / H', where H(s) = y(s) + g^-1(J / (m tan(psi))) - y_top is 0; its torque
               changes by d(tau)/dx d(X)
    friction   A d(L) + L d(A)

The proof is of the tables as cubics in exact arithmetic, their own rounding in float32 included.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from scissorcal.aliases import Array
from scissorcal.model import edge_height, settled_contact
from scissorcal.model.curvature import Span
from scissorcal.package.bound import PARALLEL
from scissorcal.package.compile import STRONGEST_N, Compiled, kernel_tables, table_file
from scissorcal.package.exact import ExactModel
from scissorcal.package.manifest import Ranges
from scissorcal.package.proved_tables import ProvedTable, profiles
from scissorcal.package.tables import TableLaw

OPENINGS, CONTACTS = 240, 240
STEEPEST = 0.05
"""Least run of the edge per length, as in the kernel: below, an edge stands upright."""
ATTEMPTS = 12
SPARE = 1.02
"""By this factor a table may bear more than its law where a crack is taken to stand."""

NO_ARITHMETIC = (
    "torque: the proof is of the tables; the float32 rounding of the step's other arithmetic, some "
    "1e-6 of the torque, is in the measured bound alone."
)


class _NotProvedError(Exception):
    """Why there is no proof, as the end of a sentence."""


def proved_torque(
    model: ExactModel,
    laws: Mapping[str, TableLaw],
    proofs: Mapping[str, ProvedTable | None],
    compiled: Compiled,
    scene: Ranges,
    limit: float,
) -> tuple[float | None, str]:
    """Bound |torque of the tables - torque of the model| over a scene, within the torque limit.

    Gives the bound in N m, None where there is none, and what it does not cover, in words.
    ``proofs`` are those of the tables in ``compiled``, by name. The places that the measured bound
    leaves out (tip, parallel edges, beyond 1e5 N) are left out here too.
    """
    kept = {name: proof for name, proof in proofs.items() if proof is not None}
    if missing := " and ".join(name for name in proofs if name not in kept):
        why = f"torque: no bound is proved, as none is of the table of {missing.replace('_', ' ')}."
        return None, why
    try:
        bound = _Scene(model, laws, kept, compiled, scene, limit).bound()
    except _NotProvedError as error:
        return None, f"torque: no bound is proved, as {error}."
    return bound, NO_ARITHMETIC


class _Scene:
    """The laws of a model over a scene, with the bounds of their tables."""

    def __init__(
        self,
        model: ExactModel,
        laws: Mapping[str, TableLaw],
        proofs: Mapping[str, ProvedTable],
        compiled: Compiled,
        scene: Ranges,
        limit: float,
    ) -> None:
        self.model, self.cutting, self.proofs = model, model.cutting, proofs
        self.compiled, self.scene, self.limit = compiled, scene, limit
        self.tables = kernel_tables(compiled.mechanics, scene, compiled.arrays)
        edge, response = laws["edge"], laws["response"]
        self.edge_slope, self.edge_bend = profiles(edge, compiled.arrays["tables/edge.npy"])
        self.stiffness, _ = profiles(response, compiled.arrays["tables/response.npy"])
        self.deepest = float(compiled.arrays["tables/response.npy"][0, -1])
        self.rates = scene.opening_rate_rad_per_s
        low, high = (angle / self.cutting.moving_blades for angle in scene.opening_rad)
        if high > 0.5 * np.pi:
            raise _NotProvedError("a blade turns by more than a right angle")
        ends = np.linspace(low, high, OPENINGS + 1)
        self.beta = Span(ends[:-1, None], ends[1:, None])
        self.sine = Span(np.sin(self.beta.low), np.sin(self.beta.high))
        self.cosine = Span(np.cos(self.beta.high), np.cos(self.beta.low))
        self.friction, self.friction_error = self._friction()

    def bound(self) -> float:
        """The largest bound among the boxes."""
        fracture = self.cutting.fracture_energy is not None
        ends = np.linspace(
            self.scene.contact_m[0],
            max(self.scene.contact_m[1], self.cutting.edge.length_m if fracture else 0.0),
            CONTACTS + 1,
        )
        contact = Span(ends[None, :-1], ends[None, 1:])
        wanted = contact.low <= self.scene.contact_m[1]
        if not fracture:
            box = self._box(contact)
            error = box.error
        else:
            place, away = self._crack()
            near = (contact.high >= place.low - away) & (contact.low <= place.high + away)
            wanted = (wanted & (contact.high >= place.low - away)) | near
            low = np.maximum(contact.low, place.low - away)
            box = self._box(Span(low, np.maximum(contact.high, low)), away)
            # a crack of the tables may stand in another box than the model's, by `away` at most
            worst, change = (
                np.max(np.where(near, part, 0.0), axis=1, keepdims=True)
                for part in (box.error, box.change)
            )
            error = np.where(near, worst + change * away, box.error)
        wanted = wanted & (box.station.low < self.cutting.edge.length_m)
        touching = wanted & (box.depth > 0.0)
        beyond = touching & (box.depth > self.deepest) & ~box.saturated
        if np.any(beyond):
            raise _NotProvedError(
                "somewhere the edge may sink deeper than the response table reaches"
            )
        largest = float(np.max(np.where(touching, error, 0.0), initial=0.0))
        if not largest + self.friction_error < self.limit:
            raise _NotProvedError(
                "the response is so steep somewhere in the scene that the bound would exceed the "
                "torque limit"
            )
        return largest + self.friction_error

    def _friction(self) -> tuple[float, float]:
        """Largest friction, and the bound of its error."""
        if self.model.friction is None:
            return 0.0, 0.0
        level, level_error = 0.0, 0.0
        for name in ("friction_opening", "friction_closing"):
            level = max(level, self._largest(name))
            level_error = max(level_error, self.proofs[name].proved)
        factor, factor_error = self._largest("friction_angle"), self.proofs["friction_angle"].proved
        return level * factor, factor * level_error + (level + level_error) * factor_error

    def _largest(self, name: str) -> float:
        """Largest magnitude of a law: that of its table's cubics, from their Bernstein points."""
        knots, values, slopes = self.compiled.arrays[table_file(name)].astype(np.float64)
        third = np.diff(knots) / 3.0
        points = [values, values[:-1] + slopes[:-1] * third, values[1:] - slopes[1:] * third]
        return float(max(np.max(np.abs(part)) for part in points)) + self.proofs[name].proved

    def _box(self, contact: Span, away: Array | None = None) -> "_Box":
        """Everything about boxes of contact at the openings: arrays broadcast to their shape.

        With ``away``, the bound of the crack's place, no box is deeper than where a crack stands.
        """
        cutting, edge = self.cutting, self.cutting.edge
        middle = 0.5 * (self.beta.low + self.beta.high), 0.5 * (contact.low + contact.high)
        half = 0.5 * (self.beta.high - self.beta.low), 0.5 * (contact.high - contact.low)
        view = edge_height(edge, middle[1], middle[0])
        whole = self.edge_slope.over(Span(self.edge_slope.ends[:1], self.edge_slope.ends[-1:]))
        run = float(np.min(self.cosine.low - np.maximum(whole.high, 0.0) * self.sine.high))
        if run < STEEPEST:
            raise _NotProvedError("the edge may stand upright somewhere in the scene")
        stations = np.abs(self.edge_slope.ends).max()
        height = stations * self.sine.high + np.max(np.abs(edge.offset_at(self.edge_slope.ends)))
        reach = half[1] / run + half[0] * height / run
        station = Span(view.station - reach, view.station + reach)
        own = self.proofs["edge"]
        offset_error = own.over(own.value + own.rounding, station.low, station.high)
        taper = self.edge_slope.over(station)
        bend = self.edge_bend.over(station).largest
        drift = offset_error * self.sine.high / run
        taper_error = own.over(own.slope, station.low - drift, station.high + drift) + bend * drift
        slope = Span(
            np.tan(self.beta.low + np.arctan(taper.low - taper_error)),
            np.tan(self.beta.high + np.arctan(taper.high + taper_error)),
        )
        steep = slope.largest
        lever_most = contact.high + height * steep
        phi_half = steep * half[1] + lever_most * half[0]
        phi = Span(view.height - phi_half, view.height + phi_half)
        lever = contact + phi * slope
        phi_error = offset_error * (self.cosine.high + steep * self.sine.high)
        slope_error = taper_error * (1.0 + steep**2)
        lever_error = phi_error * steep + (phi.largest + phi_error) * slope_error
        lever_change = 1.0 + steep**2 + phi.largest * bend * (1.0 + steep**2) / run
        arm, arm_error, arm_change = lever.largest, lever_error, lever_change
        if cutting.closure == "eq4":
            arm, arm_error = contact.high + 0.0 * arm, contact.high * taper_error
            arm_change = 1.0 + contact.high * bend / run
        indentation = Span(cutting.upper_face_m - phi.high, cutting.upper_face_m - phi.low)
        if away is not None:
            borne = self._borne(slope) + steep * away + phi_error
            indentation = Span(indentation.low, np.minimum(indentation.high, borne))
        felt = Span(
            np.maximum(np.minimum(indentation.low, indentation.high) - phi_error, 0.0),
            np.clip(indentation.high + phi_error, 0.0, self.deepest),
        )
        own = self.proofs["response"]
        stiffness = self.stiffness.over(felt).high
        force = cutting.response.force_at(felt.high)
        sunk = self._rise(felt, phi_error, stiffness)
        force_error = own.over(own.value + own.rounding, felt.low, felt.high) + sunk
        by_rate = float(cutting.rate_damping) * self.rates[1] / cutting.moving_blades
        factor = 1.0 + by_rate * (lever.largest + lever_error)
        error = factor * (force_error * (arm + arm_error) + force * arm_error)
        error = error + force * (arm + arm_error) * by_rate * lever_error
        change = factor * (stiffness * steep * arm + force * arm_change)
        change = change + force * arm * by_rate * lever_change
        # deeper than the table: both are at the limit where its end already is
        least = np.maximum(lever.low - lever_error, 0.0)
        if cutting.closure == "eq4":
            steepest = np.maximum(np.abs(taper.low), np.abs(taper.high)) + taper_error
            least = contact.low / np.sqrt(1.0 + steepest**2)
        end = float(self.compiled.arrays["tables/response.npy"][1, -1]) - own.proved
        slack = np.maximum(1.0 - by_rate * (lever.largest + lever_error), 0.0)
        saturated = end * least * slack >= self.limit + self.friction + self.friction_error
        return _Box(station, indentation.high + phi_error, error, change, saturated)

    def _borne(self, slope: Span) -> Array:
        """The deepest indentation at which a crack stands, of the law and of its table."""
        cutting = self.cutting
        energy = float(cutting.fracture_energy or 0.0)
        least = max(PARALLEL, 2.0 * energy / (cutting.moving_blades * STRONGEST_N))
        force = energy / (cutting.moving_blades * np.maximum(slope.low, least))
        own = self.proofs["response"]
        depth = cutting.response.indentation_at(SPARE * force)
        known = np.minimum(depth, self.deepest)
        error = own.over(own.value + own.rounding, 0.98 * known, known)
        return np.where(error <= (SPARE - 1.0) * force, depth, np.inf)

    def _rise(self, felt: Span, away: Array, stiffness: Array) -> Array:
        """By how much the force may change where the indentation changes by ``away``."""
        response = self.cutting.response
        with np.errstate(invalid="ignore"):
            rises = [np.where(away > 0.0, away * stiffness, 0.0)]
        rises.append(response.force_at(felt.high) - response.force_at(felt.low))
        if response.family == "power" and float(np.asarray(response.exponent)) <= 1.0:
            rises.append(response.force_at(away))  # concave: steepest at 0
        return np.asarray(np.fmin.reduce(rises))

    def _crack(self) -> tuple[Span, Array]:
        """Where the crack settles at each opening, and the bound of the error of that place."""
        if not self.tables.release_falls:
            raise _NotProvedError("the crack may settle at more than one place")
        cutting, edge, blades = self.cutting, self.cutting.edge, self.cutting.moving_blades
        used = float(np.float32(self.tables.fracture_energy))
        exact = float(cutting.fracture_energy or 0.0)
        if float(cutting.kappa) < 1.0:
            table = self.compiled.arrays["tables/mean_energy.npy"]
            used = float(np.float32(np.min(table[1])))
            power = 1.0 + 1.0 / float(np.asarray(cutting.response.exponent))
            kappa, count = float(cutting.kappa), float(np.asarray(cutting.response.exponent))
            exact *= (1.0 - kappa**power) / ((count + 1.0) * (1.0 - kappa ** (1.0 / count)))
        openings = [blades * beta for beta in (self.beta.low, self.beta.high)]
        found = [settled_contact(cutting, opening) for opening in openings]
        if not all(np.isfinite(place).all() for place in found):
            raise _NotProvedError("the edges become parallel within the scene")
        views = [
            edge_height(edge, place, beta)
            for place, beta in zip(found, (self.beta.low, self.beta.high), strict=True)
        ]
        stations = Span.between(views[0].station, views[1].station)
        pad = 0.25 * (stations.high - stations.low) + 1e-6
        for _ in range(ATTEMPTS):
            bracket = Span(stations.low - pad, stations.high + pad)
            error, grade, holds = self._gap(bracket, exact, abs(used - exact))
            past = bracket.low > edge.length_m
            if np.all(holds | past):
                break
            pad = np.where(holds, pad, 1.6 * pad)
        else:
            raise _NotProvedError("the place where the crack settles could not be enclosed")
        shift = np.where(past, 0.0, error / grade)
        run = self.cosine.high + np.abs(self.edge_slope.over(bracket).low) * self.sine.high
        own = self.proofs["edge"]
        offset = own.over(own.value + own.rounding, bracket.low, bracket.high)
        away = run * shift + self.sine.high * offset
        ends = [
            self.cosine * station - self.sine * edge.offset_at(station)
            for station in (bracket.low, bracket.high)
        ]
        return Span(ends[0].low, ends[1].high), away

    def _gap(
        self, bracket: Span, energy: float, off: float
    ) -> tuple[Array, Array, NDArray[np.bool_]]:
        """Error of H over the bracket, the least of H', and whether its root lies inside."""
        cutting, blades = self.cutting, self.cutting.moving_blades
        edge, own = cutting.edge, self.proofs["edge"]
        offset = own.over(own.value + own.rounding, bracket.low, bracket.high)
        taper_error = own.over(own.slope, bracket.low, bracket.high)
        taper = self.edge_slope.over(bracket)
        bend = self.edge_bend.over(bracket).largest
        slope = Span(
            np.tan(self.beta.low + np.arctan(taper.low - taper_error)),
            np.tan(self.beta.high + np.arctan(taper.high + taper_error)),
        )
        least = max(PARALLEL, 2.0 * energy / (blades * STRONGEST_N))
        if np.any(slope.high <= least):
            raise _NotProvedError("the edges become parallel within the scene")
        slope = Span(np.maximum(slope.low, least), slope.high)
        force = Span((energy - off) / (blades * slope.high), (energy + off) / (blades * slope.low))
        own = self.proofs["response"]
        depth = Span(*(cutting.response.indentation_at(end) for end in (force.low, force.high)))
        spare = 0.02 * (depth.high - depth.low) + 0.01 * depth.low
        wide = Span(np.maximum(depth.low - spare, 0.0), depth.high + spare)
        stiffness = self.stiffness.over(wide).low
        table = own.over(own.value + own.rounding, wide.low, np.minimum(wide.high, self.deepest))
        by_slope = force.high * taper_error * (1.0 + slope.high**2) / slope.low
        force_error = table + by_slope + force.high * off / energy
        with np.errstate(divide="ignore", invalid="ignore"):
            depth_error = force_error / stiffness
            # the law's inverse is followed within `wide` only
            depth_error = np.where(depth_error <= spare, depth_error, np.inf)
            error = self.cosine.high * offset + depth_error
            turn = force.high * bend * (1.0 + slope.high**2) / (slope.low * stiffness)
        grade = self.sine.low + (taper.low - taper_error) * self.cosine.low - turn

        def gap(station: Array) -> Span:
            """H at one station, over the openings."""
            own_taper = edge.slope_at(station)
            tangent = Span(
                np.tan(self.beta.low + np.arctan(own_taper)),
                np.tan(self.beta.high + np.arctan(own_taper)),
            )
            forces = [energy / (blades * np.maximum(t, least)) for t in (tangent.high, tangent.low)]
            depths = Span(*(cutting.response.indentation_at(end) for end in forces))
            height = self.sine * station + self.cosine * edge.offset_at(station)
            return height + depths - cutting.upper_face_m

        holds = (gap(bracket.low).high + error < 0.0) & (gap(bracket.high).low - error > 0.0)
        return error, grade, holds & (grade > 0.0)


@dataclass(frozen=True)
class _Box:
    """Bounds of boxes: the deepest indentation, the torque's error, and ``change``, d(tau)/dx."""

    station: Span
    depth: Array
    error: Array
    change: Array
    saturated: NDArray[np.bool_]
