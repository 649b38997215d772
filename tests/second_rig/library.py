"""The rig's C core: compiled once by the system's compiler, loaded by ctypes."""

import ctypes
import functools
import hashlib
import os
import shlex
import subprocess
import tempfile
from pathlib import Path

import numpy as np

HERE = Path(__file__).parent
SOURCES = ("contact.c", "rig.c", "day.c")
HEADERS = ("rig.h", "rig_internal.h")
FLAGS = (
    "-std=c99",
    "-O3",
    "-fno-math-errno",
    "-fno-trapping-math",
    "-Wall",
    "-Wextra",
    "-Werror",
    "-fPIC",
    "-shared",
)
BUILD = HERE.parents[1] / "build" / "second_rig"


def _names(text: str) -> tuple[str, ...]:
    return tuple(text.split())


PARAMETERS = _names(
    """tick_s step_s inertia coulomb_pos coulomb_neg viscous_pos viscous_neg stribeck stribeck_rate
    angle_slope angle_curvature angle_center presliding presliding_shape
    load_share offset cogging cogging_periods
    cogging_phase mass sledge_coulomb sledge_viscous sledge_presliding delay_ticks lag_s
    torque_limit force_limit brake opening_step advance_step rate_gain position_gain integral_gain
    observer_hz feed_inertia feed_coulomb feed_viscous sledge_kp sledge_kd sledge_ki
    sledge_observer_hz moving edge_offset edge_slope edge_curvature edge_cubic edge_length
    tip_radius upper_face law force reference exponent knee knee_ratio damping fracture kappa
    sheet_length grid_step radius hand_stiffness hand_damping hand_strength hand_push hand_drag
    hand_reach"""
)

ROW_NAMES = _names(
    """opening rate advance advance_rate crack motor_torque sledge_force handle_force cut_torque
    friction_torque indentation measured_opening measured_advance torque_command force_command
    kinetic stored fracture arrest motor_work sledge_motor_work cogging_work offset_work hand_work
    sledge_hand_work friction_work sledge_friction_work cut_work sledge_cut_work damping_work"""
)
JUMP_NAMES = _names("time opening advance start end toughness drive_after sheet")
ROW = np.dtype([(name, "<f8") for name in ROW_NAMES])
JUMP = np.dtype([(name, "<f8") for name in JUMP_NAMES])

_DOUBLES = ctypes.POINTER(ctypes.c_double)
_INTS = ctypes.POINTER(ctypes.c_int32)


class Inputs(ctypes.Structure):
    """Mirror of rig_inputs."""

    _fields_ = (
        ("opening", _DOUBLES),
        ("rate", _DOUBLES),
        ("advance", _DOUBLES),
        ("advance_rate", _DOUBLES),
        ("tremor", _DOUBLES),
        ("mode", _INTS),
        ("sheet", _INTS),
        ("toughness", _DOUBLES),
        ("toughness_integral", _DOUBLES),
        ("ticks", ctypes.c_int64),
        ("grid", ctypes.c_int64),
        ("start_opening", ctypes.c_double),
        ("start_advance", ctypes.c_double),
    )


@functools.cache
def library() -> ctypes.CDLL:
    """Compile where needed, load, and check that both sides agree on the layout."""
    library = ctypes.CDLL(str(_built()))
    library.rig_sizes.restype = ctypes.c_double
    library.rig_run.restype = ctypes.c_int
    sizes = [library.rig_sizes(which) for which in range(4)]
    known = [len(PARAMETERS), len(ROW_NAMES), len(JUMP_NAMES), ctypes.sizeof(Inputs) / 8]
    if sizes != known:
        raise RuntimeError(f"rig.h and library.py disagree about layouts: {sizes} and {known}.")
    return library


def _built() -> Path:
    compiler = shlex.split(os.environ.get("CC", "cc"))
    text = b"".join((HERE / name).read_bytes() for name in (*SOURCES, *HEADERS))
    key = hashlib.sha256(text + repr((compiler, FLAGS)).encode()).hexdigest()[:16]
    target = BUILD / f"rig-{key}.so"
    if not target.exists():
        BUILD.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(dir=BUILD) as folder:
            made = Path(folder) / "rig.so"
            sources = [str(HERE / name) for name in SOURCES]
            command = [*compiler, *FLAGS, *sources, "-o", str(made), "-lm"]
            done = subprocess.run(command, capture_output=True, text=True, check=False)
            if done.returncode != 0:
                raise RuntimeError(
                    f"The second rig does not compile with {shlex.join(command)}: {done.stderr}"
                )
            made.replace(target)
    return target
