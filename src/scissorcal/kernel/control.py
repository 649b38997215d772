"""The servo's mode CONTROL from Python: its configuration, contours, path and samples."""

import math
from dataclasses import dataclass, fields
from enum import IntEnum, IntFlag
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from scissorcal.kernel._kernel import ffi, lib
from scissorcal.kernel.hybrid import HybridConfig
from scissorcal.kernel.layout import dtype_of, fill_struct


class Mode(IntEnum):
    """IDLE: motors off. TRACK: follow the reference. RENDER: the model. DAMP: damping only.
    CONTROL: press on a surface and follow a path along it. WATCH: motors on, without torque, while
    the device renders by itself."""

    IDLE = 0
    TRACK = 1
    RENDER = 2
    DAMP = 3
    CONTROL = 4
    WATCH = 5


def refuse_mode(mode: Mode, has_model: bool, reference_size: int, path_size: int) -> None:
    """Raise ValueError for a mode that lacks what it needs: a model, a reference, a path."""
    if mode is Mode.RENDER and not has_model:
        raise ValueError("RENDER needs the tables of a model, and there are none.")
    if mode is Mode.TRACK and reference_size == 0:
        raise ValueError("TRACK needs a reference: call set_reference first.")
    if mode is Mode.CONTROL and path_size == 0:
        raise ValueError("CONTROL needs a configuration and a path: call set_path first.")


def refuse_change(*modes: int) -> None:
    """Raise ValueError for a change of what is followed where it is, or is asked for."""
    if Mode.TRACK in modes or Mode.CONTROL in modes:
        raise ValueError("The reference cannot change while TRACK or CONTROL follows it.")


def reference_arrays(
    opening: ArrayLike, opening_rate: ArrayLike, advance: ArrayLike, stroke: ArrayLike
) -> tuple[NDArray[np.float32], NDArray[np.float32], NDArray[np.float32], NDArray[np.int32]]:
    """Check a reference and return it as the C core takes it; ValueError if it is not valid."""
    places = [np.ascontiguousarray(a, dtype=np.float32) for a in (opening, opening_rate, advance)]
    strokes = np.ascontiguousarray(stroke, dtype=np.int32)
    n = places[0].size
    if n == 0 or any(a.shape != (n,) for a in (*places, strokes)):
        raise ValueError("A reference needs four arrays of one shape (N,), N >= 1.")
    if not all(np.isfinite(a).all() for a in places):
        raise ValueError("A reference must be finite throughout.")
    if np.any(np.abs(places[0]) > math.pi):
        raise ValueError("A reference's opening must stay within half a turn.")
    return places[0], places[1], places[2], strokes


CONTROL_DTYPE = dtype_of("sc_control_sample")
"""One tick of CONTROL: 64 bytes, fields and units as in sc_control.h and docs/control.md."""

FRICTION_POINTS = int(lib.SC_FRICTION_POINTS)


class ControlFlag(IntFlag):
    """Flags of a sample of CONTROL above those of a step of the law (HybridFlag).

    HELD: the blades stand, and the force is the last known one. LETS_GO: without a contour, or
    lifting. LIFTED: the tip is off the surface. DONE: the path's end is reached.
    """

    HELD = 0x1000
    LETS_GO = 0x2000
    LIFTED = 0x4000
    DONE = 0x8000


@dataclass(frozen=True, kw_only=True)
class AxisFriction:
    """Friction of one axis: its size over the rate, each way, and a factor over the place.

    ``positive`` and ``negative`` (FRICTION_POINTS each) are sizes (N m or N) at the rates
    :meth:`rates`; beyond ``fastest`` (rad/s or m/s) the last one is held. The factor is
    1 + ``slope`` d + ``bend`` d^2 at the distance d from ``centre``.
    """

    fastest: float
    positive: tuple[float, ...]
    negative: tuple[float, ...]
    slope: float = 0.0
    bend: float = 0.0
    centre: float = 0.0

    @staticmethod
    def rates(fastest: float) -> NDArray[np.float64]:
        """Rates at which sizes are stated: closer together near rest."""
        return np.asarray(fastest * np.linspace(0.0, 1.0, FRICTION_POINTS) ** 4)

    @property
    def largest(self) -> float:
        """The largest size either way, at the centre."""
        return max(*self.positive, *self.negative)


@dataclass(frozen=True, kw_only=True)
class ControlConfig:
    """What CONTROL needs to know of rig, surface and limits; names and units as in sc_control.h.

    ``law`` is for two axes, with its efforts limited by the servo's. ``station`` and
    ``edge_offset`` (m) are the tip's place on the blade. ``inertia`` (kg m^2), ``mass`` (kg),
    ``offset`` (N m), ``opening`` and ``advance`` are the axes', ``torque_zero`` (N m) the
    sensor's; ``surface_friction`` and
    ``stiffness`` (N/m, 0: not known) the material's. Raises ValueError for what the kernel refuses.
    """

    law: HybridConfig
    station: float
    edge_offset: float
    moving_blades: int
    inertia: float
    mass: float
    offset: float
    opening: AxisFriction
    advance: AxisFriction
    tick_s: float
    presliding: float
    surface_friction: float = 0.2
    stiffness: float = 0.0
    torque_zero: float = 0.0
    force_cutoff_Hz: float = 30.0
    force_band: float = 0.08
    torque_sd: float = 1e-3
    least_lever: float = 0.005
    pace_s: float = 0.2
    stale_s: float = 0.2
    end_s: float = 2.0
    lift_gap: float = 3e-3
    lift_speed: float = 0.02
    away: float = 2e-3
    approach_s: float = 10.0
    force_stop: float = 10.0
    path_stop: float = 5e-3
    handle_stop: float = 1.0
    handle_zero: float = 0.0
    sustained_s: float = 0.05

    def __post_init__(self) -> None:
        for friction in (self.opening, self.advance):
            if {len(friction.positive), len(friction.negative)} != {FRICTION_POINTS}:
                raise ValueError(f"friction needs {FRICTION_POINTS} sizes each way.")
        for field in fields(self):
            value = getattr(self, field.name)
            if isinstance(value, (int, float)) and not math.isfinite(value):
                raise ValueError(f"{field.name} = {value} is not a finite number.")
        struct = ffi.new("sc_control_config *")
        fill_struct(struct, self)
        if not lib.sc_control_config_is_sound(struct):
            raise ValueError(
                "CONTROL needs a law of force for 2 axes, without force_kp and surface_cutoff_Hz, "
                "which need a force sensor; 1 or 2 moving blades, and numbers from 0 on; station, "
                "inertia, mass, presliding, tick_s, away, end_s, approach_s and least_lever above "
                "0."
            )


@dataclass(frozen=True, kw_only=True)
class Contour:
    """The surface's curve in the rig's plane near the tip; see sc_control.h.

    ``point`` (m) and the unit ``normal`` out of the material, in the rig's x and y; ``curvature``
    (1/m) is positive where the surface bulges, ``place`` (m) counts along the surface in the
    direction (n_y, -n_x). ``velocity`` (m/s) and ``turn_rate`` (rad/s) are the material's.
    ``lift``: let go, and lift the tip.
    """

    point: tuple[float, float]
    normal: tuple[float, float]
    curvature: float
    place: float
    velocity: tuple[float, float] = (0.0, 0.0)
    turn_rate: float = 0.0
    lift: bool = False

    def __post_init__(self) -> None:
        """ValueError for a number that is not finite, or a normal of another length than 1."""
        numbers = (*self.point, *self.normal, self.curvature, self.place, *self.velocity)
        if not all(map(math.isfinite, (*numbers, self.turn_rate))):
            raise ValueError("A contour must be finite throughout.")
        if abs(math.hypot(*self.normal) - 1.0) > 1e-6:
            raise ValueError(f"The normal {self.normal} of a contour must have the length 1.")


def path_arrays(
    place: ArrayLike, rate: ArrayLike, force: ArrayLike, stage: ArrayLike
) -> tuple[NDArray[np.float32], NDArray[np.float32], NDArray[np.float32], NDArray[np.int32]]:
    """Check a path and return it as the C core takes it; ValueError if it is not valid."""
    numbers = [np.ascontiguousarray(a, dtype=np.float32) for a in (place, rate, force)]
    stages = np.ascontiguousarray(stage, dtype=np.int32)
    n = numbers[0].size
    if n == 0 or any(a.shape != (n,) for a in (*numbers, stages)):
        raise ValueError("A path needs four arrays of one shape (N,), N >= 1.")
    if not all(np.isfinite(a).all() for a in numbers):
        raise ValueError("A path must be finite throughout.")
    return numbers[0], numbers[1], numbers[2], stages


class ControlTask:
    """What a servo on its own follows in CONTROL."""

    def __init__(self, config: ControlConfig) -> None:
        self._config = ffi.new("sc_control_config *")
        fill_struct(self._config, config)
        self.pointer: Any = ffi.new("sc_control_task *")
        self.pointer.config = self._config
        self._arrays: tuple[NDArray[Any], ...] = ()

    def set_path(
        self, place: ArrayLike, rate: ArrayLike, force: ArrayLike, stage: ArrayLike
    ) -> None:
        """Set the path, one entry per tick: m, m/s, N, and the stage's number."""
        self._arrays = arrays = path_arrays(place, rate, force, stage)
        path = self.pointer.path
        path.place = ffi.from_buffer("float[]", arrays[0])
        path.rate = ffi.from_buffer("float[]", arrays[1])
        path.force = ffi.from_buffer("float[]", arrays[2])
        path.stage = ffi.from_buffer("int32_t[]", arrays[3])
        path.size = len(arrays[0])

    def send(self, contour: Contour) -> None:
        """Take a contour; the one before ends with it."""
        number = self.pointer.contour.number
        fill_struct(self.pointer.contour, contour)
        self.pointer.contour.number = (number + 1) & 0xFFFFFFFF

    @property
    def path_size(self) -> int:
        """Entries of the path."""
        return int(self.pointer.path.size)


class ControlBlock:
    """The side of CONTROL of a loop's shared memory."""

    def __init__(self, block: Any) -> None:
        self._block = block
        self._cursor = ffi.new("uint64_t *")
        self._lost = ffi.new("uint64_t *")

    def send(self, contour: Contour) -> None:
        """Send a contour to the loop."""
        struct = ffi.new("sc_contour *")
        fill_struct(struct, contour)
        lib.sc_control_block_send(ffi.addressof(self._block, "control"), struct)

    def read(self) -> NDArray[np.void]:
        """Samples of CONTROL that came since the last call: shape (n,), CONTROL_DTYPE."""
        control = ffi.addressof(self._block, "control")
        waiting = int(control.written) - int(self._cursor[0])
        samples = np.empty(max(0, min(waiting, int(lib.SC_CONTROL_RING))), dtype=CONTROL_DTYPE)
        place = ffi.from_buffer("sc_control_sample[]", samples, require_writable=True)
        count = lib.sc_control_block_read(control, self._cursor, place, len(samples), self._lost)
        return samples[:count]


def control_sample(servo: Any) -> NDArray[np.void]:
    """The last tick's sample of CONTROL of a C servo, shape (1,); a copy."""
    data = bytes(ffi.buffer(ffi.addressof(servo.control, "sample")))
    return np.frombuffer(data, dtype=CONTROL_DTYPE)
