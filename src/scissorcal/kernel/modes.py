"""Modes of the servo, and what each needs before it is engaged."""

import math
from enum import IntEnum

import numpy as np
from numpy.typing import ArrayLike, NDArray


class Mode(IntEnum):
    """IDLE: motors off. TRACK: follow the reference. RENDER: the model. DAMP: damping only.
    CONTROL: press on a surface and follow a path along it."""

    IDLE = 0
    TRACK = 1
    RENDER = 2
    DAMP = 3
    CONTROL = 4


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
