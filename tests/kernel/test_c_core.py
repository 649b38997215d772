"""The C tests, strict and under the sanitizers, as part of the ordinary test run."""

import shutil
import subprocess
from pathlib import Path

import pytest

C_TESTS = Path(__file__).parent.parent / "c"


@pytest.mark.skipif(
    not (shutil.which("make") and shutil.which("cc")), reason="no make or C compiler here"
)
@pytest.mark.parametrize("kind", ["strict", "sanitized"])
def test_c_core(kind: str, tmp_path: Path) -> None:
    ran = subprocess.run(
        ["make", "--no-print-directory", "-C", str(C_TESTS), f"BUILD={tmp_path}", kind],
        capture_output=True,
        text=True,
        check=False,
    )
    assert ran.returncode == 0, ran.stdout[-4000:] + ran.stderr[-4000:]
    assert ran.stdout.count(" 0 failed") == len(list(C_TESTS.glob("test_*.c")))


@pytest.mark.slow
@pytest.mark.skipif(
    not (shutil.which("make") and shutil.which("cc")), reason="no make or C compiler here"
)
@pytest.mark.parametrize("seed", [2, 3])
def test_the_servo_over_ten_million_disturbed_states(seed: int, tmp_path: Path) -> None:
    """The figures stand on stdout: pytest -s shows them."""
    program = tmp_path / "strict" / "test_disturbed"
    make = ["make", "--no-print-directory", "-C", str(C_TESTS), f"BUILD={tmp_path}", str(program)]
    subprocess.run(make, check=True, capture_output=True)
    words = [program, C_TESTS.parent / "golden", "10000000", str(seed)]
    ran = subprocess.run(words, capture_output=True, text=True, check=False)
    print(ran.stdout)
    assert ran.returncode == 0, ran.stdout + ran.stderr
