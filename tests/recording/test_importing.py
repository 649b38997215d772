"""Tables of others become recordings in SI, or a sentence says where they are wrong."""

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from scissorcal.errors import InputError
from scissorcal.recording import (
    ImportOptions,
    Joint,
    content_hash,
    import_table,
    read_recording,
    write_recording,
)
from tests.recording.logs import COLUMNS, UNITS, assert_holds, refusal, rows, written


@pytest.mark.parametrize("delimiter", [",", ";", "\t", " ", "|", ", ", " ; "])
@pytest.mark.parametrize("head", ["t,angle,torque", None])
def test_delimiters_and_headings_are_found(
    tmp_path: Path, delimiter: str, head: str | None
) -> None:
    path = written(tmp_path / "log.csv", rows(), delimiter, head)
    columns: dict[str, str | int] = (
        COLUMNS if head else {"time": 0, "opening": "1", "motor_torque": 2}
    )
    recording = import_table(path, columns=columns, units=UNITS)
    assert_holds(recording, rows())
    assert recording.kind == "friction"
    assert recording.source == str(path)
    assert recording.content_hash == content_hash(path)
    assert [stroke.kind for stroke in recording.strokes] == ["closing", "opening"] * 2
    assert set(recording.samples["stroke"]) <= {-1, 0, 1, 2, 3}
    assert recording.samples["sequence"].tolist() == list(range(400))
    assert any("set to 0: advance, handle_force" in note for note in recording.notes)


def test_a_delimiter_may_be_named(tmp_path: Path) -> None:
    for name, character in (("tab", "\t"), ("\\t", "\t"), ("space", " "), (":", ":"), (";", ";")):
        path = written(tmp_path / "log.csv", rows(), character)
        assert_holds(
            import_table(path, columns=COLUMNS, units=UNITS, options=ImportOptions(delimiter=name)),
            rows(),
        )
    for nonsense in ("comma", ";;", "1", ".", '"'):
        assert "cannot separate the columns" in refusal(path, delimiter=nonsense)
    assert "has no row of numbers" in refusal(path, delimiter="|")


def test_decimal_commas_quotes_byte_order_mark_and_windows_lines(tmp_path: Path) -> None:
    lines = ['"t";"angle";"torque"']
    lines += [";".join(f'"{value}"'.replace(".", ",") for value in row) for row in rows()]
    text = "\r\n".join([*lines, ""])
    (tmp_path / "log.csv").write_text(text, encoding="utf-8-sig", newline="")
    assert_holds(import_table(tmp_path / "log.csv", columns=COLUMNS, units=UNITS), rows())


def test_comments_preamble_units_line_and_blank_lines(tmp_path: Path) -> None:
    body = [",".join(map(str, row)) for row in rows()]
    text = ["# a log", "Rate,100", "Operator: A", "t,angle,torque", "s,rad,mNm", ""]
    text += [*body[:100], "% the hand rested", "", *body[100:], ""]
    path = tmp_path / "log.txt"
    path.write_text("\n".join(text), encoding="utf-8")
    recording = import_table(path, columns=COLUMNS)
    expected = np.array(rows())
    np.testing.assert_array_equal(recording.samples["opening"], expected[:, 1])
    np.testing.assert_allclose(recording.samples["motor_torque"], 1e-3 * expected[:, 2])
    # The line number of a fault counts comments and blank lines.
    text[6 + 150 + 2] = "1.5,abc,0"
    path.write_text("\n".join(text), encoding="utf-8")
    assert "line 159, column 'angle [rad]': 'abc' is not a number" in refusal(path, units={})


@pytest.mark.parametrize(
    ("channel", "unit", "joint", "factor"),
    [
        ("opening", "deg", "rotary", math.pi / 180),
        ("opening", "°", "rotary", math.pi / 180),
        ("opening", "mrad", "rotary", 1e-3),
        ("opening", "mm", "linear", 1e-3),
        ("opening", "um", "linear", 1e-6),
        ("opening", "µm", "linear", 1e-6),
        ("motor_torque", "N m", "rotary", 1.0),
        ("motor_torque", "mN m", "rotary", 1e-3),
        ("motor_torque", "N mm", "rotary", 1e-3),
        ("motor_torque", "mN", "linear", 1e-3),
        ("motor_torque", "kN", "linear", 1e3),
        ("time", "ms", "rotary", 1e-3),
        ("time", "us", "rotary", 1e-6),
    ],
)
def test_units(tmp_path: Path, channel: str, unit: str, joint: Any, factor: float) -> None:
    table = np.array(rows())
    place = list(COLUMNS).index(channel)
    table[:, place] /= factor
    units = {"time": "s", "opening": "rad", "motor_torque": "N m"}
    if joint == "linear":
        units = {"time": "s", "opening": "m", "motor_torque": "N"}
    path = written(tmp_path / "log.csv", table.tolist())
    recording = import_table(
        path,
        columns=COLUMNS,
        units={**units, channel: unit},
        options=ImportOptions(joint=Joint(joint)),
    )
    expected = np.array(rows())
    found = recording.device_time_s if channel == "time" else recording.samples[channel]
    np.testing.assert_allclose(found, expected[:, place], rtol=1e-12, atol=5e-7)
    assert len(recording.strokes) == 4


def test_units_in_headings_count_and_a_contradiction_is_noted(tmp_path: Path) -> None:
    table = np.array(rows()) * [1e3, 180 / math.pi, 1.0]
    path = written(tmp_path / "log.csv", table.tolist(), head="t [ms],angle (deg),torque_Nm")
    columns: dict[str, str | int] = {"time": "T", "opening": "Angle", "motor_torque": "torque_Nm"}
    recording = import_table(path, columns=columns)
    np.testing.assert_allclose(recording.samples["opening"], np.array(rows())[:, 1], rtol=1e-12)
    other = import_table(path, columns=columns, units={"time": "s"})
    assert other.duration_s == pytest.approx(3990.0)
    assert "Column 't [ms]' was read in s, as stated, although its heading has ms." in other.notes


def test_a_scale_keeps_the_unit_or_leads_to_si_from_counts(tmp_path: Path) -> None:
    table = np.array(rows()) * [1, 180 / math.pi, 1e3]
    path = written(tmp_path / "log.csv", table.tolist(), head="t,angle [deg],torque [counts]")
    columns: dict[str, str | int] = {"time": "t", "opening": "angle", "motor_torque": "torque"}
    recording = import_table(
        path, columns=columns, units={"time": "s"}, scale={"opening": -1, "motor_torque": "1/1000"}
    )
    expected = np.array(rows())
    np.testing.assert_allclose(recording.samples["opening"], -expected[:, 1], rtol=1e-12)
    np.testing.assert_allclose(recording.samples["motor_torque"], expected[:, 2], rtol=1e-12)


def test_a_rate_in_place_of_a_time_column(tmp_path: Path) -> None:
    path = written(tmp_path / "log.csv", rows())
    columns = {channel: column for channel, column in COLUMNS.items() if channel != "time"}
    units = {channel: unit for channel, unit in UNITS.items() if channel != "time"}
    recording = import_table(path, columns=columns, units=units, rate_Hz=3000.0)
    np.testing.assert_allclose(recording.device_time_s, np.arange(400) / 3000, atol=5e-7)
    assert "or give the rate, but not both" in refusal(path, rate_Hz=100.0)
    assert "or give the rate, but not both" in refusal(path, columns=columns, units=units)
    for rate in (0.0, -1.0, math.nan, math.inf, 2e6):
        assert "not possible" in refusal(path, columns=columns, units=units, rate_Hz=rate)


BAD_ROWS = [
    ([1.05, "abc", 0.0], "line 107, column 'angle': 'abc' is not a number"),
    ([1.05, "", 0.0], "line 107, column 'angle': it is empty"),
    ([1.05, "nan", 0.0], r"line 107, column 'angle': nan is not a measurement (1 such cells"),
    ([1.05, 0.5, "-inf"], "line 107, column 'torque': -inf is not a measurement"),
    ([1.04, 0.5, 0.0], "line 107, column 't': the time 1.04 s is repeated"),
    ([1.0400001, 0.5, 0.0], "line 107, column 't': the time 1.0400001 s is repeated"),
    ([1.02, 0.5, 0.0], "line 107, column 't': time decreases from 1.04 s to 1.02 s"),
    ([1.05, 0.5], "line 107 has 2 cells where the others have 3"),
    ([1.05, 0.5, 0.0, 9], "line 107 has 4 cells where the others have 3"),
]


@pytest.mark.parametrize(("bad", "words"), BAD_ROWS)
@pytest.mark.parametrize("allow_gaps", [False, True])
def test_faults_are_named_by_line_and_column(
    tmp_path: Path, bad: list[Any], words: str, allow_gaps: bool
) -> None:
    table: list[list[Any]] = list(rows())
    table[105] = bad
    path = written(tmp_path / "log.csv", table)
    message = refusal(path, allow_gaps=allow_gaps)
    assert str(path) in message
    assert words in message


def test_a_last_line_that_was_cut_off_is_named(tmp_path: Path) -> None:
    path = written(tmp_path / "log.csv", rows())
    text = path.read_text().rstrip("\n")
    path.write_text(text[: text.rindex(",")])
    found = import_table(path, columns=COLUMNS, units=UNITS)
    assert_holds(found, rows()[:-1])
    assert any("Line 401, the last one, has 2 cells" in note for note in found.notes)
    assert "line 401 has 2 cells where the others have 3" in refusal(path, drop_last_line=False)


def test_gaps_are_refused_or_kept_and_noted(tmp_path: Path) -> None:
    table = [row for i, row in enumerate(rows()) if i not in (50, 51, 52, 200)]
    path = written(tmp_path / "log.csv", table)
    message = refusal(path)
    assert "line 52, column 't': 0.04 s since the row before" in message
    assert "where 0.01 s are usual (2 such gaps in all, the longest 0.04 s)" in message
    assert "Allow gaps" in message
    assert "bridges gaps of up to 0.05 s (here 2 of 2)" in message
    assert "about 0.04 s of 3.96 s" in message
    recording = import_table(
        path, columns=COLUMNS, units=UNITS, options=ImportOptions(allow_gaps=True)
    )
    assert_holds(recording, table)
    note = "4 frames are missing in 2 gaps, the longest (3 frames) at 0.490 s."
    assert note in recording.notes
    assert any("about 0.04 s of 3.96 s" in said for said in recording.notes)
    stored = read_recording(write_recording(recording, tmp_path / "log.mcap"))
    assert stored.notes == recording.notes
    assert len(stored.strokes) == len(recording.strokes)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (
            {"columns": {"time": "t", "motor_torque": "torque"}, "units": {}},
            "no column is given for opening",
        ),
        (
            {"columns": {"time": "t", "opening": "angle"}, "units": {}},
            "motor_torque or handle_force",
        ),
        ({"columns": {**COLUMNS, "openning": "angle"}}, "Did you mean 'opening'?"),
        ({"columns": {**COLUMNS, "opening": "angel"}}, "no column 'angel' for opening. Name one"),
        ({"columns": {**COLUMNS, "opening": 3}}, "numbered 0 to 2"),
        ({"columns": {**COLUMNS, "opening": "7"}}, "numbered 0 to 2"),
        ({"columns": {**COLUMNS, "handle_force": "torque"}}, "needs the handle radius"),
        ({"units": {**UNITS, "advance": "m"}}, "given for advance, but no column"),
        ({"units": {"time": "s", "opening": "rad"}}, "its unit is not known. State it"),
        ({"units": {**UNITS, "opening": "m"}}, "Set the joint to linear"),
        ({"units": {**UNITS, "opening": "N"}}, "Give a unit such as rad"),
        ({"units": {**UNITS, "opening": "furlong"}}, "'furlong' is not a known unit"),
        ({"units": {**UNITS, "motor_torque": "V"}}, "Give a scale for motor_torque, in N m per V"),
        ({"units": {**UNITS, "motor_torque": "counts"}}, "in N m per counts"),
        ({"scale": {"motor_torque": "gain"}}, "names 'gain', which is neither a number"),
        ({"scale": {"motor_torque": "0"}}, "finite and not zero"),
        ({"scale": {"motor_torque": "1/0"}}, "finite and not zero"),
        ({"scale": {"motor_torque": "2**3"}}, "names ''"),
        ({"min_travel": -1.0}, "least travel"),
    ],
)
def test_requests_that_cannot_be_met(tmp_path: Path, options: dict[str, Any], words: str) -> None:
    message = refusal(written(tmp_path / "log.csv", rows()), **options)
    assert words in message


def test_a_length_is_no_time(tmp_path: Path) -> None:
    path = tmp_path / "log.csv"
    path.write_text("t_mm,angle_rad,torque_Nm\n0,0.1,1\n1,0.2,1\n2,0.3,1\n")
    with pytest.raises(InputError, match="mm is not a unit of time"):
        import_table(path, columns={"time": 0, "opening": 1, "motor_torque": 2})


def test_repeated_headings(tmp_path: Path) -> None:
    path = written(tmp_path / "log.csv", rows(), head="t,angle,angle")
    assert "has 2 columns called 'angle'" in refusal(path)


@pytest.mark.parametrize(
    ("name", "data", "words"),
    [
        ("log.csv", b"", "is empty"),
        ("log.csv", b"t,angle,torque\n", "no row of numbers"),
        ("log.csv", b"t,angle,torque\n0,1,2\n", "holds 1 rows"),
        ("log.csv", b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR", "is a PNG image, not a table in text"),
        ("log.csv", "t,angle,torque\n0,1,2\n".encode("utf-16"), "is text in UTF-16"),
        ("log.csv", b"hello\nworld\n", "no row of numbers"),
        ("log.mat", b"hello" * 100, "is text, not a MATLAB file"),
        ("log.mat", b"MATLAB 7.3 MAT-file" + bytes(600), "is not a MATLAB file, or it is damaged"),
        ("log.parquet", b"PAR1" + bytes(60) + b"PAR1", "is not a Parquet table, or it is damaged"),
    ],
)
def test_files_that_are_no_tables(tmp_path: Path, name: str, data: bytes, words: str) -> None:
    (tmp_path / name).write_bytes(data)
    message = refusal(tmp_path / name)
    assert words in message
    assert name in message


def test_a_missing_file(tmp_path: Path) -> None:
    assert "does not exist" in refusal(tmp_path / "log.csv")


def test_no_motion_is_noted(tmp_path: Path) -> None:
    table = [[row[0], 0.5 + 1e-4 * (i % 2), row[2]] for i, row in enumerate(rows())]
    recording = import_table(written(tmp_path / "log.csv", table), columns=COLUMNS, units=UNITS)
    assert recording.strokes == ()
    assert "No stroke was found: the joint moves less than the least travel." in recording.notes


@given(
    data=st.binary(max_size=200)
    | st.text(alphabet='0123,;.\t\n -eabn%#"', max_size=200).map(str.encode)
)
def test_random_text_is_read_or_refused(
    tmp_path_factory: pytest.TempPathFactory, data: bytes
) -> None:
    path = tmp_path_factory.getbasetemp() / "random.csv"
    path.write_bytes(data)
    try:
        found = import_table(
            path,
            columns={"opening": 0, "motor_torque": 0},
            units={"opening": "rad", "motor_torque": "Nm"},
            rate_Hz=10,
        )
    except InputError:
        return
    assert np.isfinite(found.samples["opening"]).all()


@pytest.mark.parametrize(
    ("unit", "period", "low"),
    [("deg", 360.0, 0.0), ("deg", 360.0, -180.0), ("rad", 2 * math.pi, 0.0), ("counts", 4096, 0)],
)
def test_a_position_that_begins_again_is_continued(
    tmp_path: Path, unit: str, period: float, low: float
) -> None:
    """Sweeps of 50 deg across the place where the sensor begins again."""
    turn = 2 * math.pi
    begins = turn * low / period
    angle = begins + 0.2 + np.radians(25.0) * np.cos(np.arange(1200) / 40.0)
    value = (angle / turn * period - low) % period + low
    value = np.floor(value) if unit == "counts" else np.round(value, 6)
    table = [[k * 0.01, v, 0.01 * k] for k, v in enumerate(value.tolist())]
    path = written(tmp_path / "log.csv", table)
    scale = {"opening": turn / period} if unit == "counts" else {}
    units = {**UNITS, "opening": "rad" if unit == "counts" else unit}
    recording = import_table(path, columns=COLUMNS, units=units, scale=scale)
    moved = recording.samples["opening"] - recording.samples["opening"][0]
    assert moved == pytest.approx(angle - angle[0], abs=2e-3)
    assert any("begins again at line" in note for note in recording.notes)
    closing = [stroke for stroke in recording.strokes if stroke.kind == "closing"]
    assert len(closing) == 5


@pytest.mark.parametrize(
    ("jump", "unit"), [(200.0, "counts"), (230.0, "counts"), (255.0, "counts"), (300.0, "deg")]
)
def test_a_single_jump_is_no_wrap(tmp_path: Path, jump: float, unit: str) -> None:
    """An encoder that is set anew, or loses its place, far from where it would begin again."""
    way = np.floor(20.0 + 10.0 * np.cos(np.arange(600) / 40.0)) + jump * (np.arange(600) >= 300)
    path = written(tmp_path / "log.csv", [[k * 0.01, v, 0.0] for k, v in enumerate(way.tolist())])
    scale = {"opening": 0.001} if unit == "counts" else {}
    units = {**UNITS, "opening": "rad" if unit == "counts" else unit}
    recording = import_table(path, columns=COLUMNS, units=units, scale=scale)
    assert not any("begins again" in note for note in recording.notes)


def test_a_position_with_marks_of_loss_is_refused(tmp_path: Path) -> None:
    rng = np.random.default_rng(0)
    angle = np.round(np.where(rng.random(400) < 0.02, 300.0, 30.0 + np.arange(400) / 10.0), 3)
    path = written(tmp_path / "log.csv", [[k * 0.01, a, 0.0] for k, a in enumerate(angle.tolist())])
    said = refusal(path, units={**UNITS, "opening": "deg"})
    assert "300 stands in 9 rows where nothing leads from or to the other values" in said


def test_sheets_are_those_of_a_column(tmp_path: Path) -> None:
    """A stroke has the sheet of its first sample; -1 is no mark of loss but no sheet."""
    sheets = [-1] * 150 + [0] * 150 + [1] * 100
    table = [[*row, sheet] for row, sheet in zip(rows(), sheets, strict=True)]
    path = written(tmp_path / "log.csv", table, head="t,angle,torque,piece")
    columns = {**COLUMNS, "sheet": "piece"}
    cut = ImportOptions(kind="cut")
    recording = import_table(path, columns=columns, units=UNITS, options=cut)
    first = [int(np.argmax(recording.samples["stroke"] == s.index)) for s in recording.strokes]
    assert [stroke.sheet for stroke in recording.strokes] == [sheets[place] for place in first]
    assert len({stroke.sheet for stroke in recording.strokes}) == 3
    again = read_recording(write_recording(recording, tmp_path / "cut.mcap"))
    assert again.strokes == recording.strokes
    assert not any("sheet is cut" in note for note in recording.notes)
    without = import_table(path, columns=COLUMNS, units=UNITS, options=cut)
    assert any("name one that counts fresh sheets" in note for note in without.notes)


@pytest.mark.parametrize("wrong", [0.5, -2.0])
def test_what_counts_no_sheet_is_refused_with_its_line(tmp_path: Path, wrong: float) -> None:
    table = [[*row, 0.0] for row in rows()]
    table[6][-1] = wrong
    path = written(tmp_path / "log.csv", table, head="t,angle,torque,piece")
    columns = {**COLUMNS, "sheet": "piece"}
    with pytest.raises(InputError, match=rf"line 8, column 'piece': {wrong:g} counts no sheet"):
        import_table(path, columns=columns, units=UNITS)
    with pytest.raises(InputError, match="neither a unit nor a scale"):
        import_table(path, columns=columns, units={**UNITS, "sheet": "mm"})
