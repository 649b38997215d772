"""What is printed of poses whose pitch is near 90 degrees."""

from collections import Counter
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from scissorcal.cli.fit_plate import facts, text
from scissorcal.cli.track import track_line
from scissorcal.recipe import EulerAngles
from scissorcal.report import plate_panels
from scissorcal.vision import Pose
from scissorcal.workday import plain
from tests.report.geometry_fits import plate_fit

SD = np.diag([1e-3] * 3 + [1e-4] * 3) ** 2


def posed(pitch: float) -> Pose:
    return Pose(EulerAngles(30.0, pitch, 20.0).quaternion, (0.01, 0.02, 0.03), SD)


@pytest.mark.parametrize(
    ("pitch", "sentence"),
    [
        (89.0, ""),
        (89.9, "within 0.17 deg (3 standard deviations of the pose) of 90 deg: only the difference "
         "yaw - roll = 10.00 deg is determined"),
        (-90.0, "of -90 deg: only the sum yaw + roll = 50.00 deg is determined"),
    ],
)  # fmt: skip
def test_terminal_json_and_report_tell_what_is_determined(pitch: float, sentence: str) -> None:
    fit = replace(plate_fit(), camera_plate=posed(pitch), rig_plate=None)
    outcome = SimpleNamespace(result=fit, cached=False, pictures=())
    printed = text(outcome)  # type: ignore[arg-type]
    assert ("the quaternion counts" in printed) == bool(sentence)
    assert sentence in printed
    angles = plain(facts(outcome))["camera_plate"]["euler_angles"]  # type: ignore[arg-type]
    assert sentence in angles["note"]
    assert (angles["sd_deg"] is None) == bool(sentence)
    panel = plate_panels(fit, [])[0]
    notes = [note for note in panel.notes if "the quaternion counts, " not in note]
    assert sentence in " ".join(notes)
    rows = {row.name: row.values[0] for row in panel.rows}
    assert (rows["yaw"].sd is None) == bool(sentence)
    assert rows["turn about x"].sd == pytest.approx(np.degrees(1e-3))


@pytest.mark.parametrize(("pitch", "words"), [(0.0, ""), (89.95, "(pitch near 90)")])
def test_the_line_of_a_running_track_has_angles(pitch: float, words: str) -> None:
    pose = posed(pitch)
    estimate = SimpleNamespace(
        rotation=pose.matrix, place_m=np.array(pose.translation_m), covariance=SD,
        picture_age_s=0.1, contact_age_s=np.inf,
    )  # fmt: skip
    mark = SimpleNamespace(
        seconds=1.0, done=np.nan, state="pictures", picture=None, estimate=estimate,
        nis=1.0, outcomes=Counter(),
    )  # fmt: skip
    line = track_line(mark, None)  # type: ignore[arg-type]
    assert f"yaw 30.00, pitch {pitch:.2f}, roll 20.00 deg" in line
    assert words in line
