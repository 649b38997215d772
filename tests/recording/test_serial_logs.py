"""Logs of a serial port, damaged in one way each: the right numbers, or a refusal."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from scissorcal.calibration import survey
from scissorcal.errors import InputError
from scissorcal.recording import ImportOptions, Joint, Recording, import_table, textfile
from scissorcal.recording.resolution import noise_of, stroke_threshold
from tests.recording.logs import imported

HEAD = "t_ms,angle_deg,force_g"
COLUMNS: dict[str, str | int] = {"time": 0, "opening": 1, "handle_force": 2}
COUNT, STROKES = 2000, 20
G_N_PER_KG = 9.80665

Lines = list[str]


def log(step_deg: float = 0.25, noise_deg: float = 0.0) -> Lines:
    """Ten closings and openings in 10 s at 200 Hz, by an encoder of ``step_deg``."""
    time = np.arange(COUNT) / 200.0
    angle = 30.0 + 25.0 * np.cos(2.0 * np.pi * time)
    angle += np.random.default_rng(3).normal(0.0, 1.0, COUNT) * noise_deg
    force = 200.0 - 80.0 * np.sin(2.0 * np.pi * time)
    rows = zip(1e3 * time, np.round(angle / step_deg) * step_deg, force, strict=True)
    return [HEAD, *(f"{t:.0f},{q:.4f},{f:.1f}" for t, q, f in rows)]


def read(path: Path, lines: Lines, end: str = "\n", **options: object) -> Recording:
    path.write_bytes("\n".join(lines).encode() + end.encode())
    chosen = {"columns": COLUMNS, "handle_radius_m": 0.06, **options}
    return imported(path, **chosen)


def garbled(lines: Lines) -> Lines:
    return [*lines[:700], "3495,4\x07?5,12", *lines[701:]]


def cut_through(lines: Lines) -> Lines:
    return [*lines[:-1], lines[-1][:-9]]


def booted(lines: Lines) -> Lines:
    return ["ets Jun  8 2016 00:22:57", "rst:0x1 (POWERON_RESET)", "HX711 ready\u00ff", *lines]


def reset(lines: Lines) -> Lines:
    return [*lines[:900], *lines]


def overflowed(lines: Lines) -> Lines:
    first = 2**32 - 2_000_000
    numbered = enumerate(lines[1:])
    rows = [f"{(first + 5000 * i) % 2**32},{line.split(',', 1)[1]}" for i, line in numbered]
    return ["t_us,angle_deg,force_g", *rows]


def decimal_commas(lines: Lines) -> Lines:
    return [line.replace(",", ";").replace(".", ",") for line in lines]


def replaced(lines: Lines, old: str, new: str) -> Lines:
    time, angle, force = lines[500].split(",")
    cells = {"time": time, "angle": angle, "force": force} | {old: new}
    return [*lines[:500], ",".join(cells.values()), *lines[501:]]


READS: dict[str, tuple[Callable[[Lines], Lines], str, int, str]] = {
    "nothing": (lambda lines: lines, "\n", 0, ""),
    "last line cut in a number": (
        lambda lines: lines,
        "",
        1,
        "Line 2001, the last one, has no end",
    ),
    "last line cut between cells": (cut_through, "", 1, "Line 2001, the last one, has 2 cells"),
    "last line short, with its end": (cut_through, "\n", 1, "has 2 cells where the others have 3"),
    "words of the start": (booted, "\n", 0, ""),
    "clock of 32 bits": (overflowed, "\n", 0, "The clock begins at 0 again at line 402"),
    "decimal commas": (decimal_commas, "\n", 0, ""),
    "blank lines": (lambda lines: [*lines[:50], "", " ", *lines[50:]], "\n", 0, ""),
    "mixed ends of lines": (
        lambda lines: [line + "\r" * (i % 2) for i, line in enumerate(lines)],
        "\n",
        0,
        "",
    ),
}

REFUSALS: dict[str, tuple[Callable[[Lines], Lines], str]] = {
    "a garbled line": (garbled, "line 701"),
    "a logger that began anew": (reset, "line 901"),
    "time that goes back": (lambda lines: replaced(lines, "time", "10"), "line 501"),
    "time that repeats": (lambda lines: replaced(lines, "time", "2490"), "line 501"),
    "lost lines": (lambda lines: [*lines[:600], *lines[640:]], "line 601"),
    "a word for overflow": (lambda lines: replaced(lines, "force", "ovf"), "line 501"),
    "not a number": (lambda lines: replaced(lines, "force", "nan"), "line 501"),
    "infinite": (lambda lines: replaced(lines, "angle", "inf"), "line 501"),
    "zero bytes": (lambda lines: [*lines, "\0\0\0"], "zero bytes"),
    "one column": (lambda lines: [line.split(",")[0] for line in lines], "column"),
    "no rows": (lambda lines: lines[:1], "no row of numbers"),
    "an endless line": (lambda lines: [*lines[:500], "9" * 100_000, *lines[501:]], "line 501"),
}


@pytest.mark.parametrize("damage", READS)
def test_a_log_is_read_with_what_it_tells(tmp_path: Path, damage: str) -> None:
    change, end, lost, said = READS[damage]
    found = read(tmp_path / "log.csv", change(log()), end)
    whole = read(tmp_path / "whole.csv", log())
    kept = COUNT - lost
    for channel in ("device_time_us", "opening", "handle_force"):
        np.testing.assert_allclose(found.samples[channel], whole.samples[channel][:kept])
    np.testing.assert_allclose(found.samples["handle_force"][0], 0.2 * G_N_PER_KG, rtol=1e-3)
    assert len(found.strokes) == STROKES
    assert any(said in note for note in found.notes), found.notes


@pytest.mark.parametrize("damage", REFUSALS)
def test_a_damaged_log_is_refused_with_the_place(tmp_path: Path, damage: str) -> None:
    change, place = REFUSALS[damage]
    with pytest.raises(InputError) as refused:
        read(tmp_path / "log.csv", change(log()))
    assert place in str(refused.value)
    assert str(tmp_path / "log.csv") in str(refused.value)
    assert len(str(refused.value)) < 1000


@pytest.mark.parametrize(("step_deg", "noise_deg"), [(0.25, 0.0), (0.25, 0.3), (5.0, 2.0)])
def test_neither_steps_nor_noise_of_the_sensor_make_strokes(
    tmp_path: Path, step_deg: float, noise_deg: float
) -> None:
    found = read(tmp_path / "log.csv", log(step_deg, noise_deg))
    assert len(found.strokes) == STROKES
    (note,) = [note for note in found.notes if "strokes were found" in note]
    assert note.startswith("10 closing and 10 opening strokes were found, of at least ")


def test_a_threshold_below_the_sensors_step_is_told_of(tmp_path: Path) -> None:
    found = read(tmp_path / "log.csv", log(1.0, 1.0), min_travel=0.005)
    assert len(found.strokes) > 5 * STROKES
    assert any("if these are no strokes of yours" in note for note in found.notes)


def test_what_decides_the_threshold_is_stated() -> None:
    fine = np.sin(np.arange(0.0, 20.0, 1e-3))
    assert stroke_threshold(fine, Joint()).reason == "5% of the range"
    coarse = stroke_threshold(np.round(fine / 0.2) * 0.2, Joint())
    assert (coarse.travel, coarse.reason) == (0.6, "3 steps of the sensor")
    noisy = fine + np.random.default_rng(1).normal(0.0, 0.05, len(fine))
    assert stroke_threshold(noisy, Joint()).travel == pytest.approx(0.5, rel=0.05)


@given(sd=st.floats(1e-6, 1e3), seed=st.integers(0, 2**32 - 1))
@example(sd=1.0, seed=335)
@settings(max_examples=30)
def test_noise_is_told_from_motion(sd: float, seed: int) -> None:
    """Six standard deviations of the estimate are allowed: 10^-8 of seeds pass them.

    It is the least of seven medians, of |differences| of orders 2 to 8. The median of n values
    with density f there and correlations r_j has the variance sum_j cov(|j|) / (n f^2), where
    cov is that of "below the median", summed over Hermite's orders of r_j = (-1)^j C(2k, k + j) /
    C(2k, k). For n = 4,000 that is 2.2 % of the value at order 2 and 2.92 % at order 8.
    """
    noise = np.random.default_rng(seed).normal(0.0, sd, 4000)
    slow = sd * np.sin(np.linspace(0.0, 20.0, 4000))
    assert noise_of(slow + noise) == pytest.approx(sd, rel=6 * 0.0292)


@pytest.mark.parametrize(("rate_Hz", "strokes_Hz"), [(10.0, 1.4), (20.0, 2.1), (250.0, 3.0)])
def test_fast_strokes_in_a_slow_log_are_no_noise(rate_Hz: float, strokes_Hz: float) -> None:
    angle = 0.44 * np.sin(2 * np.pi * strokes_Hz * np.arange(0.0, 30.0, 1.0 / rate_Hz))
    assert stroke_threshold(angle, Joint()).travel <= 0.25 * np.ptp(angle)


def test_noise_never_asks_for_more_than_a_quarter_of_the_range() -> None:
    noise = np.random.default_rng(4).normal(0.0, 0.1, 4000)
    angle = np.sin(np.arange(4000) * 0.01) + noise
    assert stroke_threshold(angle, Joint()).travel == pytest.approx(0.25 * np.ptp(angle), rel=1e-5)


@pytest.mark.parametrize("heading", ["force_gf", "force_g", "force [gf]"])
def test_a_heading_may_end_in_a_unit_of_force(tmp_path: Path, heading: str) -> None:
    path = tmp_path / "log.csv"
    rows = [f"{0.01 * i:.2f},{30 + 20 * np.cos(0.05 * i):.3f},100" for i in range(500)]
    path.write_text("\n".join([f"t_s,angle_deg,{heading}", *rows, ""]), encoding="utf-8")
    columns = {"time": "t_s", "opening": "angle_deg", "handle_force": heading}
    made = import_table(path, columns=columns, options=ImportOptions(handle_radius_m=0.06))
    assert made.samples["handle_force"][0] == pytest.approx(0.980665, rel=1e-6)


def test_decimal_commas_are_read_where_the_first_row_has_none(tmp_path: Path) -> None:
    path = tmp_path / "log.csv"
    rows = [f"{0.01 * i:.2f};{30 + 20 * np.cos(0.05 * i):.3f};1,5" for i in range(500)]
    text = "\n".join(["t_s;angle_deg;torque_Nm", "0;50;1", *rows[1:], ""]).replace(".", ",")
    path.write_text(text, encoding="utf-8")
    columns = {"time": "t_s", "opening": "angle_deg", "motor_torque": "torque_Nm"}
    made = import_table(path, columns=columns)
    assert list(made.samples["motor_torque"][:3]) == pytest.approx([1.0, 1.5, 1.5])


def test_a_file_of_more_lines_than_are_read_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(textfile, "MOST_LINES", 100)
    path = tmp_path / "log.csv"
    path.write_text("1\n" * 101, encoding="utf-8")
    with pytest.raises(InputError, match="has 101 lines, and 100 are read at most"):
        import_table(
            path, columns={"opening": 0}, rate_Hz=1.0, options=ImportOptions(motion_only=True)
        )


def test_the_survey_finds_steps_ends_and_gaps(tmp_path: Path) -> None:
    time = np.arange(4000) / 200.0
    rng = np.random.default_rng(0)
    angle = np.round((30.0 + 25.0 * np.cos(np.pi * time)) / 0.25) * 0.25
    force = np.minimum(2.0 + np.sin(np.pi * time) + rng.normal(0.0, 0.02, 4000), 2.5)
    rows = [f"{t:.4f},{q},{f:.5f}" for t, q, f in zip(time, angle, force, strict=True)]
    path = tmp_path / "log.csv"
    path.write_text("\n".join(["time_s,angle_deg,force_N", *rows[:900], *rows[905:], ""]))
    found = import_table(
        path,
        columns={"time": 0, "opening": 1, "handle_force": 2},
        options=ImportOptions(handle_radius_m=0.06, allow_gaps=True),
    )
    seen = survey(found, ("opening", "handle_force"))
    opening, handle = seen.sensors
    assert seen.rate_Hz == pytest.approx(200.0)
    assert (seen.gaps.places, seen.gaps.missing) == (1, 5)
    assert np.degrees(opening.step or 0.0) == pytest.approx(0.25)
    assert handle.high == 2.5
    assert handle.at_high == pytest.approx(np.mean(force == 2.5), abs=0.02)
    assert (handle.at_low, handle.dead) == (0.0, 0.0)


@pytest.mark.parametrize(
    ("unit", "newtons"),
    [
        ("g", 9.80665e-3),
        ("gf", 9.80665e-3),
        ("kg", 9.80665),
        ("kgf", 9.80665),
        ("N", 1.0),
        ("mN", 1e-3),
        ("lbf", 4.4482216152605),
    ],
)
def test_units_of_force(tmp_path: Path, unit: str, newtons: float) -> None:
    lines = ["t_ms,angle_deg,force", *log()[1:]]
    found = read(tmp_path / "log.csv", lines, units={"handle_force": unit})
    assert found.samples["handle_force"][0] == pytest.approx(200.0 * newtons)


def test_counts_need_a_scale(tmp_path: Path) -> None:
    lines = ["t_ms,angle,force_g", *log()[1:]]
    with pytest.raises(InputError, match="Give a scale for opening, in rad per counts"):
        read(tmp_path / "log.csv", lines, units={"opening": "counts"})
    found = read(
        tmp_path / "log.csv", lines, units={"opening": "counts"}, scale={"opening": "0.001"}
    )
    assert found.samples["opening"][0] == pytest.approx(0.055)
