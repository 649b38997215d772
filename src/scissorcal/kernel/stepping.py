"""The model's step from Python: one at a time, or many in one C loop."""

from enum import IntFlag
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from scissorcal.kernel._kernel import ffi, lib
from scissorcal.kernel.layout import dtype_of
from scissorcal.kernel.tables import ModelTables, model_struct

STEP_DTYPE = dtype_of("sc_step_output")
"""One step's output as a structured array holds it; fields as in :class:`StepOutput`."""


class StepFlag(IntFlag):
    """Flags of a step.

    INVALID: an input was not finite, or the edge stands upright; torque and force are 0.
    TOUCHING: the edge indents the material. ADVANCED: the crack did, in this step.
    OUT_OF_RANGE: opening or contact lie outside what the tables were made for.
    BEYOND_TIP: the material is out of the blade's reach, no force until the blades have opened.
    NOT_CUTTING: the edges are parallel or open outwards, so that the crack cannot advance.
    """

    INVALID = 1
    TOUCHING = 2
    ADVANCED = 4
    OUT_OF_RANGE = 8
    BEYOND_TIP = 16
    NOT_CUTTING = 32


class StepOutput(NamedTuple):
    """The output of one step.

    ``torque`` (N m, positive opens; friction included if rendered) and ``force`` (N, along the
    cut) act on the pivot. ``contact``, ``indentation`` and ``height`` phi are metres,
    ``response`` g newtons. ``stored_J`` is the energy in the pressed material; ``fracture_J``
    and ``arrest_J`` are what this step's crack advance took and lost.
    """

    torque: float
    force: float
    contact: float
    indentation: float
    height: float
    response: float
    friction_torque: float
    stored_J: float
    fracture_J: float
    arrest_J: float
    flags: int


class Kernel:
    """A model with a crack in it, stepped in C.

    >>> kernel = Kernel(tables)                                       # doctest: +SKIP
    >>> kernel.step(opening=0.5, rate=-0.3, advance=-0.03).torque     # doctest: +SKIP
    0.0531
    """

    def __init__(self, tables: ModelTables) -> None:
        self.tables = tables
        self._model, self._keep = model_struct(tables)
        self._state = ffi.new("sc_crack *")
        self._out = ffi.new("sc_step_output *")

    def reset(self, crack: float = 0.0) -> None:
        """Put the crack tip at ``crack`` (m, plate frame); a fresh sheet has it at 0."""
        if not np.isfinite(np.float32(crack)):
            raise ValueError(f"The crack tip must stand at a finite place, not {crack}.")
        self._state.crack = crack
        self._state.detached = 0

    @property
    def crack(self) -> float:
        """Crack tip X in metres, plate frame. It never decreases but by :meth:`reset`."""
        return float(self._state.crack)

    def step(self, opening: float, rate: float, advance: float) -> StepOutput:
        """Move the blades to ``opening`` (rad) and ``advance`` (m) at ``rate`` (rad/s).

        An input that is not finite gives zero torque and StepFlag.INVALID, and changes nothing.
        """
        out = self._out
        lib.sc_model_step(self._model, self._state, opening, rate, advance, out)
        return step_output(out)

    def step_many(
        self, opening: ArrayLike, rate: ArrayLike, advance: ArrayLike
    ) -> NDArray[np.void]:
        """Take N steps in one C loop; inputs broadcast to shape (N,).

        Returns shape (N,) with STEP_DTYPE.
        """
        return step_many(lib.sc_model_step_many, (self._model, self._state), opening, rate, advance)

    def torque(
        self, opening: ArrayLike, rate: ArrayLike, contact: ArrayLike
    ) -> NDArray[np.float32]:
        """Static torque (N m), friction included if rendered; the arguments broadcast.

        Where the blades press harder at ``contact`` than the material bears, the crack first
        runs outwards to m g tan(psi) = J_c h. Neither needs nor changes the crack's state.
        Raises ValueError for arguments that are not finite. NaN where a step would be
        StepFlag.INVALID: beyond half a turn, or where the edge leans back.
        """
        inputs = _float32_columns(opening, rate, contact)
        if not all(np.isfinite(column).all() for column in inputs):
            raise ValueError("Torque is asked for at an opening, rate or contact not finite.")
        shape = np.broadcast_shapes(*(np.shape(a) for a in (opening, rate, contact)))
        torque = np.empty(inputs[0].size, dtype=np.float32)
        lib.sc_model_torque_many(
            self._model,
            torque.size,
            *(ffi.from_buffer("float[]", column) for column in inputs),
            ffi.from_buffer("float[]", torque, require_writable=True),
        )
        return torque.reshape(shape)


def step_many(
    function: Any, stepped: tuple[Any, ...], opening: ArrayLike, rate: ArrayLike, advance: ArrayLike
) -> NDArray[np.void]:
    """What a C function that takes N steps gives: shape (N,) with STEP_DTYPE.

    ``stepped`` is what it takes first; the inputs broadcast to shape (N,).
    """
    inputs = _float32_columns(opening, rate, advance)
    out = np.zeros(inputs[0].size, dtype=STEP_DTYPE)
    function(
        *stepped,
        out.size,
        *(ffi.from_buffer("float[]", column) for column in inputs),
        ffi.from_buffer("sc_step_output[]", out, require_writable=True),
    )
    return out


def step_output(out: Any) -> StepOutput:
    """The output of a step as the C struct ``out`` has it."""
    return StepOutput(
        out.torque,
        out.force,
        out.contact,
        out.indentation,
        out.height,
        out.response,
        out.friction_torque,
        out.stored_J,
        out.fracture_J,
        out.arrest_J,
        out.flags,
    )


def _float32_columns(*arguments: ArrayLike) -> list[NDArray[np.float32]]:
    """Columns of one length, as the C core takes them, from arguments that broadcast."""
    with np.errstate(over="ignore"):  # what float32 cannot hold becomes infinite and is refused
        arrays = np.broadcast_arrays(*(np.asarray(a, dtype=np.float32) for a in arguments))
    return [np.ascontiguousarray(array).reshape(-1) for array in arrays]
