"""Logs whose numbers are none of a measurement, or mean another thing: read right, or in words."""

import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from scissorcal.aliases import Array
from scissorcal.calibration import channels_of, survey
from scissorcal.errors import InputError
from scissorcal.recording import (
    ImportOptions,
    Joint,
    Recording,
    continued_clock,
    empty_samples,
    import_table,
    jumps_in,
    lone_excursion,
    marks_in,
    overflows,
    size_note,
)
from tests.recording.logs import imported

CASES = Path(__file__).parents[3] / "shared" / "cases" / "logs"
COUNT, RATE_HZ = 1600, 200.0
TIME = np.arange(COUNT) / RATE_HZ
ANGLE = 35.0 - 25.0 * np.cos(0.5 * np.pi * TIME)
SWING = np.sin(0.5 * np.pi * TIME)
FORCE = 2.0 - 0.8 * np.tanh(5.0 * SWING) + np.random.default_rng(0).normal(0.0, 0.02, COUNT)
HEAD = ("time_s", "angle_deg", "force_N")
LOST = [50, 400, 401, 900, 1500]


def texts(values: Array, digits: int = 4) -> list[str]:
    return [f"{value:.{digits}f}" for value in values]


def read(
    folder: Path,
    cells: Sequence[Sequence[str]],
    head: Sequence[str] = HEAD,
    delimiter: str = ",",
    **options: object,
) -> Recording:
    rows = [delimiter.join(row) for row in (head, *zip(*cells, strict=True))]
    path = folder / "log.csv"
    path.write_text("\n".join([*rows, ""]), encoding="utf-8")
    chosen = {"columns": {"time": 0, "opening": 1, "handle_force": 2}, "handle_radius_m": 0.06}
    return imported(path, **{**chosen, **options})


def told(recording: Recording) -> str:
    return " ".join([*recording.notes, *survey(recording, ("opening", "handle_force")).notes])


@pytest.mark.parametrize(
    ("name", "effort", "said"),
    [
        ("wrap_angle_360", "torque_Nm", "begins again at line 228, line 577, line 1028 and 9 more"),
        ("overflow_marks", "torque_Nm", "exactly 9999 N m in 5 samples"),
        ("clipped", "force_N", "its least and its largest value, in 90.6% of the samples"),
    ],
)
def test_the_logs_of_others(name: str, effort: str, said: str) -> None:
    path = CASES / f"{name}.csv"
    if not path.is_file():
        pytest.skip(f"{path.name} is not beside the project")
    channel = "handle_force" if effort == "force_N" else "motor_torque"
    columns = {"time": "time_s", "opening": "angle_deg", channel: effort}
    recording = import_table(path, columns=columns, options=ImportOptions(handle_radius_m=0.06))
    notes = [*recording.notes, *survey(recording, ("opening", channel)).notes]
    assert said in " ".join(notes)
    assert len(recording.strokes) == 12
    assert np.degrees(np.ptp(recording.samples["opening"])) == pytest.approx(50.0, abs=0.1)


def test_an_ordinary_log_gets_no_remark(tmp_path: Path) -> None:
    recording = read(tmp_path, (texts(TIME), texts(ANGLE), texts(FORCE)))
    assert survey(recording, ("opening", "handle_force")).notes == ()
    assert len(recording.notes) == 3, recording.notes


@pytest.mark.parametrize("period", [90.0, 180.0, 400.0])
def test_a_wrap_of_an_unknown_period_is_named(tmp_path: Path, period: float) -> None:
    angle = np.mod(ANGLE - 30.0, period)
    assert "jumps by" in told(read(tmp_path, (texts(TIME), texts(angle), texts(FORCE))))


@pytest.mark.parametrize("bits", [10, 16, 24])
@pytest.mark.parametrize("step", [1.0, 0.01])
def test_a_force_that_passes_the_end_of_its_counter_is_named(
    tmp_path: Path, bits: int, step: float
) -> None:
    for counts in (
        np.mod(np.rint(300.0 * (FORCE - 2.0)), 2.0**bits),
        np.mod(np.rint(300.0 * FORCE) - 600.0, 2.0**bits) - 2.0 ** (bits - 1),
    ):
        recording = read(tmp_path, (texts(TIME), texts(ANGLE), texts(step * counts, 2)))
        assert f"a counter of {bits} bits" in told(recording)


@pytest.mark.parametrize("mark", ["-1", "0", "9999", "-9999", "32767", "1e30", "1e308"])
def test_marks_of_loss_are_named_in_a_force_and_refused_in_an_angle(
    tmp_path: Path, mark: str
) -> None:
    force, angle = texts(FORCE), texts(ANGLE)
    for row in LOST:
        force[row] = angle[row] = mark
    recording = read(tmp_path, (texts(TIME), texts(ANGLE), force))
    assert f"exactly {float(mark):g} N in {len(LOST)} samples" in told(recording)
    with pytest.raises(InputError, match=f"line 52, .* stands in {len(LOST)} rows"):
        read(tmp_path, (texts(TIME), angle, texts(FORCE)))


def test_a_single_value_far_off_is_named(tmp_path: Path) -> None:
    for mark, said in (("9999", "exactly 9999 N in 1 sample"), ("-1", "is -1 N at 5 s alone")):
        force = texts(FORCE)
        force[1000] = mark
        assert said in told(read(tmp_path, (texts(TIME), texts(ANGLE), force)))
    angle = texts(ANGLE)
    angle[1000] = "-1"
    assert "jumps by" in told(read(tmp_path, (texts(TIME), angle, texts(FORCE))))


def test_marks_of_two_kinds_are_all_named(tmp_path: Path) -> None:
    force = texts(FORCE)
    for row in LOST:
        force[row], force[row + 7] = "9998", "9999"
    said = told(read(tmp_path, (texts(TIME), texts(ANGLE), force)))
    assert f"exactly 9998 or 9999 N in {2 * len(LOST)} samples" in said


@pytest.mark.parametrize("word", ["nan", "inf", "-", "", "null", "#N/A", "1.#QNAN", "-nan(ind)"])
def test_words_for_loss_are_refused_with_the_line(tmp_path: Path, word: str) -> None:
    force = texts(FORCE)
    force[50] = word
    with pytest.raises(InputError, match="line 52"):
        read(tmp_path, (texts(TIME), texts(ANGLE), force))


@pytest.mark.parametrize("share", [0.2, 0.6, 0.99])
def test_a_share_at_an_end_is_named(tmp_path: Path, share: float) -> None:
    force = np.minimum(FORCE, np.quantile(FORCE, 1.0 - share))
    recording = read(tmp_path, (texts(TIME), texts(ANGLE), texts(force)))
    assert "cut off" in told(recording)
    (_, sensor) = survey(recording, ("opening", "handle_force")).sensors
    assert sensor.at_high == pytest.approx(share, abs=0.01)


@pytest.mark.parametrize("mark", [".", ",", "'", " ", "\u00a0", "_"])
@pytest.mark.parametrize("delimiter", [";", "\t"])
@pytest.mark.parametrize("decimals", [0, 1])
def test_thousands_separators_are_refused_in_words(
    tmp_path: Path, mark: str, delimiter: str, decimals: int
) -> None:
    point = "." if mark == "," else ","
    parts = str.maketrans({",": mark, ".": point})
    columns = [
        [f"{value:,.{decimals}f}".translate(parts) for value in values]
        for values in (1e3 * TIME, 1e3 * np.radians(ANGLE), 1e3 * (FORCE - 1.5))
    ]
    head = ("t_ms", "angle_mrad", "force_mN")
    with pytest.raises(InputError, match="thousands separators are not read"):
        read(tmp_path, columns, head, delimiter)


def test_three_decimals_are_no_thousands(tmp_path: Path) -> None:
    """Fixed decimals, decimals without zeros at their end, and a first row of whole numbers."""
    for time, angle in (
        (texts(TIME, 3), texts(ANGLE, 3)),
        ([f"{value:g}" for value in TIME], [f"{value:.5g}" for value in ANGLE]),
        (["0", *texts(TIME, 3)[1:]], ["10", *texts(ANGLE, 3)[1:]]),
    ):
        for mark in ".,":
            columns = [[c.replace(".", mark) for c in one] for one in (time, angle, texts(FORCE))]
            recording = read(tmp_path, columns, delimiter=";")
            assert np.degrees(recording.samples["opening"]) == pytest.approx(ANGLE, abs=6e-3)


@pytest.mark.parametrize("cells", ["0,005,12,3,1,25", "1,005,12,030,1,250"])
def test_commas_in_numbers_between_commas_are_refused(tmp_path: Path, cells: str) -> None:
    path = tmp_path / "log.csv"
    path.write_text("\n".join(["t,angle,force", *[cells] * 30, ""]), encoding="utf-8")
    with pytest.raises(InputError, match="6 cells, and line 1 has 3 headings"):
        import_table(
            path,
            columns={"time": 0, "opening": 2},
            units={"time": "s"},
            options=ImportOptions(motion_only=True),
        )


@given(
    bits=st.integers(8, 32),
    signed=st.booleans(),
    step=st.floats(0.5, 16.0),
    jitter=st.floats(0.0, 0.2),
    seed=st.integers(0, 2**32 - 1),
)
@settings(max_examples=60)
def test_a_clock_of_any_counter_goes_on(
    bits: int, signed: bool, step: float, jitter: float, seed: int
) -> None:
    rng = np.random.default_rng(seed)
    steps = np.maximum(1.0, np.rint(step * (1.0 + jitter * rng.uniform(-1.0, 1.0, 400))))
    true = np.cumsum(steps) + 2.0**bits - 0.5 * steps.sum()
    low = -(2.0 ** (bits - 1)) if signed else 0.0
    found, places, period = continued_clock(np.mod(true - low, 2.0**bits) + low, 1e-3)
    assert len(places) >= 1 - signed
    if len(places):
        assert period == 2.0**bits
    assert np.diff(found).tolist() == np.diff(true).tolist()


@pytest.mark.parametrize("period_s", [1.0, 60.0, 3600.0, 86400.0, 65.536, 4294.967296])
def test_a_clock_in_seconds_goes_on(tmp_path: Path, period_s: float) -> None:
    time = texts(np.mod(TIME + period_s - 0.5, period_s), 6)
    recording = read(tmp_path, (time, texts(ANGLE), texts(FORCE)))
    assert recording.device_time_s - recording.device_time_s[0] == pytest.approx(TIME, abs=1e-6)
    assert "The clock begins at 0 again at line 102" in told(recording)


@pytest.mark.parametrize(
    "time",
    [
        np.where(TIME < 4.0, TIME, TIME - 4.0),
        np.mod(TIME, 5.0),
        np.mod(np.arange(COUNT) * 50_000.0, 65_536.0) * 1e-6,
    ],
)
def test_a_clock_that_goes_back_otherwise_is_refused(tmp_path: Path, time: Array) -> None:
    with pytest.raises(InputError, match="time decreases"):
        read(tmp_path, (texts(time, 6), texts(ANGLE), texts(FORCE)))


@given(
    seed=st.integers(0, 2**32 - 1),
    noise=st.floats(0.0, 0.5),
    step=st.sampled_from([0.0, 1e-3, 0.02, 0.3]),
    zero=st.floats(-3.0, 3.0),
)
@settings(max_examples=60)
def test_what_a_sensor_measures_is_no_mark(
    seed: int, noise: float, step: float, zero: float
) -> None:
    """Friction that turns at once, with noise, at any zero, fine or in coarse steps."""
    rng = np.random.default_rng(seed)
    level = np.sign(np.sin(0.02 * np.arange(2000) + rng.uniform(0.0, 6.0)))
    force = zero + level + noise * rng.normal(size=2000)
    force = np.rint(force / step) * step if step else force
    assert marks_in(force) == ()
    assert lone_excursion(force) is None
    assert overflows(force)[0] == 0


@given(
    seed=st.integers(0, 2**32 - 1),
    rate_Hz=st.floats(10.0, 1000.0),
    step=st.sampled_from([0.0, 1e-3, 5e-3, 2e-2]),
)
@settings(max_examples=60)
def test_a_hand_that_moves_is_no_jump(seed: int, rate_Hz: float, step: float) -> None:
    """Strokes of unequal length and speed, with rests, by an encoder of any step."""
    rng = np.random.default_rng(seed)
    places = rng.uniform(0.1, 1.0, 12)
    lasting = rng.uniform(0.3, 3.0, 11)
    at = np.concatenate([[0.0], np.cumsum(lasting)])
    time = np.arange(0.0, at[-1], 1.0 / rate_Hz)
    index = np.clip(np.searchsorted(at, time, side="right") - 1, 0, 10)
    share = (time - at[index]) / lasting[index]
    angle = places[index] + np.diff(places)[index] * 0.5 * (1.0 - np.cos(math.pi * share))
    angle = np.rint(angle / step) * step if step else angle
    assert marks_in(angle) == ()
    assert lone_excursion(angle) is None
    assert len(jumps_in(angle)) == 0


@pytest.mark.parametrize("heading", ["(" * 100_000, "_" * 100_000, "a_m" + "9" * 5000, ")" * 99])
def test_a_heading_of_any_length_is_read_at_once(tmp_path: Path, heading: str) -> None:
    """Quadratic work on 100,000 characters took minutes: the suite's own limit would end it."""
    columns = (texts(TIME[:50]), texts(ANGLE[:50]), texts(FORCE[:50]))
    with pytest.raises(InputError, match="its unit is not known") as refused:
        read(tmp_path, columns, ("time_s", heading, "force_N"))
    assert len(str(refused.value)) < 400


BY_NAME = {"columns": {"time": "time_s", "opening": "angle_deg", "handle_force": "force_N"}}


@pytest.mark.parametrize("spoil", ["rows", "headings", "sep=", "quoted commas"])
def test_delimiters_that_mean_nothing_are_read(tmp_path: Path, spoil: str) -> None:
    """Behind the last cell, in the first line for Excel, or as decimal commas in quoted cells."""
    time, angle, force = texts(TIME), texts(ANGLE), texts(FORCE)
    head = list(HEAD)
    if spoil == "rows":
        force = [f"{cell}," for cell in force]
    elif spoil == "headings":
        head.append("")
    elif spoil == "sep=":
        head[0] = f"sep=,\n{head[0]}"
    else:
        time, angle, force = (
            [f'"{cell.replace(".", ",")}"' for cell in cells] for cells in (time, angle, force)
        )
    recording = read(tmp_path, (time, angle, force), head, **BY_NAME)
    assert np.degrees(recording.samples["opening"]) == pytest.approx(ANGLE, abs=1e-4)
    assert recording.samples["handle_force"] == pytest.approx(FORCE, abs=1e-4)


def test_quoted_thousands_between_commas_are_refused(tmp_path: Path) -> None:
    force = [f'"{1e6 * value:,.1f}"' for value in FORCE]
    with pytest.raises(InputError, match="thousands separators are not read"):
        read(tmp_path, (texts(TIME), texts(ANGLE), force))
    whole = [f'"{1000 + index:,}"' for index in range(COUNT)]  # all of them of 1,000 and more
    times = [str(index) for index in range(COUNT)]
    with pytest.raises(InputError, match="'1,000' stands where digits are in groups"):
        read(tmp_path, (times, times, whole))


@pytest.mark.parametrize("line", ["s,deg", "-----,-----", "Rig number,two"])
def test_a_line_below_the_headings_may_be_narrower(tmp_path: Path, line: str) -> None:
    """The unit of a channel without one is left out, or a title stands between."""
    head = [*HEAD[:-1], f"{HEAD[-1]}\n{line}"]
    recording = read(tmp_path, (texts(TIME), texts(ANGLE), texts(FORCE)), head, **BY_NAME)
    assert recording.samples["handle_force"] == pytest.approx(FORCE, abs=1e-4)


@pytest.mark.parametrize("names", ["{}", '"{}"', '"row {}"'])
@pytest.mark.parametrize("by_name", [True, False])
def test_row_names_without_a_heading_are_refused(tmp_path: Path, names: str, by_name: bool) -> None:
    """As R's write.table leaves them: each heading stands over the column to its right."""
    rows = [names.format(index + 1) for index in range(COUNT)]
    with pytest.raises(InputError, match="line 2 has 4 cells, and line 1 has 3 headings"):
        read(
            tmp_path,
            (rows, texts(TIME), texts(ANGLE), texts(FORCE)),
            units={"time": "s", "opening": "deg", "handle_force": "N"},
            **(BY_NAME if by_name else {}),
        )


def test_an_interval_is_no_time(tmp_path: Path) -> None:
    for cell, said in (("0.005", "--rate-hz 200"), ("1.7e9", "is repeated"), ("0", "is repeated")):
        with pytest.raises(InputError, match=said):
            read(tmp_path, ([cell] * COUNT, texts(ANGLE), texts(FORCE)))


def test_groups_of_two_digits_and_other_digits_are_named(tmp_path: Path) -> None:
    indian = [f"{int(value)},{int(1e5 * value) % 100000:05d}" for value in FORCE]
    indian = [f"{cell[:-3]},{cell[-3:]}.5" for cell in indian]
    with pytest.raises(InputError, match="thousands separators are not read"):
        read(tmp_path, (texts(TIME), texts(ANGLE), indian), delimiter=";")
    arabic = str.maketrans("0123456789", "٠١٢٣٤٥٦٧٨٩")
    with pytest.raises(InputError, match=r"line 2, column 'force_N': .* is not a number"):
        read(tmp_path, (texts(TIME), texts(ANGLE), [one.translate(arabic) for one in texts(FORCE)]))


@pytest.mark.parametrize(
    ("head", "factor", "said"),
    [
        (("time_s", "angle_rad", "force_N"), 1.0, "-u opening=deg"),
        (("time_s", "angle_deg", "force_N"), 1e3, "-u handle_force=mN"),
    ],
)
def test_numbers_of_a_smaller_unit_are_named(
    tmp_path: Path, head: Sequence[str], factor: float, said: str
) -> None:
    recording = read(tmp_path, (texts(TIME), texts(ANGLE), texts(factor * FORCE)), head)
    (note,) = recording.particular
    assert said in note


@given(low=st.floats(-3.0, 3.0), range_rad=st.floats(0.01, 6.2), newtons=st.floats(0.01, 1000.0))
def test_what_scissors_have_is_not_of_another_unit(
    low: float, range_rad: float, newtons: float
) -> None:
    """Any opening within a turn, and any force of fingers within a factor of 10."""
    share = np.linspace(0.0, 1.0, 100)
    assert size_note("opening", low + range_rad * share, Joint()) == ""
    assert size_note("handle_force", newtons * share, Joint()) == ""


def test_two_sensors_in_one_column_are_named(tmp_path: Path) -> None:
    angle = np.where(np.arange(COUNT) % 2, ANGLE, ANGLE + 15.0)
    recording = read(tmp_path, (texts(TIME), texts(angle), texts(FORCE)))
    assert "goes to and fro by" in " ".join(recording.particular)


@pytest.mark.parametrize("lasting", [40, 420])
def test_a_force_that_stands_still_is_named(tmp_path: Path, lasting: int) -> None:
    force = texts(FORCE)
    force[450 : 450 + lasting] = [force[450]] * lasting
    said = told(read(tmp_path, (texts(TIME), texts(ANGLE), force)))
    assert f"from 2.25 to {2.245 + lasting / 200.0:.6g} s ({lasting} samples)" in said


@given(seed=st.integers(0, 2**32 - 1), step=st.sampled_from([1e-4, 0.005, 0.02, 0.05]))
@settings(max_examples=60)
def test_noise_of_any_step_does_not_stand_still(seed: int, step: float) -> None:
    rng = np.random.default_rng(seed)
    force = np.rint((2.0 - 0.8 * np.tanh(5.0 * SWING) + rng.normal(0.0, 0.02, COUNT)) / step) * step
    recording = recording_of(np.radians(ANGLE), force)
    assert channels_of(recording, ["handle_force"])[0].held is None


def recording_of(opening: Array, force: Array) -> Recording:
    samples = empty_samples(len(opening))
    samples["opening"], samples["handle_force"] = opening, force
    samples["device_time_us"] = np.rint(1e6 * TIME)
    return Recording("friction", samples)


def test_notes_of_one_log_are_those_that_not_all_have(tmp_path: Path) -> None:
    plain = read(tmp_path, (texts(TIME), texts(ANGLE), texts(FORCE)))
    assert plain.particular == ()
    turned = read(tmp_path, (texts(TIME), texts(np.mod(ANGLE - 30.0, 360.0)), texts(FORCE)))
    (note,) = turned.particular
    assert "begins again" in note
    assert note in turned.notes
