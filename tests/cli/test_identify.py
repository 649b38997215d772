"""``scissorcal identify``: the terminal, the page, JSON, exports, and what is refused."""

from pathlib import Path

import numpy as np
import pytest

from tests.cli.conftest import Cli
from tests.identify.logs import MadeJoint, write


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_a_log_with_good_headings_needs_no_option(here: Path, cli: Cli) -> None:
    write(here / "a.csv", MadeJoint().log((0.1, 0.3, 1.0, 3.0), 1))
    write(here / "b.csv", MadeJoint().log((0.2, 2.0), 2))
    words = ("identify", "a.csv", "--compare", "b.csv", "--to", "mujoco", "--export", "joint.xml")
    said = cli(*words)
    assert said.code == 0, said.err
    assert "inertia" in said.out
    assert "Not identified, and which motion would" in said.out
    assert "joint.xml: off the fitted law by" in said.out
    page = (here / "joint.html").read_text(encoding="utf-8")
    for wanted in ("Friction over speed", "Residuals over time", "b.csv: predicted"):
        assert wanted in page
    assert str(here) not in page
    for word in ("opening", "handle", "blade", "scissors", "sweep"):
        assert word not in said.out, word
    found = cli(*words, "--json").envelope["result"]
    inertia = next(one for one in found["parameters"] if one["name"] == "inertia")
    assert inertia["mean"] == pytest.approx(2e-3, rel=0.02)
    assert found["compared"][0]["log"] == "b.csv"
    assert found["export_off_by"] < 1e-3


def test_an_export_alone_is_printed(here: Path, cli: Cli) -> None:
    write(here / "a.csv", MadeJoint().log((0.3, 1.0, 3.0), 1))
    said = cli("identify", "a.csv", "--to", "urdf")
    assert said.out.startswith("<?xml")


ROWS = MadeJoint().log((0.5, 1.0), 1)


def columns(path: Path, heading: str, *values: np.ndarray) -> None:
    np.savetxt(path, np.column_stack(values), "%.6f", ",", header=heading, comments="")


@pytest.mark.parametrize(
    ("heading", "places", "sentence"),
    [
        ("time_s", (0,), "has one column"),
        ("angle_deg,torque_Nm", (1, 2), "no heading says which column is the time"),
        ("time_s,a,b", (0, 1, 2), "no heading says which column is the position"),
        ("time_s,angle_deg,current_A", (0, 1, 2), "no heading says which column is the effort"),
        ("time_s,q1_rad,q2_rad,tau_Nm", (0, 1, 1, 2), "2 columns could be the position"),
        ("time_s,q_rad,tau1_Nm,tau2_Nm", (0, 1, 2, 2), "2 columns could be the effort"),
        ("time_s,q,tau", (0, 1, 2), "so whether the joint turns or slides is not either"),
    ],
)
def test_headings_that_do_not_say_enough(
    here: Path, cli: Cli, heading: str, places: tuple[int, ...], sentence: str
) -> None:
    """Each names the file and what to give."""
    columns(here / "log.csv", heading, *(ROWS[:, place] for place in places))
    said = cli("identify", "log.csv")
    assert said.code == 2
    assert sentence in said.err
    assert "log.csv" in said.err
    remedies = ("-c ", "-u ", "--rate-hz", "into one table")
    assert any(remedy in said.err for remedy in remedies)


def test_a_constant_position_or_effort_is_named(here: Path, cli: Cli) -> None:
    time, angle, torque = ROWS.T
    for name, values in (
        ("position", (time, 0 * angle, torque)),
        ("effort", (time, angle, 0 * time)),
    ):
        columns(here / "log.csv", "time_s,angle_rad,torque_Nm", *values)
        said = cli("identify", "log.csv")
        assert said.code == 2
        assert f"log.csv: the {name} is 0 in every row" in said.err


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (("--gain", "effort=fit"), "no log tells it"),
        (("--delay", "position=fit"), "estimate --delay effort=fit"),
        (("--offset", "effort=fit"), "is not needed"),
        (("--gain", "effort=two"), "give a number"),
        (("--delay", "torque=0.1"), "there is no such sensor"),
        (("-c", "opening=1"), "is not a channel"),
        (("--term", "sine(position)"), "Did you mean 'sin(position)'"),
        (("--export", "x.xml"), "needs --to"),
        (("--output", "page.txt"), "ends in .html"),
    ],
)
def test_options_that_cannot_be(
    here: Path, cli: Cli, words: tuple[str, ...], sentence: str
) -> None:
    write(here / "a.csv", ROWS)
    said = cli("identify", "a.csv", *words)
    assert said.code == 2
    assert sentence in said.err


def test_a_stated_column_settles_two_joints(here: Path, cli: Cli) -> None:
    time, angle, torque = ROWS.T
    head = "time_s,q1_rad,q2_rad,tau1_Nm,tau2_Nm"
    columns(here / "log.csv", head, time, angle, 0 * time, torque, 0 * time)
    said = cli("identify", "log.csv", "-c", "position=q1_rad", "-c", "effort=tau1_Nm", "--json")
    assert said.code == 0, said.err
    inertia = next(p for p in said.envelope["result"]["parameters"] if p["name"] == "inertia")
    assert inertia["mean"] == pytest.approx(2e-3, rel=0.05)
