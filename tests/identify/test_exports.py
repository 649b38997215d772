"""What is exported loads where it belongs, and its effort is ours to what the file states."""

import ctypes
import json
import re
import shutil
import subprocess
import xml.etree.ElementTree as ET
from pathlib import Path

import numpy as np
import pytest

from scissorcal.identify import (
    TARGETS,
    export_text,
    identify,
    off_by,
    read_log,
    simple_law,
)
from scissorcal.model import friction_torque
from tests.identify.logs import MadeJoint, write

MOTION = [(0.3, 0.5, 2.0), (0.6, -1.5, -4.0), (0.2, 0.05, 0.0)]
"""Position, rate and acceleration at which efforts are compared."""


@pytest.fixture(scope="module")
def joint(tmp_path_factory: pytest.TempPathFactory):
    """Its friction differs by direction, so that no export of two levels has all of it."""
    path = tmp_path_factory.mktemp("logs") / "many.csv"
    return identify([read_log(write(path, MadeJoint().log((0.1, 0.3, 1.0, 3.0), 1)))])


def simple_effort(joint, constant: bool, rate: float, acceleration: float) -> float:
    law = simple_law(joint.fit, constant=constant)
    friction = law.coulomb * np.sign(rate) + law.viscous * rate
    return joint.fit.best["inertia"] * acceleration + friction + law.offset


def test_mujoco_needs_the_same_effort(joint) -> None:
    """Inverse dynamics; friction loss is a soft constraint, so that 1 % of friction may lack."""
    mujoco = pytest.importorskip("mujoco", reason="mujoco is not installed (extra dev)")
    model = mujoco.MjModel.from_xml_string(export_text(joint, "mujoco"))
    data = mujoco.MjData(model)
    assert model.opt.timestep == pytest.approx(1e-3)
    assert model.opt.integrator == mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    for position, rate, acceleration in MOTION:
        data.qpos[0], data.qvel[0], data.qacc[0] = position, rate, acceleration
        mujoco.mj_inverse(model, data)
        mujoco.mj_fwdActuation(model, data)
        needed = data.qfrc_inverse[0] - data.qfrc_actuator[0]
        law = simple_law(joint.fit, constant=True)
        ours = simple_effort(joint, True, rate, acceleration)
        assert needed == pytest.approx(ours, abs=0.01 * law.coulomb)


def test_the_implicit_step_adds_damping_to_the_inertia_as_stated(joint) -> None:
    mujoco = pytest.importorskip("mujoco", reason="mujoco is not installed (extra dev)")
    text = export_text(joint, "mujoco")
    law = simple_law(joint.fit, constant=True)
    (stated,) = re.findall(r"damping = ([0-9.e-]+) to the inertia", text)
    assert float(stated) == pytest.approx(1e-3 * law.viscous, rel=0.01)
    model = mujoco.MjModel.from_xml_string(re.sub(r'frictionloss="[^"]*"', "", text))
    data = mujoco.MjData(model)
    data.qfrc_applied[0] = 1.0
    mujoco.mj_step(model, data)
    inertia = joint.fit.best["inertia"]
    expected = 1e-3 * (1.0 - law.offset) / (inertia + 1e-3 * law.viscous)
    assert data.qvel[0] == pytest.approx(expected, rel=1e-4)


def test_urdf_is_parsed_with_the_dynamics_of_the_joint(joint) -> None:
    urdf = pytest.importorskip(
        "urdf_parser_py.urdf", reason="urdf_parser_py is not installed (extra dev)"
    )
    robot = urdf.URDF.from_xml_string(export_text(joint, "urdf").partition("?>")[2])
    law, dynamics = simple_law(joint.fit, constant=False), robot.joints[0].dynamics
    assert robot.joints[0].type == "revolute"
    assert dynamics.damping == pytest.approx(law.viscous)
    assert dynamics.friction == pytest.approx(law.coulomb)
    assert robot.links[1].inertial.inertia.ixx == pytest.approx(joint.fit.best["inertia"])


def test_sdf_has_the_dynamics_of_the_joint(joint) -> None:
    root = ET.fromstring(export_text(joint, "sdf"))
    law = simple_law(joint.fit, constant=False)
    dynamics = root.find(".//axis/dynamics")
    assert dynamics is not None
    assert float(dynamics.findtext("damping", "")) == pytest.approx(law.viscous)
    assert float(dynamics.findtext("friction", "")) == pytest.approx(law.coulomb)


def test_the_c_header_has_the_whole_law(joint, tmp_path: Path) -> None:
    compiler = shutil.which("cc")
    if compiler is None:
        pytest.skip("no C compiler here")
    (tmp_path / "joint.h").write_text(export_text(joint, "c"), encoding="utf-8")
    source = '#include "joint.h"\ndouble f(double p, double r, double a)'
    source += "{ return joint_effort(p, r, a); }\n"
    (tmp_path / "joint.c").write_text(source, encoding="utf-8")
    flags = ["-std=c99", "-Wall", "-Wextra", "-Werror", "-shared", "-fPIC", "-o", "joint.so"]
    subprocess.run([compiler, *flags, "joint.c", "-lm"], cwd=tmp_path, check=True)
    effort = ctypes.CDLL(str(tmp_path / "joint.so")).f
    effort.restype, effort.argtypes = ctypes.c_double, [ctypes.c_double] * 3
    from scissorcal.identify.simple import law_of

    for position, rate, acceleration in MOTION:
        friction = float(friction_torque(law_of(joint.fit), position, rate))
        ours = joint.fit.best["inertia"] * acceleration + friction
        ours += joint.fit.best.get("offset", 0.0)
        assert effort(position, rate, acceleration) == pytest.approx(ours, rel=1e-12)
    assert off_by(joint, "c") < 1e-12


def test_what_a_target_lacks_is_stated_with_its_size(joint) -> None:
    """A constant of 0.01 N m is off by that where the target has none."""
    assert off_by(joint, "urdf") == pytest.approx(0.01, rel=0.02)
    assert off_by(joint, "mujoco") < 3e-4
    for target in ("urdf", "sdf"):
        text = export_text(joint, target)
        assert f"off the fitted law by {off_by(joint, target):.3g} N m rms" in text
        assert "a constant effort" in text


def test_json_and_csv_hold_parameters_and_curve_with_band(joint) -> None:
    stored = json.loads(export_text(joint, "json"))
    names = [parameter["name"] for parameter in stored["parameters"]]
    assert names == [parameter.name for parameter in joint.fit.parameters]
    assert stored["not_identified"]
    head, *rows = export_text(joint, "csv").strip().splitlines()
    assert head == "rate_rad_per_s,friction_Nm,q05_Nm,q95_Nm"
    values = np.array([[float(cell) for cell in row.split(",")] for row in rows])
    assert np.all(values[:, 2] <= values[:, 1])
    assert np.all(values[:, 1] <= values[:, 3])
    assert set(TARGETS) == {"mujoco", "urdf", "sdf", "c", "json", "csv"}


def test_an_added_term_counts_in_what_the_header_leaves(
    tmp_path_factory: pytest.TempPathFactory,
) -> None:
    """A spring of 30 mN m/rad over 1 rad: 30 mN m / sqrt(3) rms about the place 0, or nearly."""
    rows = MadeJoint().log((0.1, 0.3, 1.0, 3.0), 4)
    rows[:, 2] += 0.03 * rows[:, 1]
    log = read_log(write(tmp_path_factory.mktemp("logs") / "spring.csv", rows))
    joint = identify([log], adopt=("position",))
    assert off_by(joint, "c") == pytest.approx(0.03 / np.sqrt(3.0), rel=0.1)
    assert "the added terms position" in export_text(joint, "c")
