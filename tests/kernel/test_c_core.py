"""The C tests, strict and under the sanitizers, and a step on a Cortex-M4F where tools are here."""

import importlib.util
import os
import shutil
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace
from typing import cast

import pytest

from scissorcal.errors import DeviceError
from scissorcal.kernel import c_sources, loop

C_TESTS = Path(__file__).parent.parent / "c"
BUILD = Path(__file__).parents[2] / "build" / "c-tests"
"""That of `make c-tests`: what is compiled there is not compiled again."""

MOST_INSTRUCTIONS = 6000
"""Of any step at 64 knots on a Cortex-M4F, where the release falls along the blade."""

MOST_HYBRID_INSTRUCTIONS = 6000
"""Of any step of the hybrid law on a Cortex-M4F."""

MOST_CONTROL_INSTRUCTIONS = 7000
"""Of any tick of the mode CONTROL on a Cortex-M4F."""

MOST_TIMES_BY_HAND = 3.0
"""Of a slow stroke's mean step."""


def make(target: str, build: Path) -> str:
    ran = subprocess.run(
        [
            "make",
            "--no-print-directory",
            f"--jobs={os.cpu_count()}",
            "-C",
            str(C_TESTS),
            f"BUILD={build}",
            target,
        ],
        capture_output=True,
        text=True,
        check=False,
        timeout=600,
    )
    assert ran.returncode == 0, ran.stdout[-4000:] + ran.stderr[-4000:]
    return ran.stdout


needs_compiler = pytest.mark.skipif(
    not (shutil.which("make") and shutil.which("cc")), reason="no make or C compiler here"
)


@needs_compiler
@pytest.mark.parametrize("kind", ["strict", pytest.param("sanitized", marks=pytest.mark.slow)])
def test_c_core(kind: str) -> None:
    assert make(kind, BUILD).count(" 0 failed") == len(list(C_TESTS.glob("test_*.c")))


@pytest.mark.skipif(not importlib.util.find_spec("ziglang"), reason="no Zig here")
@pytest.mark.parametrize("target", ["x86_64-windows-gnu", "aarch64-macos"])
def test_files_that_ask_a_system_compile_for_others(tmp_path: Path, target: str) -> None:
    """The loop and its rights, which on Windows do nothing; the rest is portable."""
    flags = ("-std=c99", "-ffp-contract=off", "-Wall", "-Wextra", "-Werror", "-O1")
    for name in ("sc_loop", "sc_rights"):
        source = c_sources() / f"{name}.c"
        command = [sys.executable, "-m", "ziglang", "cc", "-target", target, *flags, "-c"]
        made = [*command, str(source), "-o", str(tmp_path / f"{name}.o")]
        ran = subprocess.run(made, capture_output=True, text=True, check=False, timeout=300)
        assert ran.returncode == 0, ran.stderr


def test_a_system_without_the_loop_is_a_sentence(monkeypatch: pytest.MonkeyPatch) -> None:
    """On Windows the loop gives no reason of a stop; here a library that does so stands in."""
    monkeypatch.setattr(loop, "lib", SimpleNamespace(sc_loop_run=lambda fd, block: 0))
    with pytest.raises(DeviceError, match=r"^The loop at a port needs a Unix terminal"):
        loop.run_loop(0, cast(loop.LoopBlock, SimpleNamespace(pointer=None)))


@pytest.mark.slow
@needs_compiler
def test_what_two_threads_share(tmp_path: Path) -> None:
    """Ring and mailbox under the thread sanitizer, where compiler and kernel can run it."""
    probe = tmp_path / "probe.c"
    probe.write_text("int main(void) { return 0; }\n", encoding="utf-8")
    built = subprocess.run(
        ["cc", "-fsanitize=thread", "-o", str(tmp_path / "probe"), str(probe)],
        capture_output=True,
        check=False,
    )
    if built.returncode or subprocess.run([tmp_path / "probe"], check=False).returncode:
        pytest.skip("no thread sanitizer here")
    assert " 0 failed" in make("threads", BUILD)


@needs_compiler
@pytest.mark.skipif(
    not (shutil.which("arm-none-eabi-gcc") and shutil.which("qemu-system-arm")),
    reason="no arm-none-eabi-gcc or qemu-system-arm here",
)
def test_a_step_on_a_cortex_m4f(tmp_path: Path) -> None:
    """The portable core compiles without a warning, and its step's instructions are bounded."""
    lines = make("cortex-m", tmp_path).splitlines()
    rows = [line for line in lines if ", " in line]
    assert len(rows) == 10
    for row in rows:
        by_hand, stroke, ratio, _, worst = (float(word) for word in row.split()[-5:])
        assert 0 < by_hand < stroke
        if "scanned" not in row:
            assert ratio <= MOST_TIMES_BY_HAND, row
            assert worst <= MOST_INSTRUCTIONS, row
    hybrid = [line for line in lines if line.startswith("hybrid law")]
    assert len(hybrid) == 4
    assert all(0 < int(row.split()[-1]) <= MOST_HYBRID_INSTRUCTIONS for row in hybrid), hybrid
    control = [line for line in lines if line.startswith("CONTROL")]
    assert len(control) == 3
    assert all(0 < int(row.split()[-1]) <= MOST_CONTROL_INSTRUCTIONS for row in control), control


@pytest.mark.slow
@needs_compiler
@pytest.mark.parametrize("seed", [2, 3])
def test_the_servo_over_ten_million_disturbed_states(seed: int) -> None:
    """The figures stand on stdout: pytest -s shows them."""
    program = BUILD / "strict" / "test_disturbed"
    make(str(program), BUILD)
    words = [program, C_TESTS.parent / "golden", "10000000", str(seed)]
    ran = subprocess.run(words, capture_output=True, text=True, check=False)
    print(ran.stdout)
    assert ran.returncode == 0, ran.stdout + ran.stderr
