"""A log with gaps, from import to fit: the cost is stated first, and nothing ends with 1."""

from pathlib import Path

import numpy as np
import pytest

from tests.cli.conftest import Cli

COLUMNS = ("-c", "time=time_s", "-c", "opening=angle_rad", "-c", "motor_torque=torque_Nm")
CASE = Path(__file__).parents[3] / "shared" / "cases" / "slow" / "slow_gaps.csv"


def slow_log(path: Path, gaps: int, lost: int, seed: int) -> Path:
    """Sweeps of 0.09 rad at 6 mrad/s, logged at 65 Hz with an uneven clock and gaps."""
    rng = np.random.default_rng(seed)
    time = np.arange(6000) * 0.0155 + rng.uniform(-0.002, 0.002, 6000)
    phase = (time * 0.006 / 0.09) % 2.0
    rate = np.where(phase < 1.0, 0.006, -0.006)
    angle = 0.09 * np.where(phase < 1.0, phase, 2.0 - phase) - 0.045
    torque = 5.0 * np.sign(rate) + 100.0 * rate + rng.normal(0.0, 1.0, 6000)
    kept = np.ones(6000, dtype=bool)
    for first in rng.choice(np.arange(10, 5900), gaps, replace=False):
        kept[first : first + lost] = False
    rows = np.column_stack([time, angle, torque])[kept]
    np.savetxt(path, rows, "%.5f,%.8f,%.4f", header="time_s,angle_rad,torque_Nm", comments="")
    return path


def fitted(cli: Cli, path: Path) -> tuple[str, int, str]:
    """The refusal without gaps allowed, the exit code of the fit, and all that it said."""
    assert cli("init", "day").code == 0
    where = ("--workspace", "day")
    refused = cli("import", str(path), *COLUMNS, *where)
    assert refused.code == 2
    kept = cli("import", str(path), *COLUMNS, "--allow-gaps", *where)
    assert kept.code == 0, kept.err
    assert "A fit of friction bridges gaps" in kept.out
    said = cli("fit", "friction", "--effort", "draft", *where)
    return refused.err, said.code, said.out + said.err


@pytest.mark.parametrize(("gaps", "lost"), [(70, 2), (700, 1), (3000, 1), (40, 60)])
def test_a_slow_log_with_gaps_is_fitted_or_refused_in_words(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, cli: Cli, gaps: int, lost: int
) -> None:
    monkeypatch.chdir(tmp_path)
    cost, code, said = fitted(cli, slow_log(tmp_path / "slow.csv", gaps, lost, gaps))
    assert "about" in cost
    assert "uses no window that touches one" in cost
    assert code in (0, 2, 3), said
    assert "fault of scissorcal" not in said
    if code == 2:
        assert "gap" in said
        assert "s recorded" in said or "no stretch without gaps" in said


def test_the_slow_log_beside_the_project_is_fitted(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, cli: Cli
) -> None:
    if not CASE.is_file():
        pytest.skip(f"{CASE.name} is not beside the project")
    monkeypatch.chdir(tmp_path)
    cost, code, said = fitted(cli, CASE)
    assert "here 70 of 70" in cost
    assert code in (0, 3), said
    assert "coulomb_pos" in said
