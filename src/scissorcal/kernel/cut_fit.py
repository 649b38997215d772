"""A cut's likelihood in C: arrays in, arrays out."""

from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from typing import Any

import numpy as np
from numpy.typing import NDArray

from scissorcal.aliases import Array
from scissorcal.kernel._kernel import ffi, lib

Integers = NDArray[np.int32]

_FRACTURE: Mapping[str, int] = {
    "none": lib.SC_CUT_PRESSED,
    "smooth": lib.SC_CUT_SMOOTH,
    "rippled": lib.SC_CUT_RIPPLED,
}


@dataclass(frozen=True)
class CutFitData:
    """Measured segments and their geometry, as ``sc_cut_data`` of sc_cut_fit.h describes them.

    Integer arrays are int32, the others float64, all contiguous; ``edge_count`` is the number of
    the edge's parameters.
    """

    moving_blades: float
    reference_depth: float
    edge_count: int
    known_sd: float
    piece_first: Integers
    piece_rest: Integers
    piece_closing: Integers
    white_first: Integers
    whitener: Array
    torque: Array
    late: Array
    direction: Array
    depth: Array
    depth_dx: Array
    lever: Array
    lever_dx: Array
    sinking: Array
    depth_de: Array
    lever_de: Array
    rest_known: Integers
    rest_place: Array
    rest_at_reference: Array
    rest_slope: Array
    rest_de: Array
    run_first: Integers
    joined: Integers
    run_torque: Array
    run_late: Array
    run_direction: Array
    run_lever: Array
    run_lever_dd: Array
    run_slope: Array
    run_slope_dd: Array
    run_lever_de: Array
    run_slope_de: Array
    run_sinking: Array
    run_place: Array
    run_step: Array
    run_noise: Array
    start_noise: Array
    end_noise: Array
    line_weight: Array
    line_log_torque: float
    _c: Any = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        struct, keep = ffi.new("sc_cut_data *"), []
        struct.pieces, struct.rests = len(self.piece_rest), len(self.rest_place)
        struct.sheets = len(self.run_first) - 1
        for entry in fields(self):
            if entry.name == "_c":
                continue
            value = getattr(self, entry.name)
            if isinstance(value, np.ndarray):
                kind = "int32_t[]" if value.dtype == np.int32 else "double[]"
                value = ffi.from_buffer(kind, np.ascontiguousarray(value))
                keep.append(value)
            setattr(struct, entry.name, value)
        object.__setattr__(self, "_c", (struct, keep))

    @property
    def segments(self) -> int:
        """Elastic and running segments together."""
        return len(self.torque) + len(self.run_torque)


@dataclass(frozen=True)
class CutFitParameters:
    """Parameters as ``sc_cut_parameters`` of sc_cut_fit.h describes them; the table's arrays first.

    For one point numbers and arrays (size,), or for k points arrays (k,) and (k, size); what all
    have in common may be given once. ``fracture`` is "none", "smooth" or "rippled".
    """

    first: float
    step: float
    log_force: Array
    force_slope: Array
    log_energy: Array
    fracture: str
    energy: float | Array
    kappa: float | Array
    rest_phase: float | Array
    rest_spread: float | Array
    variation: float | Array
    variation_length: float | Array
    sheet_variation: float | Array
    offset_closing: float | Array
    offset_opening: float | Array
    load: float | Array
    noise_scale: float | Array
    damping: float | Array
    delay: float | Array
    edge: Array


def cut_log_likelihood(
    data: CutFitData, parameters: CutFitParameters
) -> tuple[float, Array, Array, Array, Array, float]:
    """Evaluate: total, terms (n,), residuals (n,) in N m, standardised (n,), places, log period.

    Segments stand in the data's order, elastic ones first. The total is -inf where any number is
    not finite.
    """
    structs, keep = _structs(parameters, 1)
    count, rests = data.segments, len(data.rest_place)
    terms, residuals, scaled = (np.zeros(count) for _ in range(3))
    places, work = np.zeros(max(rests, 1)), np.zeros(2 * len(data.torque) + 1)
    period = ffi.new("double *")
    total = lib.sc_cut_log_likelihood(
        data._c[0],
        structs,
        *(ffi.from_buffer("double[]", a) for a in (terms, residuals, scaled, places)),
        period,
        ffi.from_buffer("double[]", work),
    )
    del keep
    return float(total), terms, residuals, scaled, places[:rests], float(period[0])


def cut_log_likelihoods(
    data: CutFitData, parameters: CutFitParameters, count: int
) -> tuple[Array, Array]:
    """Totals and log periods of ``count`` points, both (count,)."""
    structs, keep = _structs(parameters, count)
    totals, periods = np.zeros(count), np.zeros(count)
    work = np.zeros(2 * data.segments + 2 * len(data.torque) + len(data.rest_place) + 1)
    lib.sc_cut_log_likelihoods(
        data._c[0],
        structs,
        count,
        *(ffi.from_buffer("double[]", a) for a in (totals, periods, work)),
    )
    del keep
    return totals, periods


_TABLES = ("log_force", "force_slope", "log_energy")
_NUMBERS = tuple(
    entry.name
    for entry in fields(CutFitParameters)
    if entry.name not in ("first", "step", "fracture", "edge", *_TABLES)
)


def _each(value: float | Array, count: int) -> list[float]:
    """One number for each point, of one for all or of (count,)."""
    if isinstance(value, float) or value.ndim == 0:
        return [float(value)] * count
    return value.tolist()  # type: ignore[no-any-return]


def _structs(given: CutFitParameters, count: int) -> tuple[Any, list[Any]]:
    """An array of ``count`` structs, and the buffers that they point into."""
    structs = ffi.new("sc_cut_parameters[]", count)
    arrays = {
        name: np.ascontiguousarray(np.atleast_2d(getattr(given, name)), dtype=np.float64)
        for name in (*_TABLES, "edge")
    }
    wrong = [name for name, array in arrays.items() if len(array) not in (1, count)]
    if wrong:
        raise ValueError(f"{', '.join(wrong)}: one row, or one for each of {count} points")
    buffers = {name: ffi.from_buffer("double[]", array) for name, array in arrays.items()}
    strides = {name: a.shape[1] if len(a) > 1 else 0 for name, a in arrays.items()}
    numbers = {name: _each(getattr(given, name), count) for name in _NUMBERS}
    fracture, size = _FRACTURE[given.fracture], arrays["log_force"].shape[1]
    for index in range(count):
        struct = structs[index]
        table = struct.response
        table.size, table.first, table.step = size, given.first, given.step
        for name in _TABLES:
            setattr(table, name, buffers[name] + index * strides[name])
        struct.fracture, struct.edge = fracture, buffers["edge"] + index * strides["edge"]
        for name, values in numbers.items():
            setattr(struct, name, values[index])
    return structs, [arrays, buffers]
