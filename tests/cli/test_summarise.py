"""``scissorcal summarise``: the terminal, the page, JSON, and what is refused."""

from pathlib import Path

import numpy as np
import pytest

from tests.cli.conftest import Cli

COLUMNS = ("-c", "time=t_s", "-c", "opening=angle_deg", "-c", "handle_force=force_N")
LEVER = ("--handle-radius-mm", "60")
DATA = Path(__file__).parents[3] / "shared" / "data" / "mis_tool_friction"


def logged(
    path: Path, cut_N: float, seed: int, zero_N: float = 0.0, travel_deg: float = 25.0
) -> Path:
    """Eight closings and openings: friction of 0.5 N, and the cut while closing."""
    rng = np.random.default_rng(seed)
    time = np.arange(0.0, 16.0, 0.005)
    angle = 30.0 + travel_deg * np.cos(np.pi * time)
    force = np.where(np.sin(np.pi * time) > 0, 0.5 + cut_N, -0.5) + rng.normal(0, 0.05, len(time))
    force += zero_N
    rows = [f"{t:.3f},{a:.2f},{f:.3f}" for t, a, f in zip(time, angle, force, strict=True)]
    path.write_text("\n".join(["t_s,angle_deg,force_N", *rows, ""]), encoding="utf-8")
    return path


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    return tmp_path


def value_of(said: dict[str, object], panel: str, row: str) -> dict[str, float]:
    (found,) = [one for one in said["panels"] if one["id"] == panel]  # type: ignore[index, attr-defined]
    (own,) = [one for one in found["rows"] if one["name"] == row]
    return dict(own["values"][0])


def test_cut_minus_blank_on_terminal_page_and_json(here: Path, cli: Cli) -> None:
    logged(here / "cut.csv", 2.0, 1), logged(here / "blank.csv", 0.0, 2)
    words = ("summarise", "cut.csv", "--blank", "blank.csv", *COLUMNS, *LEVER)
    said = cli(*words, "--cut-length-mm", "40")
    assert said.code == 0, said.err
    assert "8 closing strokes" in said.out
    assert "more than the blank: the interval does not contain 0" in said.out
    page = (here / "summary.html").read_text(encoding="utf-8")
    assert "Log minus blank" in page
    assert str(here) not in page
    found = cli(*words, "--cut-length-mm", "40", "--json").envelope["result"]
    apart = value_of(found, "difference", "mean")
    assert apart["number"] == pytest.approx(2.0 * 0.06, rel=0.01)
    assert apart["low"] < apart["number"] < apart["high"]
    friction = value_of(found, "figures", "half of closing minus opening")
    assert friction["number"] == pytest.approx(0.5 * 0.06, rel=0.02)
    work = value_of(found, "difference", "work of a closing stroke")["number"]
    per_length = value_of(found, "difference", "work per length of cut")["number"]
    # 2 N on a lever of 60 mm over 50 deg, for 40 mm
    assert per_length == pytest.approx(0.12 * np.radians(50.0) / 0.040, rel=0.01)
    assert work < 0.95 * 0.12 * np.radians(50.0), "a stroke's ends are left out"


def test_equal_logs_do_not_differ(here: Path, cli: Cli) -> None:
    logged(here / "a.csv", 1.0, 1), logged(here / "b.csv", 1.0, 12)
    said = cli("summarise", "a.csv", "--compare", "b.csv", *COLUMNS, *LEVER)
    assert "more than the other log: the interval contains 0" in said.out


def test_a_force_without_its_lever_has_no_work(here: Path, cli: Cli) -> None:
    logged(here / "a.csv", 1.0, 1)
    said = cli("summarise", "a.csv", *COLUMNS)
    assert said.code == 0, said.err
    assert "work of a closing stroke" not in said.out
    assert "--handle-radius-mm" in said.out


@pytest.mark.parametrize("zero_N", [-3.0, -0.7, 0.8])
def test_the_sensors_zero_drops_out(here: Path, cli: Cli, zero_N: float) -> None:
    logged(here / "cut.csv", 2.0, 1, zero_N), logged(here / "blank.csv", 0.0, 2, zero_N)
    said = cli("summarise", "cut.csv", "--blank", "blank.csv", *COLUMNS, *LEVER, "--json")
    found = said.envelope["result"]
    assert value_of(found, "difference", "mean")["number"] == pytest.approx(0.12, rel=0.01)
    friction = value_of(found, "figures", "half of closing minus opening")
    assert friction["number"] == pytest.approx(0.03, rel=0.02)


def test_a_blank_over_half_the_range_gives_no_work_per_length(here: Path, cli: Cli) -> None:
    logged(here / "cut.csv", 2.0, 1), logged(here / "blank.csv", 0.0, 2, travel_deg=10.0)
    words = ("summarise", "cut.csv", "--blank", "blank.csv", *COLUMNS, *LEVER)
    said = cli(*words, "--cut-length-mm", "40")
    assert "work per length of cut" not in said.out
    assert "how much of the cut's length falls within it is not known" in " ".join(said.out.split())


def test_notes_of_both_logs_are_shown(here: Path, cli: Cli) -> None:
    logged(here / "cut.csv", 2.0, 1)
    blank = logged(here / "blank.csv", 0.0, 2)
    blank.write_text(blank.read_text(encoding="utf-8")[:-4], encoding="utf-8")
    said = cli("summarise", "cut.csv", "--blank", "blank.csv", *COLUMNS, *LEVER)
    assert "blank.csv: Line 3201, the last one, has no end" in " ".join(said.out.split())
    assert "Line 3201" in (here / "summary.html").read_text(encoding="utf-8")


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("--handle-radius-mm", "-60"), "is no lever"),
        (("--handle-radius-mm", "nan"), "is no lever"),
        (("--handle-radius-mm", "60", "--joint", "linear"), "has no lever"),
        (("--output", "a.csv"), "is a log that is read"),
        (("--output", "page.csv"), "ends in .html"),
    ],
)
def test_options_that_cannot_be_are_refused(
    here: Path, cli: Cli, words: tuple[str, ...], said: str
) -> None:
    log = logged(here / "a.csv", 1.0, 1)
    before = log.read_bytes()
    refused = cli("summarise", "a.csv", *COLUMNS, *words)
    assert refused.code == 2
    assert said in refused.err
    assert log.read_bytes() == before


def test_a_force_on_a_carriage_is_no_torque(here: Path, cli: Cli) -> None:
    logged(here / "a.csv", 1.0, 1)
    words = ("--joint", "linear", "-u", "opening=mm")
    found = cli("summarise", "a.csv", *COLUMNS, *words, "--json").envelope["result"]
    mean = value_of(found, "figures", "closing, mean")
    assert (mean["number"], mean["unit"]) == (pytest.approx(1.5, rel=0.01), "N")


def test_what_cannot_be_compared_is_refused(here: Path, cli: Cli) -> None:
    logged(here / "a.csv", 1.0, 1)
    twice = cli("summarise", "a.csv", "--blank", "a.csv", "--compare", "a.csv", *COLUMNS)
    assert twice.code == 2
    assert "not both" in twice.err
    without = cli("summarise", "a.csv", "-c", "time=t_s", "-c", "opening=angle_deg")
    assert without.code == 2
    assert "-c handle_force=COLUMN" in without.err
    turns = cli("summarise", "a.csv", *COLUMNS, "-u", "opening=rad")
    assert turns.code == 2
    assert "-u opening=deg" in turns.err
    assert not (here / "summary.html").exists()


def test_a_recording_is_summed_up_as_its_log(here: Path, cli: Cli) -> None:
    logged(here / "a.csv", 1.0, 1)
    cli("import", "a.csv", *COLUMNS, *LEVER, "--output", "a.mcap")
    of_log = cli("summarise", "a.csv", *COLUMNS, *LEVER, "--json").envelope["result"]
    of_recording = cli("summarise", "a.mcap", "--json").envelope["result"]
    row = ("figures", "closing, mean")
    assert value_of(of_recording, *row) == value_of(of_log, *row)


@pytest.mark.skipif(not DATA.exists(), reason="the real data are not beside the project")
@pytest.mark.parametrize(("name", "low", "high"), [("00", 0.045, 0.060), ("03", 0.055, 0.086)])
def test_friction_of_a_real_tool_is_the_published_one(
    here: Path, cli: Cli, name: str, low: float, high: float
) -> None:
    """Maryland jaw (mis_tool_friction): 50 mN m at little load, 86 mN m at the largest load."""
    said = cli(
        "summarise",
        DATA / f"Tool_4_Maryland_L_2_{name}.TXT",
        *("-c", "time=0", "-c", "opening=1", "-c", "motor_torque=2"),
        *("-u", "time=s", "-u", "opening=counts", "-u", "motor_torque=counts"),
        *("-s", "opening=7.66990394e-4", "-s", "motor_torque=3.9811e-5", "--json"),
    )
    friction = value_of(said.envelope["result"], "figures", "half of closing minus opening")
    assert low < friction["number"] < high


CASES = Path(__file__).parents[3] / "shared" / "cases"


def case(name: str) -> Path:
    if not (CASES / name).is_file():
        pytest.skip(f"{name} is not beside the project")
    return CASES / name


def test_a_force_that_is_never_below_0_keeps_its_sign(here: Path, cli: Cli) -> None:
    path = str(case("summarise/one_sided.csv"))
    columns = ("-c", "time=time_s", "-c", "opening=angle_deg", "-c", "handle_force=force_N")
    said = cli("summarise", path, *columns, "--json")
    mean = value_of(said.envelope["result"], "figures", "closing, mean")
    assert mean["number"] == pytest.approx(5.0, abs=0.1)
    shown = cli("summarise", path, *columns).out
    assert "which sign resists closing is not determined" in shown
    assert "plateau, closing: from" in shown


def test_what_is_no_measurement_is_named(here: Path, cli: Cli) -> None:
    """Marks of overflow, a sensor at its ends, gaps: each in words, with its count."""
    path = logged(here / "a.csv", 1.0, 1)
    lines = path.read_text(encoding="utf-8").splitlines()
    for row in (100, 900, 2000):
        lines[row] = lines[row].rpartition(",")[0] + ",9999"
    del lines[1500:1503]
    path.write_text("\n".join([*lines, ""]), encoding="utf-8")
    said = cli("summarise", "a.csv", *COLUMNS, "--allow-gaps").out
    assert "handle_force is exactly 9999 N in 3 samples" in said
    assert "3 frames are missing in 1 gap" in said
    ends = [line.rpartition(",") for line in lines[1:]]
    cut = [f"{head},{max(-0.2, min(0.2, float(force)))}" for head, _, force in ends]
    (here / "b.csv").write_text("\n".join([lines[0], *cut, ""]), encoding="utf-8")
    said = cli("summarise", "b.csv", *COLUMNS, "--allow-gaps").out
    assert "handle_force is -0.2 or 0.2 N, its least and its largest value, in" in said
