"""A crack under a blade's load, computed in C from sample to sample: arrays in, arrays out."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from scissorcal.aliases import Array
from scissorcal.kernel._kernel import ffi, lib

_FRACTURE: Mapping[str, int] = {
    "none": lib.SC_CRACK_NONE,
    "smooth": lib.SC_CRACK_SMOOTH,
    "rippled": lib.SC_CRACK_RIPPLED,
}


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
