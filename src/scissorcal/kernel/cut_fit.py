"""A cut's likelihood in C: arrays in, arrays out."""

from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from typing import Any

import numpy as np
from numpy.typing import NDArray

from scissorcal.aliases import Array
from scissorcal.kernel._kernel import ffi, lib

Integers = NDArray[np.int32]

# SC_CRACK_NONE, SC_CRACK_SMOOTH and SC_CRACK_RIPPLED have the same numbers.
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


@dataclass(frozen=True)
class Curve:
    """Values and slopes (k,) on an even grid: cubic between its knots, straight beyond them."""

    first: float
    step: float
    value: Array
    slope: Array

    def __post_init__(self) -> None:
        if len(self.value) != len(self.slope) or len(self.value) < 2 or not self.step > 0.0:
            raise ValueError("a curve needs two knots or more, a slope at each, a positive step")


@dataclass(frozen=True)
class CrackLaw:
    """What a blade and a sheet are, as ``sc_crack_law`` of sc_crack.h describes them.

    ``edge`` is the edge's offset (m) against the station (m); ``response`` and ``energy`` are the
    logarithms of one blade's force (N) and stored energy (J) against that of the indentation (m).
    ``fracture`` is "none", "smooth" or "rippled"; ``closure`` "work" or "eq4". ``tough`` (k,) is
    the energy per length (J/m) at places ``tough_step`` (m) apart from ``tough_first`` on, in the
    sheet's frame.
    """

    edge: Curve
    response: Curve
    energy: Curve
    moving_blades: int
    upper_face_m: float
    closure: str
    fracture: str
    kappa: float
    damping_s_per_m: float
    tick_s: float
    tough: Array
    tough_first: float
    tough_step: float

    def __post_init__(self) -> None:
        """Refuse with ValueError what no blade and no sheet are."""
        tough = np.asarray(self.tough)
        positive = (self.tick_s, self.tough_step)
        rules = (
            (self.moving_blades in (1, 2), "moving_blades is 1 or 2"),
            (0.0 <= self.kappa <= 1.0, "kappa lies between 0 and 1"),
            (all(0.0 < one < np.inf for one in positive), "tick_s and tough_step are positive"),
            (0.0 <= self.damping_s_per_m < np.inf, "damping_s_per_m is not negative"),
            (bool(np.isfinite([self.upper_face_m, self.tough_first]).all()), "places are finite"),
            (tough.size > 0 and bool(np.all((tough >= 0.0) & (tough < np.inf))),
             "tough has an energy or more, none of them negative"),
        )  # fmt: skip
        for holds, rule in rules:
            if not holds:
                raise ValueError(f"This is no law of a crack: {rule}, and all numbers are finite.")


@dataclass(frozen=True)
class CrackPath:
    """The result of a walk.

    ``torque`` and ``push`` (n - 1,) are means over each tick, ``place`` (n,) is the crack's.
    ``torque`` (N m) opens the blades, ``push`` (N) acts on the carriage against the advance.
    ``stored`` (J) is the elastic energy at the end, ``lost`` (J) what running cracks took,
    ``jumps`` how often one ran.
    """

    torque: Array
    push: Array
    place: Array
    stored: float
    lost: float
    jumps: int


def walk_crack(law: CrackLaw, opening: Array, advance: Array, place: float = 0.0) -> CrackPath:
    """Walk a crack along a motion: ``opening`` (n,) in rad and ``advance`` (n,) in m.

    ``place`` (m, sheet's frame) is where the crack stands before. Between samples the motion is
    linear, and starts of the crack lie at their exact time. ValueError where the arrays differ in
    length, are empty, or hold a number that is not finite.
    """
    theta = np.ascontiguousarray(opening, dtype=np.float64)
    moved = np.ascontiguousarray(advance, dtype=np.float64)
    if theta.shape != moved.shape or theta.ndim != 1 or len(theta) == 0:
        raise ValueError("opening and advance must be arrays of one length, not empty")
    if not (np.isfinite(place) and np.isfinite(theta).all() and np.isfinite(moved).all()):
        raise ValueError("opening, advance and place must be finite numbers")
    struct, keep = _struct(law)
    books = ffi.new("sc_crack_books *")
    books.place = place
    torque, push, tip = np.zeros(len(theta)), np.zeros(len(theta)), np.empty(len(theta))
    arrays = [ffi.from_buffer("double[]", a) for a in (theta, moved, torque, push, tip)]
    lib.sc_crack_walk(struct, *arrays[:2], len(theta), *arrays[2:], books)
    del keep
    return CrackPath(
        torque[:-1], push[:-1], tip, float(books.stored), float(books.lost), int(books.jumps)
    )


def _struct(law: CrackLaw) -> tuple[Any, list[Any]]:
    struct, keep = ffi.new("sc_crack_law *"), []

    def held(values: Array) -> Any:
        keep.append(ffi.from_buffer("double[]", np.ascontiguousarray(values, dtype=np.float64)))
        return keep[-1]

    for name in ("edge", "response", "energy"):
        curve, target = getattr(law, name), getattr(struct, name)
        target.size, target.first, target.step = len(curve.value), curve.first, curve.step
        target.value, target.slope = held(curve.value), held(curve.slope)
    struct.moving_blades, struct.upper_face = float(law.moving_blades), law.upper_face_m
    struct.eq4, struct.fracture = int(law.closure == "eq4"), _FRACTURE[law.fracture]
    struct.kappa, struct.damping, struct.tick_s = law.kappa, law.damping_s_per_m, law.tick_s
    struct.tough_size, struct.tough = len(law.tough), held(law.tough)
    struct.tough_first, struct.tough_step = law.tough_first, law.tough_step
    return struct, keep
