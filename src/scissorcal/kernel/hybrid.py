"""The hybrid force/position law from Python, by the same C function as in the loop."""

import math
from dataclasses import dataclass, fields
from enum import IntEnum, IntFlag
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from scissorcal.kernel._kernel import ffi, lib
from scissorcal.kernel.layout import dtype_of, fill_struct

MOST_AXES = int(lib.SC_HYBRID_MOST)
HYBRID_INPUT_DTYPE = dtype_of("sc_hybrid_input")
"""What a step needs: fields and units as in sc_hybrid.h, vectors and matrices for 3 axes."""
HYBRID_OUTPUT_DTYPE = dtype_of("sc_hybrid_output")
"""What a step gives: effort (3) of the axes; force_aim and pressing, N; mass, kg; gap_rate, m/s;
path_error, m; path_share; flags."""


class NormalLaw(IntEnum):
    """What acts along the normal. FORCE: a wanted force. POSITION: a wanted gap, force unused."""

    FORCE = 0
    POSITION = 1


class HybridFlag(IntFlag):
    """Flags of a step.

    INVALID: an input or the effort was not finite; SINGULAR: the axes cannot move the point in
    every direction. After either the efforts are 0, and contact starts afresh.
    CONTACT: touching; TOUCHED, LOST: touching began or ended in this step.
    EFFORT_LIMITED: an axis is at its limit, whatever the path; PATH_YIELDS: the path got less than
    its whole effort, to keep a limit. FORCE_BOUNDED: a force beyond ``touch_force`` to
    ``force_most`` was wanted.
    INTEGRAL_HELD: the integral did not grow, against a limit or while nothing is pressed.
    """

    INVALID = 1
    SINGULAR = 2
    CONTACT = 4
    TOUCHED = 8
    LOST = 16
    EFFORT_LIMITED = 32
    PATH_YIELDS = 64
    FORCE_BOUNDED = 128
    INTEGRAL_HELD = 256


@dataclass(frozen=True, kw_only=True)
class HybridConfig:
    """Gains and limits of the law, in SI units and radians; docs/control.md has the equations.

    ``axes`` 2 or 3. Along the normal: ``contact_kd`` (1/s), ``force_kp`` and ``force_ki`` (1/s)
    while touching; ``normal_kp`` (1/s^2) and ``normal_kd`` (1/s) of the approach and of POSITION.
    Below ``surface_cutoff_Hz`` the surface's rate along the normal is felt while touching, by the
    point's rate and the input ``compliance`` times the force's; 0 takes the given rate. Along the
    surface: ``path_kp``, ``path_kd``, ``path_ki`` (1/s^3); errors beyond ``path_error_most`` (m)
    count as that long.
    Wanted forces stay within ``touch_force`` to ``force_most`` (N) and change by ``force_slew``
    (N/s) at most; the integral, and the answer by ``force_kp``, stay within ``integral_most`` (N).
    Touching begins at ``touch_force`` and ends after ``leave_s`` below ``leave_force`` (N). The
    approach moves at ``approach_speed`` (m/s) or, from afar, by ``approach_rate`` (1/s) of the gap
    (it touches at ``approach_speed`` where the gap is known to ``approach_speed / approach_rate``),
    and pushes by ``approach_force`` (N) at most.
    ``friction_share`` of dry friction is compensated by the wanted rate of an axis or, where that
    rests, by the measured one: in proportion up to ``friction_rate`` (per axis, rad/s or m/s),
    along the surface up to ``slip_rate`` (m/s). Efforts stay within ``effort_limit`` (per axis). A
    Jacobian is singular where its columns, at unit length, span less than ``least_volume``: 1 where
    they are orthogonal. Raises ValueError for a number out of its range.

    >>> HybridConfig(axes=2, contact_kd=100.0, force_ki=20.0, normal_kp=2500.0, normal_kd=100.0,
    ...              path_kp=2500.0, path_kd=100.0, force_most=5.0, effort_limit=(0.5, 20.0),
    ...              friction_rate=(0.02, 0.002)).friction_share
    0.7
    """

    axes: int
    normal_law: NormalLaw = NormalLaw.FORCE
    contact_kd: float
    force_kp: float = 0.0
    force_ki: float
    surface_cutoff_Hz: float = 0.0
    normal_kp: float
    normal_kd: float
    path_kp: float
    path_kd: float
    path_ki: float = 0.0
    path_error_most: float = 2e-3
    force_most: float
    force_slew: float = 10.0
    integral_most: float = 3.0
    touch_force: float = 0.2
    leave_force: float = 0.1
    leave_s: float = 0.02
    approach_speed: float = 5e-3
    approach_rate: float = 0.0
    approach_force: float = 0.6
    friction_share: float = 0.7
    slip_rate: float = 0.02
    friction_rate: tuple[float, ...]
    effort_limit: tuple[float, ...]
    least_volume: float = 0.05

    def __post_init__(self) -> None:
        if self.axes not in (2, MOST_AXES):
            raise ValueError(f"The law is for 2 or 3 axes, not {self.axes}.")
        for name in ("friction_rate", "effort_limit"):
            if len(getattr(self, name)) != self.axes:
                raise ValueError(f"{name} needs a number for each of {self.axes} axes.")
        for field in fields(self):
            value = getattr(self, field.name)
            for number in value if isinstance(value, tuple) else (value,):
                if not 0.0 <= number < math.inf:
                    raise ValueError(
                        f"{field.name} = {value} is not usable: give finite numbers from 0 on."
                    )
        struct = ffi.new("sc_hybrid_config *")
        fill_struct(struct, self)
        if not lib.sc_hybrid_config_is_sound(struct):
            raise ValueError(
                "The law needs leave_force below touch_force, and that below "
                "approach_force and force_most; least_volume between 0 and 1; nothing beyond 1e9."
            )


def hybrid_inputs(count: int = 1, **columns: ArrayLike) -> NDArray[np.void]:
    """Inputs (count,) of HYBRID_INPUT_DTYPE, zero but for ``columns``, which broadcast.

    Vectors of two axes may have 2 places and matrices 2 by 2. What float32 cannot hold becomes
    infinite; the law refuses it. Raises ValueError for a name that is no field.

    >>> hybrid_inputs(2, force=[0.5, 1.0], normal=(0.0, 1.0))["normal"].tolist()
    [[0.0, 1.0, 0.0], [0.0, 1.0, 0.0]]
    """
    inputs = np.zeros(count, dtype=HYBRID_INPUT_DTYPE)
    for name, values in columns.items():
        column = np.asarray(values, dtype=np.float64)
        deep = inputs[name].ndim - 1
        place = (slice(None), *(slice(size) for size in column.shape[column.ndim - deep :]))
        with np.errstate(over="ignore"):
            inputs[name][place] = column
    return inputs


class Hybrid:
    """The law with its state: touching or not, the force's integral, the approach.

    >>> law = Hybrid(config)                                          # doctest: +SKIP
    >>> law.step(hybrid_inputs(force=0.5, ...))["effort"]             # doctest: +SKIP
    array([[0.012, 0.31, 0.0]], dtype=float32)
    """

    def __init__(self, config: HybridConfig) -> None:
        self.config = config
        self._config = ffi.new("sc_hybrid_config *")
        fill_struct(self._config, config)
        self._state = ffi.new("sc_hybrid *")

    def reset(self) -> None:
        """Start without contact."""
        self._state[0] = ffi.new("sc_hybrid *")[0]

    @property
    def touching(self) -> bool:
        """Whether the last step was in contact."""
        return bool(self._state.touching)

    @property
    def integral(self) -> float:
        """k_I times the integral of the force's error, N."""
        return float(self._state.integral)

    def step(self, inputs: NDArray[np.void]) -> NDArray[np.void]:
        """Take a step for each input, in order of time: (n,) of HYBRID_OUTPUT_DTYPE."""
        given: Any = np.ascontiguousarray(inputs, dtype=HYBRID_INPUT_DTYPE).reshape(-1)
        out = np.zeros(given.size, dtype=HYBRID_OUTPUT_DTYPE)
        lib.sc_hybrid_step_many(
            self._config,
            self._state,
            out.size,
            ffi.from_buffer("sc_hybrid_input[]", given),
            ffi.from_buffer("sc_hybrid_output[]", out, require_writable=True),
        )
        return out
