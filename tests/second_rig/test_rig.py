"""Mechanism, motor, sensors, labels and hand of the second rig, each where it can be seen."""

import ast
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tests.second_rig import (
    Interruption,
    Rig,
    Timeline,
    capture_cut,
    capture_friction,
    coarse,
    cotton,
    draw_truth,
    fine,
    pad,
    paper,
    recipe_for,
    run,
    true_parameters,
)
from tests.second_rig.simulate import BRAKE, HAND, OFF, SERVO

HERE = Path(__file__).parent
ALLOWED = {
    "aliases": {"Array"},
    "device": {"Plan", "advance_plan", "cut_plan", "friction_plan", "hand_travel"}
    | {"identity_facts"},
    "kernel": {"Capability", "Identity", "StateFlag"},
    "recipe": {"Recipe", "builtin_recipe"},
    "recording": {"SAMPLE_DTYPE", "Joint", "Kind", "Recording", "Stroke", "label_strokes"},
}
"""What asks any rig for strokes and what holds recordings: nothing that simulates or models."""


def there_and_back(rig: Rig, way: float = 0.2, seconds: float = 1.0) -> Timeline:
    """Close by ``way`` and open again at an even rate, without a sheet."""
    count = round(seconds / rig.tick_s)
    half = way * np.linspace(0.0, 1.0, count)
    opening = 0.6 - np.concatenate([np.zeros(200), half, half[::-1], np.zeros(200)])
    n = len(opening)
    return Timeline(
        opening=opening,
        rate=np.gradient(opening, rig.tick_s),
        advance=np.zeros(n),
        advance_rate=np.zeros(n),
        tremor=np.zeros(n),
        mode=np.full(n, SERVO, np.int32),
        stroke=np.full(n, -1, np.int32),
        sheet=np.full(n, -1, np.int32),
        gap_s=np.zeros(n),
    )


def test_it_shares_no_code_with_the_fitted_model() -> None:
    taken = set()
    for path in HERE.glob("*.py"):
        if path.name.startswith("test_"):
            continue
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Import):
                taken |= {(alias.name, "") for alias in node.names}
            elif isinstance(node, ast.ImportFrom) and not node.level:
                taken |= {(node.module or "", alias.name) for alias in node.names}
    allowed = {(f"scissorcal.{room}", name) for room in ALLOWED for name in ALLOWED[room]}
    assert {taking for taking in taken if taking[0].startswith("scissorcal")} <= allowed
    for path in [*HERE.glob("*.c"), *HERE.glob("*.h")]:
        assert "sc_" not in path.read_text(encoding="utf-8")


@pytest.mark.parametrize(("presliding_rad", "shape"), [(4e-6, 1.0), (2e-3, 1.0), (2e-3, 1.5)])
def test_friction_builds_up_over_its_length_after_a_reversal(
    presliding_rad: float, shape: float
) -> None:
    rig = fine()
    friction = replace(
        rig.mechanism.friction,
        presliding_rad=presliding_rad,
        presliding_shape=shape,
        stribeck_Nm=0.0,
        angle_slope_per_rad=0.0,
        angle_curvature_per_rad2=0.0,
        viscous_opening_Nm_s_per_rad=0.0,
        viscous_closing_Nm_s_per_rad=0.0,
    )
    rig = replace(rig, mechanism=replace(rig.mechanism, friction=friction))
    rows = run(rig, there_and_back(rig), np.random.default_rng(1)).rows
    turn = int(np.argmin(rows["opening"]))
    way = rows["opening"][turn + 1 : turn + 300] - rows["opening"][turn]
    force = rows["friction_torque"][turn + 1 : turn + 300]
    low, high = -friction.coulomb_closing_Nm, friction.coulomb_opening_Nm
    share = 1.0 - 2.0 * np.exp(-way / presliding_rad)
    if shape > 1.0:
        share = 1.0 - (2.0**-0.5 + 0.5 * way / presliding_rad) ** -2
    law = np.where(share > 0, high, -low) * share
    assert np.allclose(force[5:], law[5:], atol=2e-4)
    built = way[np.flatnonzero(force > 0.9 * high)[0]]
    expected = 3.0 if shape == 1.0 else 2.0 * (10.0**0.5 - 0.5**0.5)
    assert built == pytest.approx(expected * presliding_rad, rel=0.1, abs=2e-4)


@pytest.mark.parametrize("load_share", [0.0, 0.1])
def test_friction_grows_with_the_load_by_its_share(load_share: float) -> None:
    rig = fine(cotton())
    friction = replace(rig.mechanism.friction, load_share=load_share)
    rig = replace(rig, mechanism=replace(rig.mechanism, friction=friction))
    rows = capture_cut(rig, recipe_for(rig, sheets=1), np.random.default_rng(1))[1].rows
    sliding = (rows["rate"] < -0.02) & (rows["cut_torque"] > 0.05)
    away = rows["opening"][sliding] - friction.angle_center_rad
    factor = 1.0 + 0.15 * away + 0.1 * away**2
    rate = rows["rate"][sliding]
    empty = -0.0155 - 0.0035 * np.exp(-((rate / 0.07) ** 2)) + 0.0019 * rate
    more = -(rows["friction_torque"][sliding] - factor * empty)
    share = np.median(more / rows["cut_torque"][sliding])
    assert share == pytest.approx(load_share, abs=1e-3)


@pytest.mark.parametrize("counts", [4000, 20_000, 1_000_000])
def test_openings_are_whole_counts(counts: int) -> None:
    rig = fine()
    rig = replace(rig, sensors=replace(rig.sensors, counts_per_turn=counts))
    rows = run(rig, there_and_back(rig), np.random.default_rng(1)).rows
    steps = rows["measured_opening"] * counts / (2.0 * np.pi)
    assert np.allclose(steps, np.rint(steps), atol=1e-6)
    error = rows["measured_opening"] - rows["opening"]
    assert np.abs(error).max() <= np.pi / counts * (1 + 1e-9)
    assert np.abs(rows["opening"] - there_and_back(rig).opening).max() < 0.03


@pytest.mark.parametrize("delay_ticks", [0.0, 1.0, 1.5, 2.0])
def test_the_motor_gives_a_command_after_its_delay(delay_ticks: float) -> None:
    rig = fine()
    rig = replace(rig, motor=replace(rig.motor, delay_ticks=delay_ticks, lag_ticks=0.0))
    rows = run(rig, there_and_back(rig), np.random.default_rng(1)).rows
    late = int(np.ceil(delay_ticks - 1e-9)) + 1
    if delay_ticks % 1.0:
        late = int(delay_ticks) + 1  # the new command came in the middle of the tick
    assert np.array_equal(rows["motor_torque"][late:], rows["torque_command"][:-late])


def test_a_lag_follows_its_exponential_and_cogging_its_sine() -> None:
    rig = fine()
    rig = replace(rig, motor=replace(rig.motor, delay_ticks=0.0, lag_ticks=0.5, cogging_Nm=1e-3))
    rows = run(rig, there_and_back(rig), np.random.default_rng(1)).rows
    torque, keep = rows["motor_torque"], np.exp(-2.0)
    expected = rows["torque_command"][:-1] + keep * (torque[:-1] - rows["torque_command"][:-1])
    assert np.allclose(torque[1:], expected, atol=1e-12)
    motor = rig.motor
    phase = motor.cogging_periods_per_turn * rows["opening"] + motor.cogging_phase_rad
    energy = -1e-3 / motor.cogging_periods_per_turn * (np.cos(phase) - np.cos(phase[0]))
    assert np.allclose(rows["cogging_work"], energy, atol=1e-10)


@pytest.mark.parametrize(("delay_ticks", "lag_ticks"), [(0.0, 1.0), (1.1, 0.4), (0.25, 0.25)])
def test_a_held_torque_is_as_late_as_stated(delay_ticks: float, lag_ticks: float) -> None:
    rig = coarse()
    rig = replace(rig, motor=replace(rig.motor, delay_ticks=delay_ticks, lag_ticks=lag_ticks))
    rows = run(rig, there_and_back(rig), np.random.default_rng(1)).rows
    torque, way = rows["motor_torque"], np.diff(rows["opening"])
    more = np.diff(rows["motor_work"]) - (torque[:-1] + 0.5 * np.diff(torque)) * way
    column = np.diff(torque) * way
    late = (column @ more) / (column @ column) * rig.tick_s
    assert true_parameters(rig)["delay"] == pytest.approx(late, abs=3e-5)


def test_results_follow_from_the_seed() -> None:
    rig = coarse()
    recipe = recipe_for(rig, sheets=1, strokes_per_sheet=1)
    days = [capture_cut(rig, recipe, np.random.default_rng(seed))[0] for seed in (3, 3, 4)]
    assert np.array_equal(days[0].samples, days[1].samples)
    assert not np.array_equal(days[0].samples["motor_torque"], days[2].samples["motor_torque"])


def test_a_recording_is_what_the_sensors_see_of_the_books() -> None:
    rig = coarse()
    recipe = recipe_for(rig, sheets=2)
    recording, books = capture_cut(rig, recipe, np.random.default_rng(1))
    samples = recording.samples
    assert [s.kind for s in recording.strokes[:2]] == ["closing", "opening"]
    assert {s.sheet for s in recording.strokes} == {0, 1}
    assert np.array_equal(samples["stroke"], books.stroke)
    noise = samples["motor_torque"] - books.rows["motor_torque"]
    assert noise.std() == pytest.approx(np.hypot(7e-4, 5e-4), rel=0.05)
    assert np.mean(noise[10:] * noise[:-10]) == pytest.approx(2.5e-7 * np.exp(-10 / 15), rel=0.2)
    gaps = np.diff(recording.device_time_s)
    assert (gaps > 1.0).sum() == 1
    assert np.median(gaps) == pytest.approx(1e-3, rel=1e-6)
    assert books.sheet_fracture_energy == pytest.approx([0.52, 0.52], rel=0.03)


@pytest.mark.parametrize("rate_Hz", [500.0, 2000.0])
def test_other_sample_rates_cut_as_well(rate_Hz: float) -> None:
    rig = fine()
    rig = replace(rig, sensors=replace(rig.sensors, sample_rate_Hz=rate_Hz))
    recording, books = capture_cut(
        rig, recipe_for(rig, sheets=1, strokes_per_sheet=2), np.random.default_rng(1)
    )
    assert np.median(np.diff(recording.device_time_s)) == pytest.approx(1.0 / rate_Hz, rel=1e-4)
    assert np.nanmax(books.rows["crack"]) > 0.05


@pytest.mark.parametrize("brake", [False, True])
def test_an_interrupted_stroke_continues_with_its_index(brake: bool) -> None:
    rig = fine()
    recipe = recipe_for(rig, sheets=1)
    stops = (Interruption(0, 0.4, 0.2, brake), Interruption(4, 0.6, 0.1, brake))
    recording, books = capture_cut(rig, recipe, np.random.default_rng(1), interruptions=stops)
    for stop in stops:
        inside = np.flatnonzero(recording.samples["stroke"] == stop.stroke)
        breaks = np.flatnonzero(np.diff(inside) > 1)
        assert len(breaks) == 1
        first, last = inside[breaks[0]] + 1, inside[breaks[0] + 1]
        assert last - first == round(stop.seconds * 1e3)
        off = books.rows["motor_torque"][first + 5 : last]
        assert np.abs(off).max() < (0.05 if brake else 1e-3)
        assert abs(books.rows["opening"][last] - books.rows["opening"][first]) < 0.02
    assert {OFF, BRAKE, SERVO, HAND} == {0, 1, 2, 3}


def test_a_hand_cuts_with_the_motors_off() -> None:
    rig = fine()
    recipe = recipe_for(rig, sheets=2)
    recording, books = capture_cut(rig, recipe, np.random.default_rng(1), hand=True)
    rows = books.rows
    assert not rows["motor_torque"].any()
    kinds = [stroke.kind for stroke in recording.strokes if stroke.sheet >= 0]
    assert kinds.count("closing") == kinds.count("opening") == 8
    assert np.nanmax(rows["crack"]) > 0.1
    assert np.abs(rows["handle_force"]).max() < rig.hand.strength_N
    moving = np.abs(rows["rate"]) > 0.02
    drive = -rig.mechanism.handle_radius_m * rows["handle_force"]
    needed = (
        rig.mechanism.inertia_kg_m2 * np.gradient(rows["rate"], rig.tick_s)
        + rows["friction_torque"]
        + rig.mechanism.torque_offset_Nm
        - rows["cut_torque"]
    )
    cogging = rig.motor.cogging_Nm
    assert np.median(np.abs(drive - needed)[moving]) < 1e-3 + cogging
    noise = recording.drive_effort - drive
    assert np.std(noise) < 1.5e-3


def test_a_pad_is_pressed_and_not_cut() -> None:
    rig = fine(pad())
    recording, books = capture_cut(rig, recipe_for(rig), np.random.default_rng(1))
    assert {stroke.kind for stroke in recording.strokes} == {"press", "opening"}
    assert books.rows["fracture"][-1] == 0.0
    assert np.nanmax(books.rows["crack"]) == 0.0
    assert books.rows["cut_torque"].max() > 0.05
    assert "fracture_energy" not in true_parameters(rig)


def test_truth_is_drawn_and_expanded() -> None:
    rig = coarse()
    drawn = [draw_truth(rig, np.random.default_rng(seed)) for seed in range(200)]
    forces = np.array([one.material.force_N for one in drawn]) / rig.material.force_N
    assert 0.7 <= forces.min() < 0.73 < 1.27 < forces.max() <= 1.3
    assert len({one.mechanism.inertia_kg_m2 for one in drawn}) == 200
    there = true_parameters(rig, reference_indentation_m=1.5e-4, angle_center=0.6)
    assert there["response_force"] == pytest.approx(2.1 * 0.5**1.6)
    away = 0.6 - np.radians(30.0)
    assert there["coulomb_pos"] == pytest.approx(0.0135 * (1 + 0.15 * away + 0.1 * away**2))
    assert there["fracture_energy"] == 0.52
    two = true_parameters(fine(paper(law="two_slopes")), reference_indentation_m=4e-4)
    assert two["response_exponent"] == pytest.approx(2.0 * 4e-4 / (4e-4 + 2e-4))


def test_empty_sweeps_have_no_cutting_torque() -> None:
    rig = fine()
    recording, books = capture_friction(rig, recipe_for(rig), np.random.default_rng(1))
    assert recording.kind == "friction"
    assert recording.duration_s > 90.0
    assert not books.rows["cut_torque"].any()
    rms = np.sqrt(np.mean((books.rows["opening"] - books.rows["measured_opening"]) ** 2))
    assert rms == pytest.approx(2.0 * np.pi / 500_000 / np.sqrt(12.0), rel=0.05)
