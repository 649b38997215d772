"""The likelihood of a cut written apart from the C core: dense normal densities, SciPy's splines.

Running segments are one multivariate normal a sheet, where the core has a Kalman filter; inverse
responses are found by bisection. The step of a rest's place is the core's, because 1e-10 m of place
are more than 1e-9 of a density.
"""

from dataclasses import dataclass

import numpy as np
from scipy.interpolate import CubicHermiteSpline, barycentric_interpolate
from scipy.optimize import brentq

from scissorcal.aliases import Array
from scissorcal.kernel import CutFitData, CutFitParameters

REST_STEPS, REST_REACH_M, ARRIVED_M = 30, 3e-5, 1e-7
KNOTS = 21
FLOOR_M = 2e-6


class Table:
    """Log force and log energy over log depth: cubic Hermite inside, power laws outside."""

    def __init__(self, given: CutFitParameters) -> None:
        count = len(given.log_force)
        x = given.first + given.step * np.arange(count)
        growth = np.exp(x + given.log_force - given.log_energy)
        self.x = x
        self.force = _extended(x, given.log_force, given.force_slope)
        self.energy = _extended(x, given.log_energy, growth)

    def log_force(self, log_depth: float) -> tuple[float, float]:
        """Value and slope."""
        return self.force(log_depth)

    def log_energy(self, log_depth: float) -> float:
        return self.energy(log_depth)[0]

    def log_depth(self, log_force: float) -> float:
        low, high = self.x[0] - 60.0, self.x[-1] + 60.0
        return float(
            brentq(lambda x: self.force(x)[0] - log_force, low, high, xtol=1e-15, rtol=1e-15)
        )


def _extended(x, y, slope):
    inside = CubicHermiteSpline(x, y, slope)
    by_x = inside.derivative()

    def value(at: float) -> tuple[float, float]:
        if at <= x[0]:
            return float(y[0] + slope[0] * (at - x[0])), float(slope[0])
        if at >= x[-1]:
            return float(y[-1] + slope[-1] * (at - x[-1])), float(slope[-1])
        return float(inside(at)), float(by_x(at))

    return value


def cycle(given: CutFitParameters, table: Table, blades: float, slope: float):
    """Depths at which a crack starts and stops, and the mean force between them over its peak."""
    log_peak = np.log(given.energy / (blades * slope))
    start = np.exp(table.log_depth(log_peak))
    if given.fracture != "rippled":
        return start, start, 1.0
    stop = np.exp(table.log_depth(log_peak + np.log(given.kappa)))
    gained = np.exp(table.log_energy(np.log(start))) - np.exp(table.log_energy(np.log(stop)))
    return start, stop, gained / (start - stop) / np.exp(log_peak)


@dataclass
class Twin:
    """What the core gives back, in its order."""

    total: float
    terms: Array
    residuals: Array
    standardised: Array
    places: Array
    log_period: float


def log_likelihood(
    data: CutFitData, given: CutFitParameters, *, exact_cycles: bool = False
) -> Twin:
    """All terms; ``exact_cycles`` leaves out the core's interpolation of cycles over the slope."""
    table = Table(given)
    terms, residuals, scaled, places = _elastic(data, given, table)
    period = 0.0
    count = len(data.run_torque)
    if given.fracture == "none" or count == 0:
        run = (np.zeros(count), np.zeros(count), np.zeros(count))
    else:
        *run, period = _running(data, given, table, exact_cycles)
    every = [np.concatenate(pair) for pair in zip((terms, residuals, scaled), run, strict=True)]
    return Twin(float(every[0].sum()), *every, places, period)


def _whitener(data: CutFitData, piece: int) -> Array:
    count = data.piece_first[piece + 1] - data.piece_first[piece]
    whole = np.zeros((count, count))
    first = data.white_first[piece]
    whole[np.tril_indices(count)] = data.whitener[first : first + count * (count + 1) // 2]
    return whole


def _damped(damping: float, sinking: Array) -> Array:
    return np.maximum(1.0 + damping * sinking, 0.0)


def _held_torque(data: CutFitData, given: CutFitParameters, table: Table, moved: Array):
    """Mean torque (k,) of each elastic segment and its derivative by the crack's place."""
    q, n = data.edge_count, len(data.lever)
    by_x, by_edge = data.depth_dx.reshape(n, 2), data.depth_de.reshape(n, 2, q)
    depth = data.depth.reshape(n, 2) + by_x * moved[:, None] + by_edge @ given.edge
    lever = data.lever + data.lever_dx * moved + data.lever_de.reshape(n, q) @ given.edge
    torque, slope = np.zeros(n), np.zeros(n)
    for k in range(n):
        way, middle = depth[k, 1] - depth[k, 0], depth[k].mean()
        factor = _damped(given.damping, data.sinking[k])
        if abs(way) <= 1e-3 * abs(middle):
            held = np.exp(table.log_force(float(np.log(middle)))[0]) if middle > 1e-12 else 0.0
            stiff = held * table.log_force(float(np.log(middle)))[1] / middle if held else 0.0
            torque[k] = factor * held * lever[k]
            slope[k] = factor * (stiff * by_x[k].mean() * lever[k] + held * data.lever_dx[k])
            continue
        (low, at_low), (high, at_high) = (_stored(table, d) for d in depth[k])
        force = (high - low) / way
        rising = (at_high - force) / way * by_x[k, 1] + (force - at_low) / way * by_x[k, 0]
        torque[k] = factor * force * lever[k]
        slope[k] = factor * (rising * lever[k] + force * data.lever_dx[k])
    return torque, slope


def _stored(table: Table, depth: float) -> tuple[float, float]:
    """Energy at a depth, and its derivative."""
    if depth <= 1e-12:
        return 0.0, 0.0
    log_energy, growth = table.energy(float(np.log(depth)))
    return float(np.exp(log_energy)), float(np.exp(log_energy) * growth / depth)


def beliefs(data: CutFitData, given: CutFitParameters, table: Table):
    """Where each rest is expected, and its standard deviation."""
    centre, spread = np.zeros(len(data.rest_place)), np.full(len(data.rest_place), data.known_sd)
    rest_de = data.rest_de.reshape(len(data.rest_place), data.edge_count)
    for r in np.flatnonzero(data.rest_known == 0):
        slope = data.rest_slope[r]
        start, stop, _ = cycle(given, table, data.moving_blades, slope)
        resting = stop + given.rest_phase * (start - stop)
        _, power = table.log_force(float(np.log(start)))
        centre[r] = (
            data.rest_at_reference[r]
            - (resting - data.reference_depth) / slope
            + rest_de[r] @ given.edge
        )
        parts = (
            given.rest_spread * (start - stop) / slope,
            given.variation * start / (power * slope),
            FLOOR_M,
        )
        spread[r] = np.sqrt(np.sum(np.square(parts)))
    return centre, spread


def _elastic(data: CutFitData, given: CutFitParameters, table: Table):
    count = len(data.torque)
    piece = np.repeat(np.arange(len(data.piece_rest)), np.diff(data.piece_first))
    rest, closing = data.piece_rest[piece], data.piece_closing[piece] == 1
    gain = 1.0 - given.load * data.direction
    offset = np.where(closing, given.offset_closing, given.offset_opening)
    white = np.zeros((count, count))
    for i in range(len(data.piece_rest)):
        here = slice(data.piece_first[i], data.piece_first[i + 1])
        white[here, here] = _whitener(data, i)
    centre, spread = beliefs(data, given, table)
    held = (data.rest_known == 1) & (data.known_sd <= 0.0)
    places = np.where(data.rest_known == 1, 0.0, data.rest_place)
    terms = np.log(np.diag(white)) - np.log(given.noise_scale)
    residuals, z = np.zeros(count), np.zeros(count)

    def seen(r: int, place: float):
        """Half the squares, pull and curvature at a place, with residuals and their whitened."""
        moved = np.where(rest == r, place - data.rest_place[rest], 0.0)
        torque, slope = _held_torque(data, given, table, moved)
        left = np.where(
            rest == r, data.torque - given.delay * data.late - gain * torque - offset, 0
        )
        scaled = white @ left / given.noise_scale
        by_place = white @ np.where(rest == r, -gain * slope, 0.0) / given.noise_scale
        weight = 0.0 if held[r] else spread[r] ** -2.0
        away = place - centre[r]
        return (
            0.5 * scaled @ scaled + 0.5 * weight * away**2,
            by_place @ scaled + weight * away,
            by_place @ by_place + weight,
            left,
            scaled,
        )

    for r in range(len(places)):
        now = seen(r, places[r])
        extra = 0.0
        for _ in range(0 if held[r] else REST_STEPS):
            move = -now[1] / now[2]
            if abs(move) < ARRIVED_M:
                extra = -0.5 * move * now[1]
                break
            move = float(np.clip(move, -REST_REACH_M, REST_REACH_M))
            after = seen(r, places[r] + move)
            while not after[0] <= now[0] and abs(move) >= ARRIVED_M:
                move *= 0.25
                after = seen(r, places[r] + move)
            if not after[0] <= now[0]:
                break
            places[r] += move
            now = after
        residuals += now[3]
        z += now[4]
        if held[r] or r not in data.piece_rest:
            continue
        first = data.piece_first[np.flatnonzero(data.piece_rest == r)[0]]
        away = (places[r] - centre[r]) / spread[r]
        terms[first] += -0.5 * away**2 - np.log(spread[r]) - 0.5 * np.log(now[2]) + extra
    return terms - 0.5 * z**2, residuals, z, places


def _cycles(data: CutFitData, given: CutFitParameters, table: Table, slope: Array, exact: bool):
    """Start, stop, share and exponent (4, k) at slopes."""

    def at(t: float) -> list[float]:
        start, stop, share = cycle(given, table, data.moving_blades, t)
        return [start, stop, share, table.log_force(float(np.log(start)))[1]]

    if exact:
        return np.array([at(t) for t in slope]).T
    low, high = 0.97 * data.run_slope.min(), 1.03 * data.run_slope.max()
    knots = np.linspace(low, high, KNOTS)
    known = np.array([at(t) for t in knots])
    found = []
    for t in slope:
        first = int(np.clip((t - knots[0]) // (knots[1] - knots[0]) - 1, 0, KNOTS - 4))
        here = slice(first, first + 4)
        found.append(barycentric_interpolate(knots[here], known[here], t))
    return np.array(found).T


def _running(data: CutFitData, given: CutFitParameters, table: Table, exact: bool):
    q, m = data.edge_count, data.moving_blades
    slope = data.run_slope + data.run_slope_de.reshape(len(data.run_slope), q) @ given.edge
    start, stop, share, power = _cycles(data, given, table, slope, exact)
    middle = 0.5 * (start + stop)
    slope = slope + data.run_slope_dd * (middle - data.reference_depth)
    lever = (
        data.run_lever
        + data.run_lever_dd * (middle - data.reference_depth)
        + data.run_lever_de.reshape(len(data.run_lever), q) @ given.edge
    )
    peak = given.energy * lever / (m * slope) * _damped(given.damping, data.run_sinking)
    torque = (1.0 - given.load * data.run_direction) * share * peak
    residuals = data.run_torque - given.delay * data.run_late - torque - given.offset_closing
    log_period = 0.0
    if given.fracture == "rippled":
        period = m * (start - stop) / (lever - middle * (1.0 + slope**2) / (power * slope))
        shown = data.line_weight > 0.0
        seen = torque + given.offset_closing
        at_torque = period * (np.exp(data.line_log_torque) / seen) ** (1.0 / power)
        log_period = float(data.line_weight[shown] @ np.log(at_torque[shown]))
    scaled, terms = np.zeros(len(torque)), np.zeros(len(torque))
    for low, high in zip(data.run_first[:-1], data.run_first[1:], strict=True):
        here = slice(low, high)
        root = np.linalg.cholesky(_covariance(data, given, torque, here))
        scaled[here] = np.linalg.solve(root, residuals[here])
        terms[here] = -0.5 * scaled[here] ** 2 - np.log(np.diag(root))
    return terms, residuals, scaled, log_period


def _covariance(data: CutFitData, given: CutFitParameters, torque: Array, here: slice) -> Array:
    """Covariance of one sheet's mean torques: unevenness, the sheet, works at ends, the drive."""
    size, place = torque[here], data.run_place[here]
    gone = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(place)))])
    memory = np.exp(-np.abs(gone[:, None] - gone) / given.variation_length)
    uneven = np.outer(size, size) * (given.variation**2 * memory + given.sheet_variation**2)
    works, count = [], len(size)
    rows = np.zeros((count, 2 * count))
    for k in range(count):
        each = 1.0 / data.run_step[here][k]
        if k == 0 or not data.joined[here][k]:
            works.append(data.start_noise[here][k])
        rows[k, len(works) - 1] = -each
        works.append(data.end_noise[here][k])
        rows[k, len(works) - 1] = each
    rows = rows[:, : len(works)]
    return uneven + (rows * np.array(works)) @ rows.T + np.diag(data.run_noise[here])
