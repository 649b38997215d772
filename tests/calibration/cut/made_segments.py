"""Segments and parameters of a cut that nobody measured: plausible sizes, all features at once."""

from dataclasses import replace

import numpy as np

from scissorcal.calibration.cut.likelihood import response_table
from scissorcal.kernel import CutFitData, CutFitParameters
from scissorcal.model import Response

REFERENCE_M = 1.5e-4
PIECES = ((0, True, 6), (1, False, 8), (1, True, 7), (2, False, 8))
"""Rest, closing, segments: a fresh sheet, then two rests of which one is touched twice."""
SHEETS = ((9, 12), (7,))


def responses() -> dict[str, Response]:
    knots = tuple(np.geomspace(5e-5, 4e-4, 5).tolist())
    return {
        "power": Response("power", 0.66, 1.6, REFERENCE_M),
        "exponential": Response("exponential", 0.66, 1.6, REFERENCE_M),
        "spline": Response(
            "spline", 0.66, 1.6, REFERENCE_M, knots_m=knots, shape=np.array([0.2, -0.3, 0.1])
        ),
    }


def made_data(seed: int, edge_count: int = 2, known_sd: float = 0.0) -> CutFitData:
    """Elastic pieces at three rests and stretches on two sheets, with ``edge_count`` parameters."""
    rng = np.random.default_rng(seed)
    return CutFitData(
        moving_blades=2.0,
        reference_depth=REFERENCE_M,
        edge_count=edge_count,
        known_sd=known_sd,
        **_pieces(rng, edge_count),
        **_rests(rng, edge_count),
        **_runs(rng, edge_count),
    )


def _pieces(rng, q):
    lengths = [count for _, _, count in PIECES]
    rest = np.array([r for r, _, _ in PIECES], dtype=np.int32)
    whiteners = [_whitener(rng, count) for count in lengths]
    depth = []
    for _, closing, count in PIECES:
        way = np.linspace(-1.5e-4, 6e-4, count + 1)
        way = way if closing else way[::-1]
        depth.append(np.stack([way[:-1], way[1:]], axis=1))
    depth = np.concatenate(depth)
    # A carriage may keep the depth: in the material, and off it.
    depth[9], depth[-1] = depth[9].mean(), depth[-1].mean()
    n = len(depth)
    lever = rng.uniform(0.02, 0.05, n)
    side = np.concatenate(
        [np.full(count, -1.0 if closing else 1.0) for _, closing, count in PIECES]
    )
    held = 0.66 * np.maximum(depth / REFERENCE_M, 0.0).mean(axis=1) ** 1.6 * lever
    return {
        "piece_first": _starts(lengths),
        "piece_rest": rest,
        "piece_closing": np.array([closing for _, closing, _ in PIECES], dtype=np.int32),
        "white_first": _starts([len(w) for w in whiteners])[:-1],
        "whitener": np.concatenate(whiteners),
        "torque": held + 3e-3 * rng.standard_normal(n),
        "late": 1e-3 * rng.standard_normal(n),
        "direction": side * rng.uniform(0.4, 1.0, n),
        "depth": depth.ravel(),
        "depth_dx": -rng.uniform(0.2, 0.4, 2 * n),
        "lever": lever,
        "lever_dx": rng.uniform(0.9, 1.2, n),
        "sinking": 5e-3 * rng.standard_normal(n),
        "depth_de": 0.5 * rng.standard_normal(2 * n * q),
        "lever_de": 0.3 * rng.standard_normal(n * q),
    }


def _rests(rng, q):
    place = np.array([1e-5, 0.021, 0.034])
    return {
        "rest_known": np.array([1, 0, 0], dtype=np.int32),
        "rest_place": place,
        "rest_at_reference": place + 1e-3 * rng.uniform(-0.2, 0.6, 3),
        "rest_slope": rng.uniform(0.2, 0.4, 3),
        "rest_de": 0.5 * rng.standard_normal(3 * q),
    }


def _runs(rng, q):
    counts = [count for sheet in SHEETS for count in sheet]
    n = sum(counts)
    place = np.concatenate([np.sort(rng.uniform(0.0, 0.05, sum(sheet))) for sheet in SHEETS])
    weight = np.concatenate([np.full(counts[0], 0.005), np.zeros(counts[1]), np.full(counts[2], 1)])
    return {
        "run_first": _starts([sum(sheet) for sheet in SHEETS]),
        "joined": np.concatenate([np.arange(c) > 0 for c in counts]).astype(np.int32),
        "run_torque": 0.06 + 0.01 * rng.standard_normal(n),
        "run_late": 1e-3 * rng.standard_normal(n),
        "run_direction": -rng.uniform(0.8, 1.0, n),
        "run_lever": rng.uniform(0.02, 0.05, n),
        "run_lever_dd": rng.uniform(-3.0, 3.0, n),
        "run_slope": rng.uniform(0.15, 0.45, n),
        "run_slope_dd": rng.uniform(-2.0, 2.0, n),
        "run_lever_de": 0.3 * rng.standard_normal(n * q),
        "run_slope_de": 0.3 * rng.standard_normal(n * q),
        "run_sinking": rng.uniform(0.0, 0.02, n),
        "run_place": place,
        "run_step": -rng.uniform(4.8e-3, 5.2e-3, n),
        "run_noise": rng.uniform(0.5e-6, 2e-6, n),
        "start_noise": rng.uniform(1e-12, 4e-12, n),
        "end_noise": rng.uniform(1e-12, 4e-12, n),
        "line_weight": weight / weight.sum(),
        "line_log_torque": float(np.log(0.06)),
    }


def made_parameters(
    response: Response, fracture: str, *, edge_count: int = 2, plain: bool = False
) -> CutFitParameters:
    """Parameters; ``plain`` leaves out damping, load, delay, offsets and the sheets' variation."""
    log_depth, *rows = response_table(response, REFERENCE_M)
    log_force, slope, log_energy = (row[0] for row in rows)
    full = CutFitParameters(
        first=float(log_depth[0]),
        step=float(log_depth[1] - log_depth[0]),
        log_force=log_force,
        force_slope=slope,
        log_energy=log_energy,
        fracture=fracture,
        energy=0.55,
        kappa=0.72 if fracture == "rippled" else 1.0,
        rest_phase=0.6,
        rest_spread=0.2,
        variation=0.05,
        variation_length=2e-3,
        sheet_variation=0.01,
        offset_closing=6e-4,
        offset_opening=-4e-4,
        load=0.07,
        noise_scale=1.1,
        damping=4.0,
        delay=0.08,
        edge=np.linspace(3e-5, -2e-5, edge_count),
    )
    if not plain:
        return full
    return replace(
        full,
        sheet_variation=0.0,
        offset_closing=0.0,
        offset_opening=0.0,
        load=0.0,
        damping=0.0,
        delay=0.0,
    )


def _whitener(rng, count):
    mixing = np.eye(count) + 0.2 * np.tril(rng.standard_normal((count, count)), -1)
    root = 2e-3 * mixing
    return np.ascontiguousarray(np.linalg.inv(root)[np.tril_indices(count)])


def _starts(lengths):
    return np.concatenate([[0], np.cumsum(lengths)]).astype(np.int32)
