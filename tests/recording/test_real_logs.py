"""Logs that others made and published are read as they stand."""

import math
from pathlib import Path

import numpy as np
import pytest
from scipy.io import loadmat

from scissorcal.recording import ImportOptions, Joint, import_table, read_recording, write_recording

DATA = Path(__file__).parents[2].parent / "shared" / "data"
EMPS = DATA / "emps" / "DATA_EMPS.mat"
TOOLS = sorted((DATA / "mis_tool_friction").glob("*.TXT"))


@pytest.mark.skipif(not EMPS.is_file(), reason="the EMPS data set is not beside the project")
def test_emps_keeps_every_bit(tmp_path: Path) -> None:
    recording = import_table(
        EMPS,
        columns={"time": "t", "opening": "qm", "motor_torque": "vir"},
        units={"time": "s", "opening": "m", "motor_torque": "V"},
        scale={"motor_torque": "gtau"},
        options=ImportOptions(joint=Joint("linear")),
    )
    raw = loadmat(EMPS)
    assert len(recording.samples) == 24_841
    np.testing.assert_array_equal(recording.samples["opening"], raw["qm"].ravel())
    force = raw["vir"].ravel() * raw["gtau"].item()
    np.testing.assert_array_equal(recording.samples["motor_torque"], force)
    np.testing.assert_allclose(recording.device_time_s, raw["t"].ravel(), rtol=0, atol=5e-7)
    assert recording.duration_s == pytest.approx(24.84)
    assert [stroke.kind for stroke in recording.strokes] == ["opening", "closing"] * 4
    assert [stroke.speed for stroke in recording.strokes] == pytest.approx([0.1017] * 8, rel=0.01)
    # The table never rests: every sample belongs to a stroke, accelerations included.
    assert (recording.samples["stroke"] >= 0).all()
    found = read_recording(write_recording(recording, tmp_path / "emps.mcap"))
    np.testing.assert_array_equal(found.samples, recording.samples)
    assert found.joint.effort_unit == "N"


@pytest.mark.skipif(not TOOLS, reason="the mis-tool data set is not beside the project")
@pytest.mark.parametrize("path", TOOLS, ids=lambda path: path.stem)
def test_surgical_tools_with_a_wrong_unit_in_the_heading(path: Path) -> None:
    recording = import_table(
        path,
        columns={"time": 0, "opening": "Back-end CUI Encoder", "motor_torque": 2},
        units={"time": "s"},
        scale={"opening": 2 * math.pi / 8192, "motor_torque": 0.000039811},
    )
    assert 19_900 < len(recording.samples) <= 20_000
    assert recording.duration_s == pytest.approx(20.0, abs=0.01)
    assert any("although its heading has ms" in note for note in recording.notes)
    # 0.1 or 0.5 Hz for 20 s: two turns or ten.
    assert len(recording.strokes) in (4, 20)
    assert float(np.ptp(recording.samples["opening"])) == pytest.approx(1.02, abs=0.02)
