"""Cells of imported logs: constant, short, with gaps, with cells that are no numbers."""

import tempfile
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
from benchmarks.extremes.cells import Cell, Found, judged, refusal

from scissorcal.errors import ScissorcalError
from scissorcal.recording import import_table

COLUMNS = {"time": "t", "opening": "q", "motor_torque": "tau"}
REFUSED = "refused in a sentence"
READ = "read to 1e-6, with a note"


def cells() -> tuple[Cell, ...]:
    """The cells of imported logs."""
    rows: tuple[tuple[str, str, str, Callable[[int], str]], ...] = (
        ("log without rows", "0 rows", REFUSED, lambda k: ""),
        ("log of 1 row", "1 row", REFUSED, lambda k: _row(k) if k < 1 else ""),
        ("log of 2 rows", "2 rows", READ, lambda k: _row(k) if k < 2 else ""),
        ("log of a joint at rest", "constant opening", READ, lambda k: f"{1e-3 * k},0.5,0.01\n"),
        ("log with NaN", "a cell is NaN", REFUSED, lambda k: _row(k, "nan" if k == 50 else None)),
        ("log with infinity", "a cell is inf", REFUSED,
         lambda k: _row(k, "inf" if k == 50 else None)),
        ("log with 1e400", "a number beyond float64", REFUSED,
         lambda k: _row(k, "1e400" if k == 50 else None)),
        ("log with text", "a cell is text", REFUSED,
         lambda k: _row(k, "off" if k == 50 else None)),
        ("log with an empty cell", "a cell is empty", REFUSED,
         lambda k: _row(k, "" if k == 50 else None)),
        ("log with a time twice", "a time stamp twice", REFUSED, lambda k: _row(k - (k == 50))),
        ("log whose time jumps back", "time decreases", REFUSED,
         lambda k: _row(k - 40 * (k >= 50))),
        ("log with a gap of 1e6 s", "a step 1e9 times the usual", REFUSED,
         lambda k: _row(k + 10**9 * (k >= 50))),
        ("log whose time stands still", "all time stamps equal", REFUSED, lambda k: _row(0)),
        ("log over 1e12 s", "a step of 1e10 s", REFUSED, lambda k: _row(10**13 * k)),
        ("log in steps of 1e-9 s", "steps below the clock's 1 us", REFUSED,
         lambda k: f"{1e-9 * k:.12f},0.5,0.01\n"),
        ("log with values of 1e-300", "torques of 1e-300", READ,
         lambda k: _row(k, f"{1e-300 * (k + 1)}")),
    )  # fmt: skip
    return tuple(
        Cell(name, "signals", extreme, stated, "the table as written", _run(rows_of, stated))
        for name, extreme, stated, rows_of in rows
    )


def _row(index: int, torque: str | None = None) -> str:
    opening = 0.5 + 0.3 * np.sin(1e-2 * index)
    return f"{1e-3 * index:.6f},{opening:.9f},{0.01 if torque is None else torque}\n"


def _run(row: Callable[[int], str], stated: str) -> Callable[[np.random.Generator], Found]:
    def run(rng: np.random.Generator) -> Found:
        text = "".join(row(k) for k in range(100))
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "log.csv"
            path.write_text("t,q,tau\n" + text, encoding="utf-8")
            units = {"time": "s", "opening": "rad", "motor_torque": "N m"}
            try:
                recording = import_table(path, columns=COLUMNS, units=units)
            except ScissorcalError as error:
                found = refusal(error)
                return replace(found, sentence=found.sentence.replace(f"{folder}/", ""))
        if stated == REFUSED:
            return Found("wrong", f"read as {recording}")
        written = np.array([line.split(",") for line in text.splitlines()], dtype=np.float64)
        samples = recording.samples
        errors = [
            np.abs(recording.device_time_s - written[:, 0]).max(),
            np.abs(samples["opening"] - written[:, 1]).max(),
            np.abs(samples["motor_torque"] / written[:, 2] - 1.0).max(),
        ]
        if np.ptp(written[:, 1]) < 1e-3 and not any(
            "No stroke" in note for note in recording.notes
        ):
            return Found("wrong", "no note that nothing moves")
        return judged(float(max(errors)), 1e-6, "values", len(samples))

    return run
