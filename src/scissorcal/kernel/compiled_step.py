"""What a step of one model takes, measured by a program that is compiled for it.

The package's own kernel is float32 and built for this computer. This module compiles the same
sources with the model's tables inside, in float or in double, for this computer or for a
Cortex-M4F that qemu runs while it counts instructions.
"""

import re
import shutil
import subprocess
import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from scissorcal.aliases import Array
from scissorcal.kernel.tables import TABLE_NAMES, ModelTables, Row16


def c_sources() -> Path:
    """Directory of the C core: ``sc_*.c`` and ``sc_*.h``.

    All but ``sc_block``, ``sc_loop`` and ``sc_rights``, which ask a system, is portable C99 without
    allocation. Compiled without contraction of products and sums (``-ffp-contract=off``), it gives
    on any processor the bits that this installation computes; with it, the torque within rounding.

    >>> sorted(path.name for path in c_sources().glob("*.h"))[:2]
    ['sc_block.h', 'sc_bytes.h']
    """
    return Path(__file__).parent / "c"


def step_sources() -> tuple[Path, ...]:
    """The files of the C core that a model's step needs: headers by inclusion, then sources.

    >>> [path.name for path in step_sources() if path.suffix == ".c"][:3]
    ['sc_edge.c', 'sc_fracture.c', 'sc_model.c']
    """
    queue = [c_sources() / "sc_model.c", c_sources() / "sc_release.c"]  # both of sc_model.h
    for path in queue:
        for name in _INCLUDED.findall(path.read_text(encoding="utf-8")):
            header = path.with_name(name)
            beside = (header, header.with_suffix(".c"))
            queue += [file for file in beside if file.is_file() and file not in queue]
    return tuple(sorted(queue, key=lambda path: (path.suffix != ".h", path.name)))


Target = Literal["host", "cortex-m4f"]
Rows = tuple[Row16, Row16, Row16]

FEWEST_STATES, MOST_STATES = 10, 50_000
SLOW_STROKE_rad_per_s = 0.5
_TIMEOUT_s = 300.0

_CORE = ("table", "table16", "turn", "edge", "fracture", "release", "model")
_INCLUDED = re.compile(r'^#include "(sc_\w+\.h)"', re.MULTILINE)
_COMMON = ("-std=c99", "-Wall", "-Wextra", "-fno-math-errno", "-ffp-contract=off")
_HOST = ("cc", *_COMMON, "-D_POSIX_C_SOURCE=200809L", "-O3")
_CORTEX = (
    *("arm-none-eabi-gcc", "-mcpu=cortex-m4", "-mthumb", "-mfpu=fpv4-sp-d16", "-mfloat-abi=hard"),
    *(*_COMMON, "-O2", "--specs=rdimon.specs", "-nostartfiles"),
)
# qemu gives each instruction 1024 ns of its time, which the program's clock counts
_QEMU = (
    *("qemu-system-arm", "-M", "mps2-an386", "-icount", "shift=10", "-nographic"),
    *("-monitor", "none", "-serial", "none"),
    *("-semihosting-config", "enable=on,target=native", "-kernel"),
)


class StepCost(NamedTuple):
    """Work of one model: ns on this computer, executed instructions on a Cortex-M4F.

    ``loading`` is what decoding and integrating its tables takes, once. ``stroke`` has the mean
    step of a slow closing stroke, ``settled`` the mean settled torque at the states, for each run.
    ``states`` (n,) is what the first step at each state takes, and ``torque`` (n,) the settled mean
    torque there in N m.
    """

    loading: int
    stroke: tuple[int, ...]
    settled: tuple[int, ...]
    states: NDArray[np.int64]
    torque: Array


def missing_tools(target: Target) -> str:
    """Why a target cannot be measured on this computer, as a sentence; empty where it can."""
    tools = ("cc",) if target == "host" else ("arm-none-eabi-gcc", "qemu-system-arm")
    missing = [tool for tool in tools if shutil.which(tool) is None]
    if not missing:
        return ""
    return f"{' and '.join(missing)} not found: install the compiler to measure this."


def compiled_step(
    tables: ModelTables,
    states: Array,
    *,
    target: Target = "host",
    arrays: Mapping[str, Array] | None = None,
    rows: Mapping[str, Rows] | None = None,
    runs: int = 1,
) -> StepCost:
    """Compile the core with a model inside, run it, and count what its steps take.

    ``states`` (n, 4) are opening (rad), rate (rad/s), contact (m) and the fracture energy (J/m)
    that the crack takes there on average; 10 to 50,000 of them. With ``arrays`` the program
    computes in double, in float without; they replace tables by their name in float64. ``rows`` say
    which tables the program holds in 16-bit numbers. The program is compiled once and run ``runs``
    times. Raises RuntimeError where the tools are missing or fail; see :func:`missing_tools`.
    """
    if not FEWEST_STATES <= len(states) <= MOST_STATES:
        raise ValueError(f"10 to {MOST_STATES} states are measured at once, not {len(states)}")
    if reason := missing_tools(target):
        raise RuntimeError(reason)
    folder = c_sources().parent / "step_cost"
    core = [str(c_sources() / f"sc_{name}.c") for name in _CORE]
    with tempfile.TemporaryDirectory() as build:
        data = Path(build) / "model_data.h"
        data.write_text(_model_text(tables, states, arrays or {}, rows or {}), encoding="utf-8")
        program = Path(build) / "step_cost"
        sources = [str(folder / "step_cost.c"), *core]
        places = [f"-I{build}", f"-I{c_sources()}", f"-I{folder}"]
        if arrays is not None:
            places += ["-include", str(folder / "real64.h")]
        if target == "host":
            _run([*_HOST, *places, "-o", str(program), *sources, "-lm"])
            return _parse([_run([str(program)]) for _ in range(runs)])
        sources += [str(folder / "start.c"), "-T", str(folder / "mps2.ld")]
        _run([*_CORTEX, *places, "-o", str(program), *sources, "-lm"])
        return _parse([_run([*_QEMU, str(program)]) for _ in range(runs)])


def _run(command: list[str]) -> str:
    try:
        ran = subprocess.run(
            command,
            capture_output=True,
            text=True,
            check=False,
            timeout=_TIMEOUT_s,
            stdin=subprocess.DEVNULL,
        )
    except subprocess.TimeoutExpired:
        name = Path(command[0]).name
        raise RuntimeError(f"{name} did not end within {_TIMEOUT_s:g} s") from None
    if ran.returncode:
        said = (ran.stderr + ran.stdout).strip()[-2000:]
        raise RuntimeError(f"{Path(command[0]).name} failed with {ran.returncode}: {said}")
    return ran.stdout


def _parse(texts: list[str]) -> StepCost:
    heads = [[int(word) for word in text.split("\n", 1)[0].split()] for text in texts]
    pairs = [line.split() for line in texts[0].split("\n")[1:] if line]
    return StepCost(
        loading=heads[0][0],
        stroke=tuple(head[1] for head in heads),
        settled=tuple(head[2] for head in heads),
        states=np.array([int(took) for took, _ in pairs], dtype=np.int64),
        torque=np.array([float(torque) for _, torque in pairs]),
    )


def _model_text(
    tables: ModelTables, states: Array, arrays: Mapping[str, Array], rows: Mapping[str, Rows]
) -> str:
    """The model and its states as C."""
    lines = ["#ifndef MODEL_DATA_H", "#define MODEL_DATA_H", "#include <math.h>"]
    lines += ['#include "sc_model.h"', '#include "sc_table16.h"', "#include <string.h>"]
    lines += [f"enum {{ STATES = {len(states)} }};"]
    lines += [f"static const float STROKE_RATE = {-SLOW_STROKE_rad_per_s};"]
    body = ["    int sound = 1;", "    memset(model, 0, sizeof *model);"]
    for name in TABLE_NAMES:
        own = getattr(tables, name)
        array = arrays.get(name, np.stack([own.x, own.y, own.slope]).astype(np.float64))
        upper, size = name.upper(), array.shape[1]
        if name in rows:
            lines += _stored_lines(upper, array, rows[name])
            floats = ", ".join(f"{upper}_FLOATS[{part}]" for part in range(3))
            body += [f"    sound = sc_table16_decode(&{upper}, {floats}, &model->{name}) && sound;"]
        else:
            numbers = (", ".join(_number(value) for value in part) for part in array)
            inner = "},\n    {".join(numbers)
            lines += [f"static const float {upper}[3][{size}] = {{\n    {{{inner}}}}};"]
            for part, field in enumerate(("x", "y", "slope")):
                body += [f"    model->{name}.{field} = {upper}[{part}];"]
            body += [f"    model->{name}.size = {size};"]
    lines += [f"static float RESPONSE_AREA[{len(tables.response.x)}];"]
    body += ["    sc_table_accumulate(&model->response, RESPONSE_AREA);"]
    body += ["    model->response.area = RESPONSE_AREA;"]
    body += [f"    model->{name} = {value};" for name, value in _scalars(tables).items()]
    rows_of_states = ",\n    ".join(
        "{" + ", ".join(_number(value) for value in state) + "}" for state in states
    )
    lines += [f"static const float STATE[STATES][4] = {{\n    {rows_of_states}}};"]
    lines += ["static int load_model(sc_model *model)", "{", *body, "    return sound;", "}"]
    return "\n".join([*lines, "#endif", ""])


def _stored_lines(upper: str, array: Array, rows: Rows) -> list[str]:
    size = array.shape[1]
    lines, parts = [], []
    for index, (row, part) in enumerate(zip(rows, array, strict=True)):
        numbers = ", ".join(str(number) for number in row.numbers(part))
        lines += [f"static const int16_t {upper}_{index}[{size}] = {{{numbers}}};"]
        parts += [f"{{{upper}_{index}, {_number(row.offset)}, {_number(row.scale)}}}"]
    lines += [f"static const sc_table16 {upper} = {{{', '.join(parts)}, {size}}};"]
    return [*lines, f"static float {upper}_FLOATS[3][{size}];"]


def _scalars(tables: ModelTables) -> dict[str, str]:
    whole = ("moving_blades", "render_friction")
    real = ("upper_face", "fracture_energy", "kappa", "rate_damping", "friction_rate_eps")
    ranges = ("opening_min", "opening_max", "contact_min", "contact_max")
    closures = {"work": "SC_CLOSURE_WORK", "eq4": "SC_CLOSURE_EQ4"}
    return {
        "closure": closures[tables.closure],
        **{name: str(int(getattr(tables, name))) for name in whole},
        **{
            name: _number(getattr(tables, name))
            for name in (*real, *ranges, "handle_radius", "tip_station")
        },
    }


def _number(value: float) -> str:
    """A number as C writes it; without a suffix it is a double, which a float is rounded from."""
    return "(float)INFINITY" if value == np.inf else repr(float(value))
