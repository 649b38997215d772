"""How long a step of the kernel takes, here and on a Cortex-M4F.

``python -m tests.kernel.speed`` prints three tables: nanoseconds of a step in a C loop, by single
calls and in plain Python; then, from tests/c/bench_step.c, a slow stroke's mean step against one
written by hand and the worst of random steps, in nanoseconds here and, where arm-none-eabi-gcc and
qemu-system-arm are installed, in instructions of a Cortex-M4F. Times are reported, never asserted;
the instructions are asserted by test_c_core.py.
"""

import shutil
import subprocess
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

from scissorcal.kernel import Kernel, Servo, ServoConfig, encode
from scissorcal.kernel._kernel import ffi, lib
from scissorcal.kernel.messages import State
from scissorcal.kernel.tables import model_struct
from tests.kernel.reference_model import Reference
from tests.kernel.reference_wire import unstuffed
from tests.kernel.zoo import make_tables

C_TESTS = Path(__file__).parent.parent / "c"
STEPS = 4000
CASES = {
    "pressing (no fracture)": ({"fracture_energy": 0.0}, 0.4, 0.2, -0.05),
    "cutting, smooth": ({}, 0.8, 0.3, -0.02),
    "cutting, rippled": ({"kappa": 0.7}, 0.8, 0.3, -0.02),
}


def fastest(run: Callable[[], None], repeats: int = 7) -> float:
    """Best time of a run of STEPS steps, in ns per step."""
    best = float("inf")
    for _ in range(repeats):
        start = time.perf_counter_ns()
        run()
        best = min(best, time.perf_counter_ns() - start)
    return best / STEPS


def step_figures(
    changes: dict[str, float], first: float, last: float, advance: float
) -> list[float]:
    tables = make_tables(render_friction=True, **changes)
    opening = np.linspace(first, last, STEPS).astype(np.float32)
    floats = [float(v) for v in opening]
    rates = np.full(STEPS, -0.5, np.float32)
    advances = np.full(STEPS, advance, np.float32)
    kernel = Kernel(tables)
    model, _keep = model_struct(tables)
    crack, out = ffi.new("sc_crack *"), ffi.new("sc_step_output *")
    step = lib.sc_model_step

    def in_c() -> None:
        kernel.reset(0.0)
        kernel.step_many(opening, rates, advances)

    def by_call() -> None:
        crack.crack = 0.0
        for value in floats:
            step(model, crack, value, -0.5, advance, out)

    def by_method() -> None:
        kernel.reset(0.0)
        for value in floats:
            kernel.step(value, -0.5, advance)

    def in_python() -> None:
        reference = Reference(tables)
        for value in floats:
            reference.step(value, -0.5, advance)

    return [fastest(in_c), fastest(by_call), fastest(by_method), fastest(in_python, 3)]


def servo_figure() -> float:
    """A whole frame in lockstep: bytes of a STATE in, bytes of a COMMAND out."""
    config = ServoConfig(torque_limit=1, torque_slew=200, force_limit=1, force_slew=1000)
    servo = Servo(make_tables(), config)
    payloads = [
        unstuffed(encode(State(1, k, 1000 * k, 0.8 - 1e-4 * k, -0.02, 0.0, 0.0))[:-1])[:-2]
        for k in range(STEPS)
    ]

    def run() -> None:
        for payload in payloads:
            servo.answer(payload)

    return fastest(run)


def bench(target: str) -> str:
    """What a benchmark of tests/c prints; its output is kept nowhere."""
    with tempfile.TemporaryDirectory() as build:
        command = ["make", "-s", "--no-print-directory", "-C", str(C_TESTS), f"BUILD={build}"]
        return subprocess.run([*command, target], capture_output=True, text=True, check=True).stdout


def main() -> None:
    print(
        f"{'ns per step':26}{'C loop':>10}{'one call':>10}{'.step()':>10}{'Python':>10}{'ratio':>8}"
    )
    for title, case in CASES.items():
        figures = step_figures(*case)
        row = "".join(f"{value:10.0f}" for value in figures)
        print(f"{title:26}{row}{figures[3] / figures[0]:8.0f}")
    print(f"servo, STATE bytes to COMMAND bytes, from Python: {servo_figure():.0f} ns")
    print(f"\n{bench('bench')}")
    if shutil.which("arm-none-eabi-gcc") and shutil.which("qemu-system-arm"):
        print(bench("cortex-m"))


if __name__ == "__main__":
    main()
