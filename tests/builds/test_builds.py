"""The pages of docs/build: their figures, their cost, and that the probe accepts each build."""

import dataclasses
import math
import re
from pathlib import Path

import numpy as np
import pytest
from benchmarks.drawings import build_wiring

from scissorcal.kernel import (
    Capability,
    Config,
    ConfigKey,
    FirmwareBoard,
    FirmwareCore,
    FirmwareInputs,
    FirmwarePhase,
    HomeResult,
    encode,
)

from .faults import FIRST, faults_of
from .page import FAULT_SEED, PAGES, block_of, compared, figures, probed_values
from .parts import BUILDS, COURSE, GIMBAL, LAB, Build
from .rig import probe_of

FIRMWARE = PAGES.parents[1] / "firmware" / "boards"
PAGE_OF = {**{name: f"{name}.md" for name in BUILDS}, GIMBAL.name: "not-working.md"}
BOARDS = {"course": "stm32f405", "lab": "b_g431b_esc1", "best": "teensy41"}
MOST_EUR = 200
TOLERANCE = 0.05
"""Of a figure in a page, for other versions of numpy and other processors."""
NUMBER = re.compile(r"[+-]?\d[\d.]*(?:e[+-]?\d+)?")


def page_of(build: Build) -> Path:
    return PAGES / PAGE_OF[build.name]


def rows_of(page: Path, mark: str) -> dict[str, list[str]]:
    """The rows of a table between marks, by their first cell."""
    rows = [line.strip("|").split("|") for line in block_of(page, mark).splitlines()]
    return {row[0].strip(): [cell.strip() for cell in row[1:]] for row in rows if len(row) > 1}


def words_of(sentence: str) -> str:
    """A sentence without its numbers."""
    return NUMBER.sub("#", sentence)


@pytest.mark.parametrize("build", [*BUILDS.values(), GIMBAL], ids=lambda build: build.name)
def test_figures_follow_from_the_parts(build: Build) -> None:
    assert block_of(page_of(build), "FIGURES") == figures(build)


def test_the_comparison_is_of_the_parts() -> None:
    assert block_of(PAGES / "index.md", "COMPARED") == compared()


def test_energy_of_a_dead_host_is_that_of_limit_and_inertia() -> None:
    text = (PAGES / "index.md").read_text(encoding="utf-8")
    for build in BUILDS.values():
        limit, inertia = build.torque_limit, build.inertia
        rate = limit * 10e-3 / inertia
        energy = 0.5e3 * inertia * rate**2
        row = f"| {build.name} | {limit:.3g} N m | {inertia:.2e} kg m^2 | {rate:.1f} rad/s "
        assert f"{row}| {energy:.0f} mJ |".replace("e-0", "e-") in text


def test_the_course_costs_no_more_than_it_may() -> None:
    text = (PAGES / "course.md").read_text(encoding="utf-8")
    table = text.partition("| part | EUR |")[2].partition("\n\n")[0]
    prices = [int(eur) for eur in re.findall(r"^\| [^*|]+ \| (\d+) \|$", table, re.MULTILINE)]
    (total,) = re.findall(r"\*\*(\d+)\*\*", table)
    assert len(prices) > 10
    assert sum(prices) == int(total) <= MOST_EUR


def board_of(build: Build) -> FirmwareBoard:
    """The example's table of the build's board, with the fields that its page states."""
    head = (FIRMWARE / f"{BOARDS[build.name]}_table.h").read_text(encoding="utf-8")
    fields = dict(re.findall(r"\.(\w+) = ([-\d.e]+)f?,", head))
    text = page_of(build).read_text(encoding="utf-8").partition("| field | value |")[2]
    for names, values in re.findall(r"^\| (`.*?`) \| ([^|]*) \|", text, re.MULTILINE):
        stated = re.findall(r"`(\w+)`", names)
        cells = values.split(", ")
        cells = cells if len(cells) == len(stated) else cells * len(stated)
        fields |= {name: cell for name, cell in zip(stated, cells, strict=True) if name in fields}
    known = {field.name for field in dataclasses.fields(FirmwareBoard)} - {"name", "serial"}
    whole = ("tick_us", "home_at_stop", "firmware_version")
    given = {
        name: int(cell) if name in whole else float(cell)
        for name, cell in fields.items()
        if name in known
    }
    capabilities = int(Capability.HOMES | Capability.TORQUE_MEASURED)
    return FirmwareBoard("page", "1", capabilities=capabilities, **given)  # type: ignore[arg-type]


@pytest.mark.parametrize("build", BUILDS.values(), ids=BUILDS)
def test_the_table_of_a_page_is_a_possible_board_of_its_parts(build: Build) -> None:
    board = board_of(build)
    FirmwareCore(board)
    step = 2.0 * math.pi / build.blades_counts
    assert 0.98 * build.torque_limit < board.torque_limit <= build.torque_limit
    assert board.opening_resolution == pytest.approx(step, rel=1e-6)
    assert board.tick_us == build.tick_us
    assert board.torque_per_A == pytest.approx(build.blades_torque_per_ampere, rel=1e-3)
    assert build.peak_A < board.current_limit <= build.sensor_range_A
    lightest = 0.8 * build.inertia
    assert board.home_torque / board.home_speed < lightest / (4e-6 * build.tick_us)


@pytest.mark.parametrize("build", BUILDS.values(), ids=BUILDS)
def test_the_table_of_the_first_power_on_is_a_possible_board(build: Build) -> None:
    board = board_of(build)
    tenths = {
        name: 0.1 * getattr(board, name)
        for name in ("torque_limit", "current_limit", "current_continuous")
    }
    text = (PAGES / "index.md").read_text(encoding="utf-8")
    (step,) = re.findall(r"^\| 5 \| .*$", text, re.MULTILINE)
    assert all(f"`{name}`" in step for name in tenths)
    home_torque = min(board.home_torque, tenths["torque_limit"])
    FirmwareCore(dataclasses.replace(board, **tenths, home_torque=home_torque))


def test_a_hand_finds_the_zero_where_the_motor_is_unplugged() -> None:
    """At rest for half a second, then by hand to the open stop: step 3 of the first power-on."""
    board = board_of(COURSE)
    core = FirmwareCore(board)
    way = board.opening_max - 0.5
    readings = [0.0] * 500 + [way * share for share in np.linspace(0.0, 1.0, 1500)] + [way] * 400
    received = encode(Config(int(ConfigKey.HOME), 1, 1.0))
    for tick, reading in enumerate(readings):
        inputs = FirmwareInputs(device_us=1000 * (tick + 1), opening=reading, supply=12.0)
        ended = core.tick(inputs, received)
        received = b""
    assert ended.home_result is HomeResult.FOUND
    assert ended.phase is FirmwarePhase.READY


@pytest.mark.parametrize(
    ("drawn", "board"),
    [
        (build_wiring.COURSE, BOARDS["course"]),
        (build_wiring.LAB, BOARDS["lab"]),
        (build_wiring.BEST, BOARDS["best"]),
    ],
)
def test_pins_in_the_wiring_are_those_of_the_board(drawn: build_wiring.Wiring, board: str) -> None:
    head = (FIRMWARE / f"{board}.c").read_text(encoding="utf-8").partition("*/")[0]
    lines = (drawn.to_driver, drawn.from_current, drawn.from_encoder, drawn.from_stop)
    pins = re.findall(r"\bP[A-C]\d+\b|\bA\d\b", " ".join((*lines, drawn.from_force)))
    assert pins
    assert not [pin for pin in pins if not re.search(rf"\b{pin}\b", head)]


@pytest.mark.parametrize(
    ("build", "seed"),
    [
        (COURSE, 101),
        *(
            pytest.param(build, seed, marks=pytest.mark.slow)
            for build in (*BUILDS.values(), GIMBAL)
            for seed in (102, 105)
        ),
    ],
    ids=lambda value: value.name if isinstance(value, Build) else str(value),
)
def test_the_probe_accepts_a_right_build_with_the_figures_of_its_page(
    build: Build, seed: int
) -> None:
    said = probe_of(build, seed)
    assert said.result is not None, said.refusal
    stated = rows_of(page_of(build), "PROBE")
    for name, value in probed_values(said).items():
        low, high = (float(cell) for cell in stated[name])
        assert low - TOLERANCE * abs(low) <= value <= high + TOLERANCE * abs(high), name


@pytest.mark.slow
@pytest.mark.parametrize("build", [COURSE, LAB, GIMBAL], ids=lambda build: build.name)
def test_each_fault_is_named_as_on_the_page(build: Build) -> None:
    """But for play, which some rigs hide and others do not."""
    stated = rows_of(page_of(build), "FAULTS")
    assert stated.keys() == {"what", "---", *faults_of(build)}
    for name, wrong in faults_of(build).items():
        if "loose" not in name:
            said = probe_of(build, FAULT_SEED, wrong)
            assert words_of(said.refusal) == words_of(stated[name][0]), name


@pytest.mark.slow
def test_the_first_steps_go_as_on_the_page() -> None:
    unplugged = probe_of(COURSE, FAULT_SEED, FIRST["motor unplugged"])
    assert "The blades did not move either way" in unplugged.refusal
    weak = probe_of(COURSE, FAULT_SEED, FIRST["a tenth of the limit"])
    assert weak.result is not None, weak.refusal
