"""Programs compiled for one model give its kernel's torque, and count on a Cortex-M4F."""

import numpy as np
import pytest

from scissorcal.kernel import Kernel
from scissorcal.kernel import compiled_step as step_module
from scissorcal.kernel.compiled_step import compiled_step, missing_tools
from tests.kernel.zoo import make_tables

TABLES = make_tables(render_friction=True)


def states(count: int = 12) -> np.ndarray:
    rng = np.random.default_rng(4)
    columns = [
        rng.uniform(0.3, 0.8, count),
        rng.uniform(-1, 1, count),
        rng.uniform(0.02, 0.05, count),
    ]
    return np.column_stack([*columns, np.full(count, TABLES.fracture_energy)])


@pytest.mark.skipif(bool(missing_tools("host")), reason="no C compiler here")
def test_the_program_computes_what_the_kernel_does() -> None:
    at = states()
    own = Kernel(TABLES).torque(at[:, 0], at[:, 1], at[:, 2])
    found = compiled_step(TABLES, at, runs=2)
    assert found.torque == pytest.approx(own, rel=1e-5, abs=1e-8)
    assert len(found.stroke) == len(found.settled) == 2
    assert min(found.stroke) > 0
    double = compiled_step(TABLES, at, arrays={})
    assert double.torque == pytest.approx(own, rel=1e-4, abs=1e-7)
    assert not np.array_equal(double.torque, found.torque)


@pytest.mark.skipif(bool(missing_tools("cortex-m4f")), reason="no arm-none-eabi-gcc or qemu here")
def test_a_cortex_m4f_computes_the_same_and_its_instructions_are_counted() -> None:
    at = states()
    found = compiled_step(TABLES, at, target="cortex-m4f")
    own = Kernel(TABLES).torque(at[:, 0], at[:, 1], at[:, 2])
    assert found.torque == pytest.approx(own, rel=1e-5, abs=1e-8)
    assert 100 < found.stroke[0] < 10_000
    assert np.all((found.states > 100) & (found.states < 10_000))


@pytest.mark.skipif(bool(missing_tools("host")), reason="no C compiler here")
def test_a_tool_that_does_not_end_is_an_error(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(step_module, "_TIMEOUT_s", 1e-4)
    with pytest.raises(RuntimeError, match=r"cc did not end within 0\.0001 s"):
        compiled_step(TABLES, states())


def test_what_cannot_be_measured_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(ValueError, match="states are measured at once"):
        compiled_step(TABLES, states(2))
    monkeypatch.setenv("PATH", "")
    assert "arm-none-eabi-gcc and qemu-system-arm not found" in missing_tools("cortex-m4f")
    with pytest.raises(RuntimeError, match="cc not found"):
        compiled_step(TABLES, states())
