"""Cells of kernel and model that are no single state: long runs, laws alone, refused inputs."""

import math
from collections.abc import Callable

import numpy as np
from benchmarks.extremes.cells import Cell, Found, judged, worst_of
from benchmarks.extremes.long_runs import (
    balance_of_strokes,
    energy_of_throw,
    hostile_inputs,
    walk_of_strokes,
)
from benchmarks.extremes.refused_inputs import refused_tables, refused_walks
from benchmarks.extremes.states import REFERENCE_m

from scissorcal.bench.extremes.exact_laws import Exponential, Number, Power, TableCurve, mp
from scissorcal.kernel import Table, presliding_path
from scissorcal.model import (
    Cutting,
    Edge,
    FrictionLaw,
    Response,
    friction_torque,
    mean_share,
    presliding_state,
)

Run = Callable[[np.random.Generator], Found]

FLOAT32 = 2.0**-24

THROWN_BALANCE = 1e-2
LAW_ERROR = 1e-12


def cells() -> tuple[Cell, ...]:
    """The cells of kernel and model."""
    closed = "the same formula in 50 digits"
    books = "work, summed in float64, is stored + fracture + arrest"
    return (
        *(
            Cell(f"kernel, long run, {name}", "kernel", f"{name}; strokes of 1e-5 rad a step",
                 "energy balance, monotone crack, finite", books, _strokes(values), slow=slow)
            for name, values, slow in _LONG_RUNS
        ),
        Cell("kernel, thrown blades", "kernel", "inertia 1e-6 to 1e2 kg m^2",
             "kinetic energy turns into stored, fracture and arrest energy", books,
             _thrown, slow=True),
        Cell("kernel, time steps", "kernel",
             "steps of 1e-5 to 1 s with gaps, duplicates, backward jumps, NaN and infinity",
             "refused (INVALID) where a rate is not finite, else finite; the crack never recedes",
             "every output is looked at", hostile_inputs),
        Cell("kernel, tables of 2 and 256 knots", "kernel", "values over 16 decades",
             "right to 8 roundings of what is added", closed, _tables),
        Cell("model, crack walk", "model", "strokes of 1e-3 rad a tick, kappa 1e-3 to 1",
             "energy balance, monotone crack", "work is stored + lost", walk_of_strokes),
        Cell("model, crack walk, invalid", "model", "ticks of 0 s, NaN in law and motion",
             "refused with ValueError", "each is tried", refused_walks),
        Cell("kernel, invalid tables", "kernel", "knots, kappa, ranges and levels out of range",
             "refused with ValueError", "each is tried", refused_tables),
        Cell("model, power response", "model", "indentation 1e-15 to 0.1 m, exponent 0.5 to 8",
             "force, energy, inverse right to 1e-12", closed, _response("power")),
        Cell("model, exponential response", "model",
             "indentation 1e-15 to 0.1 m, exponent 0.5 to 8, up to exp(700)",
             "force, energy, inverse right to 1e-12", closed, _response("exponential")),
        Cell("model, mean of a ripple", "model", "kappa 1e-3 to 1 - 1e-15, exponent 0.5 to 8",
             "right to 1e-12", closed, _mean_share),
        Cell("model, friction", "model", "rates 0 to 1e3 rad/s, Stribeck rates 1e-9 to 1e6",
             "right to 1e-12", closed, _friction),
        Cell("model, presliding", "model", "lengths 1e-12 to 1e6 rad",
             "model and kernel agree to 1e-12, within -1 and 1", "Dahl's law step by step",
             _presliding),
    )  # fmt: skip


_LONG_RUNS: tuple[tuple[str, dict[str, float], bool], ...] = (
    ("everyday, smooth", {"kappa": 1.0}, False),
    ("everyday, rippled", {"kappa": 0.6}, False),
    ("kappa 1e-3, exponent 8", {"kappa": 1e-3, "exponent": 8.0}, True),
    ("kappa 0.999", {"kappa": 0.999}, True),
    ("exponent 0.5", {"kappa": 1.0, "exponent": 0.5}, True),
    ("exponent 8", {"kappa": 1.0, "exponent": 8.0}, True),
    ("thickness 1e-6 m", {"kappa": 1.0, "thickness": 1e-6}, True),
    ("thickness 2e-2 m", {"kappa": 1.0, "thickness": 2e-2, "toughness": 100.0}, True),
    ("toughness 1 J/m^2", {"kappa": 1.0, "toughness": 1.0}, True),
    ("toughness 1e5 J/m^2", {"kappa": 1.0, "toughness": 1e5}, True),
    ("256 knots", {"kappa": 0.8, "table_size": 256}, True),
    ("8 knots", {"kappa": 1.0, "table_size": 8}, True),
    ("edge nearly parallel", {"kappa": 1.0, "taper": -0.14}, True),
    ("curvature 5 /m", {"kappa": 1.0, "curvature": 5.0}, True),
)


def _strokes(values: dict[str, float]) -> Run:
    return lambda rng: balance_of_strokes(values)


def _thrown(rng: np.random.Generator) -> Found:
    found = [energy_of_throw(inertia, THROWN_BALANCE) for inertia in np.logspace(-6, 2, 9)]
    return worst_of(found)


def _tables(rng: np.random.Generator) -> Found:
    found = []
    for size in (2, 3, 256):
        for decades in (0.0, 4.0, 8.0):
            x = np.sort(10.0 ** rng.uniform(-decades, decades, size)).astype(np.float32)
            while not np.all(np.diff(x) > 0):
                more = (10.0 ** rng.uniform(-8, 8, 3)).astype(np.float32)
                x = np.unique(np.concatenate([x, more]))[:256]
            y = rng.standard_normal(len(x)) * 10.0 ** rng.uniform(-decades, decades)
            slope = rng.standard_normal(len(x)) * np.ptp(y) / np.ptp(x)
            table = Table(*(np.asarray(row, dtype=np.float32) for row in (x, y, slope)))
            exact = TableCurve.of(table)
            inner = rng.uniform(float(x[0]), float(x[-1]), 40)
            places = np.concatenate([inner, x, [2 * x[-1]]]).astype(np.float32)
            values = table.evaluate(places).astype(np.float64)
            for place, value in zip(places.tolist(), values.tolist(), strict=True):
                at = mp.mpf(place)
                size_of = float(_magnitude(exact, at))
                error = abs(float(mp.mpf(value) - exact.at(at)[0])) / max(size_of, 1e-300)
                found.append(judged(error, 8 * FLOAT32, f"a table of {len(x)} knots"))
    return worst_of(found)


def _magnitude(table: TableCurve, at: Number) -> Number:
    """Sum of the magnitudes of what adds up to the value: its rounding is a share of it."""
    i, width, (y, p, _, d) = table.piece(at)
    t = (at - table.x[i]) / width
    rise = abs(table.y[min(i + 1, len(table.y) - 1)] - y) if d else 0 * t
    return abs(y) + abs(t) * (abs(p) + abs(t) * (rise + 3 * abs(p) + 2 * abs(d)))


def _response(family: str) -> Run:
    kind = Power if family == "power" else Exponential

    def run(rng: np.random.Generator) -> Found:
        found = []
        for exponent in (0.5, 1.0, 1.6, 8.0):
            own = Response(family, 2.0, exponent, REFERENCE_m)  # type: ignore[arg-type]
            exact = kind(mp.mpf(2), mp.mpf(exponent), mp.mpf(REFERENCE_m))
            most = 0.1 if family == "power" else 690.0 * REFERENCE_m / exponent
            for delta in np.geomspace(1e-15, min(most, 0.1), 60) * rng.uniform(0.9, 1.0, 60):
                there = mp.mpf(float(delta))
                force, energy = exact.at(there), exact.energy(there)
                pairs = (
                    (float(own.force_at(delta)), force),
                    (float(own.energy_at(delta)), energy),
                    (float(own.indentation_at(float(force))), mp.mpf(float(delta))),
                )
                error = max(abs(float(mp.mpf(a) / b - 1)) for a, b in pairs)
                # the inverse magnifies the rounding of the force by delta / (n g / g')
                found.append(judged(error, LAW_ERROR, f"{family}, exponent {exponent}"))
        return worst_of(found)

    return run


def _mean_share(rng: np.random.Generator) -> Found:
    edge = Edge("line", 0.0, 0.0, 0.07)
    near_one = 1.0 - np.geomspace(1e-15, 0.5, 31)
    found = []
    for family, kind in (("power", Power), ("exponential", Exponential)):
        for exponent in (0.5, 1.0, 2.5, 8.0):
            own = Response(family, 2.0, exponent, REFERENCE_m)  # type: ignore[arg-type]
            exact = kind(mp.mpf(2), mp.mpf(exponent), mp.mpf(REFERENCE_m))
            for kappa in (*near_one.tolist(), 1e-3, 0.1):
                peak = float(10.0 ** rng.uniform(-3, 2))
                law = Cutting(edge, own, 2, 1e-4, 0.5, kappa)
                top = exact.inverse(mp.mpf(peak))
                bottom = exact.inverse(mp.mpf(kappa) * mp.mpf(peak))
                share = (exact.energy(top) - exact.energy(bottom)) / (top - bottom) / mp.mpf(peak)
                error = abs(float(mp.mpf(float(mean_share(law, peak))) / share - 1))
                found.append(judged(error, LAW_ERROR, f"{family}, kappa 1 - {1 - kappa:.2g}"))
    return worst_of(found)


def _friction(rng: np.random.Generator) -> Found:
    found = []
    for stribeck_rate in np.geomspace(1e-9, 1e6, 16):
        law = FrictionLaw(
            {"coulomb": 0.01, "viscous": 0.002, "stribeck": 0.005, "stribeck_rate": stribeck_rate}
        )
        for rate in [0.0, *np.geomspace(1e-12, 1e3, 40)]:
            speed = float(rate * rng.choice([-1.0, 1.0]))
            w, scale = mp.mpf(speed), mp.mpf(float(stribeck_rate))
            level = mp.mpf(0.01) + mp.mpf(0.005) * mp.exp(-((w / scale) ** 2))
            exact = mp.sign(w) * level + mp.mpf(0.002) * w
            value = mp.mpf(float(friction_torque(law, 0.3, speed)))
            error = float(abs(value - exact) / abs(exact)) if exact else float(abs(value))
            found.append(judged(error, LAW_ERROR, f"Stribeck rate {stribeck_rate:.2g}"))
    return worst_of(found)


def _presliding(rng: np.random.Generator) -> Found:
    found = []
    for length in np.geomspace(1e-12, 1e6, 10):
        path = np.cumsum(rng.standard_normal(300) * 10.0 ** rng.uniform(-6, 1, 300))
        path[50:60] = path[50]
        model, kernel = presliding_state(path, length), presliding_path(path, length)
        state, exact = mp.sign(path[1] - path[0]), []
        for step in np.diff(path):
            sign = mp.sign(mp.mpf(float(step)))
            if step:
                gone = mp.exp(-abs(mp.mpf(float(step))) / mp.mpf(float(length)))
                state = sign - (sign - state) * gone
            exact.append(float(state))
        error = float(np.abs(model[1:] - np.array(exact)).max())
        apart = float(np.abs(model - kernel).max())
        outside = float(np.maximum(np.abs(model), np.abs(kernel)).max()) > 1.0
        worst = math.inf if outside else max(error, apart)
        found.append(judged(worst, 1e-9, f"length {length:.2g} rad", states=len(path)))
    return worst_of(found)
