"""A made joint is found again, gaps are named, a delay is told, real logs are as published."""

import dataclasses
from pathlib import Path

import numpy as np
import pytest

from scissorcal.errors import InputError
from scissorcal.identify import (
    LogOptions,
    Sensors,
    compare,
    corrected,
    identify,
    read_log,
    ripples_of,
    simple_law,
)
from tests.identify.logs import MadeJoint, write

EMPS = Path(__file__).resolve().parents[3] / "shared" / "data" / "emps" / "DATA_EMPS.mat"
COLUMNS = {"time": "t", "position": "qm", "effort": "vir"}
UNITS = {"time": "s", "position": "m", "effort": "N"}


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("logs")


@pytest.fixture(scope="module")
def joint(folder: Path):
    rows = MadeJoint().log((0.1, 0.3, 1.0, 3.0), 1)
    return identify([read_log(write(folder / "many.csv", rows))])


def test_a_made_joint_is_within_its_intervals(joint) -> None:
    """Five parameters, intervals of five standard deviations: false alarm 3e-6."""
    fit, truth = joint.fit, MadeJoint()
    assert fit.candidate.startswith("coulomb + viscous")
    levels = {"coulomb_pos": 0.06, "coulomb_neg": 0.04, "viscous_pos": 0.01, "viscous_neg": 0.01}
    for name, value in {"inertia": truth.inertia, **levels}.items():
        found = fit.parameter(name)
        assert abs(found.mean - value) < 5 * found.sd, name
        assert found.sd < 0.01 * value, name


def test_a_log_that_was_not_fitted_is_predicted_within_the_band(joint, folder: Path) -> None:
    rows = MadeJoint().log((0.2, 0.5, 2.0), 2)
    held = compare(joint, read_log(write(folder / "held.csv", rows)))
    assert held.rms < 1.2 * joint.rms
    assert 0.85 < held.share_inside <= 1.0
    assert held.beyond < 0.01
    assert not held.differs


def test_a_log_of_a_joint_that_has_changed_is_told(joint, folder: Path) -> None:
    rows = MadeJoint(coulomb=0.06).log((0.2, 0.5, 2.0), 2)
    held = compare(joint, read_log(write(folder / "changed.csv", rows)))
    assert held.differs


def test_weight_is_a_term_by_the_name_of_the_position(folder: Path) -> None:
    rows = MadeJoint().log((0.1, 0.3, 1.0, 3.0), 4)
    rows[:, 2] += 0.03 * np.sin(rows[:, 1])
    log = read_log(write(folder / "arm.csv", rows))
    found = identify([log], adopt=("sin(position)",))
    weight = found.fit.parameter("sin(opening)")
    assert abs(weight.mean - 0.03) < 5 * weight.sd
    assert "sin(position)" in found.fit.candidate


def test_motion_beyond_the_fitted_one_is_said(joint, folder: Path) -> None:
    rows = MadeJoint().log((6.0,), 2, 0.05)
    held = compare(joint, read_log(write(folder / "fast.csv", rows)))
    assert held.beyond > 0.3


def test_one_speed_keeps_viscous_friction_and_names_the_motion(folder: Path) -> None:
    """Without slow starts nothing tells Coulomb from viscous friction, so that both stay wide."""
    path = write(folder / "one.csv", MadeJoint().log((0.8,), 3, 2e-3))
    found = identify([read_log(path)])
    names = [parameter.name for parameter in found.fit.parameters]
    assert any(name.startswith("viscous") for name in names)
    stems = {gap.what.removesuffix("_pos").removesuffix("_neg") for gap in found.gaps}
    assert {"friction at other speeds", "viscous"} <= stems
    (gap,) = [gap for gap in found.gaps if gap.what == "friction at other speeds"]
    assert "several constant speeds" in gap.motion
    (sums, *_) = [gap for gap in found.gaps if gap.what.startswith("coulomb")]
    assert "in sum with viscous" in sums.why


def test_several_logs_are_fitted_together(folder: Path) -> None:
    logs = []
    for seed, speeds in enumerate(((0.3, 1.0), (0.2, 3.0))):
        rows = MadeJoint().log(speeds, seed)
        logs.append(read_log(write(folder / f"part{seed}.csv", rows)))
    found = identify(logs)
    assert len(found.recordings) == 2
    inertia = found.fit.parameter("inertia")
    assert abs(inertia.mean - 2e-3) < 5 * inertia.sd


def test_a_delay_of_the_effort_is_estimated_and_taken_off(folder: Path) -> None:
    rows = MadeJoint(delay_s=4e-3).log((0.3, 1.0, 3.0), 5)
    log = read_log(write(folder / "late.csv", rows))
    found = identify([log], fit_delay=True)
    assert found.delay is not None
    assert found.delay.value_s == pytest.approx(4e-3, abs=2e-4)
    assert found.fit.parameter("inertia").mean == pytest.approx(2e-3, rel=0.01)


def test_declared_sensors_are_taken_off(folder: Path) -> None:
    rows = MadeJoint(noise=0.0).log((0.3, 1.0), 5)
    log = read_log(write(folder / "plain.csv", rows))
    wrong = log.samples.copy()
    wrong["motor_torque"] = 1.5 * wrong["motor_torque"] + 0.2
    read = type(log)(**{**log.__dict__, "samples": wrong})
    again = corrected(read, Sensors(gain={"effort": 1.5}, offset={"effort": 0.2}))
    np.testing.assert_allclose(again.samples["motor_torque"], log.samples["motor_torque"])
    late = corrected(log, Sensors(delay_s={"effort": 0.01}))
    assert len(late.samples) == len(log.samples) - 10
    ahead = log.samples["motor_torque"][10:]
    np.testing.assert_allclose(late.samples["motor_torque"], ahead, atol=1e-9)


@pytest.mark.parametrize(
    "sensors",
    [{"gain": {"effort": 0.0}}, {"delay_s": {"effort": 3.0}}, {"offset": {"torque": 1.0}}],
)
def test_a_sensor_that_cannot_be_is_refused(sensors: dict[str, dict[str, float]]) -> None:
    with pytest.raises(InputError, match=r"--(gain|delay|offset)"):
        Sensors(**sensors)


def test_a_large_joint_needs_no_priors_of_its_own(folder: Path) -> None:
    """A thousand times the effort: parameters a thousand times as large, within 3 %."""
    truth = MadeJoint(2.0, 50.0, 10.0, 10.0, noise=2.0)
    path = write(folder / "large.csv", truth.log((0.1, 0.3, 1.0, 3.0), 1))
    found = identify([read_log(path)])
    assert found.fit.parameter("inertia").mean == pytest.approx(2.0, rel=0.03)
    assert found.fit.parameter("coulomb_pos").mean == pytest.approx(60.0, rel=0.03)


def test_ripple_is_found_at_its_period_and_noise_is_not() -> None:
    rng = np.random.default_rng(3)
    place = 0.5 + 0.5 * np.sin(np.linspace(0.0, 25.0, 20_000))
    way = np.sign(np.gradient(place))
    noise = rng.normal(0.0, 1.0, len(place))
    assert not any(ripple.shown for ripple in ripples_of(place, way, noise))
    rippled = noise + 0.5 * np.sin(2.0 * np.pi * place / 0.02)
    (fast,) = [ripple for ripple in ripples_of(place, way, rippled) if ripple.shown]
    assert fast.speed == "fast"
    assert not fast.signed
    assert fast.period == pytest.approx(0.02, rel=0.01)
    assert fast.low < 0.5 < fast.high


def test_emps_is_as_published() -> None:
    """Mass 95.11 kg (sd 0.11) by Janot et al.; a law of more terms leaves less of the force."""
    if not EMPS.is_file():
        pytest.skip(f"real data absent: {EMPS.name} is not beside the project")
    log = read_log(EMPS, LogOptions(COLUMNS, UNITS, {"effort": "gtau"}))
    found = identify([log])
    mass = found.fit.parameter("inertia")
    assert abs(mass.mean - 95.11) < 3 * np.hypot(mass.sd, 0.11)
    assert found.rms < 1.5
    assert simple_law(found.fit, constant=False).rms == pytest.approx(3.6, abs=0.3)


@pytest.mark.slow
def test_a_tool_is_predicted_by_two_other_logs_of_it() -> None:
    """Load and speed lie between those of the fitted logs; the first second, in which the tool is
    brought under its load, is left out.
    """
    folder = EMPS.parents[1] / "mis_tool_friction"
    if not folder.is_dir():
        pytest.skip(f"real data absent: {folder.name} is not beside the project")
    options = LogOptions(
        {"time": 0, "position": 1, "effort": 2, "load": 5},
        {"time": "s", "position": "rad", "effort": "N m", "load": "N m"},
        {"position": -2 * np.pi / 8192, "effort": 3.9811e-5, "load": -3.9811e-5},
    )
    logs = []
    for number in ("03", "40", "00"):
        log = read_log(folder / f"Tool_4_Maryland_L_2_{number}.TXT", options)
        logs.append(dataclasses.replace(log, samples=log.samples[log.device_time_s >= 1.2]))
    terms = ("position", "position^2")
    held = compare(identify(logs[:2], adopt=terms, cutoff_Hz=20.0), logs[2])
    assert held.rms < 2.5e-3
    assert held.beyond < 0.05
