"""The cut of the second rig against closed forms, written here apart from its core."""

from dataclasses import replace
from typing import Literal

import numpy as np
import pytest
from numpy.typing import NDArray

from scissorcal.aliases import Array
from tests.second_rig import (
    Books,
    Rig,
    Timeline,
    capture_cut,
    coarse,
    fine,
    paper,
    recipe_for,
    run,
)
from tests.second_rig.simulate import SERVO, toughness_of
from tests.second_rig.truth import response


def lever_and_slope(rig: Rig, opening: Array, contact: Array) -> tuple[Array, Array, Array]:
    """Indentation, lever and slope of a straight edge over a contact: a line in the plane."""
    beta = opening / rig.moving_blades
    slope = np.tan(beta + rig.blades.taper_rad)
    offset = rig.blades.offset_m
    height = slope * contact + offset * (np.cos(beta) + np.sin(beta) * slope)
    return rig.upper_face_m - height, contact + height * slope, slope


def cut(rig: Rig, seed: int = 2) -> Books:
    return capture_cut(rig, recipe_for(rig, sheets=1), np.random.default_rng(seed))[1]


def steadily_running(crack: Array) -> NDArray[np.bool_]:
    moved = np.diff(crack, prepend=crack[0], append=crack[-1]) > 1e-8
    return np.asarray(moved[1:] & moved[:-1])


@pytest.mark.parametrize("moving", ["both", "upper"])
def test_smooth_torque_is_toughness_times_the_contacts_motion(
    moving: Literal["both", "upper"],
) -> None:
    rig = fine(paper(kappa=1.0, variation=0.0))
    rig = replace(rig, blades=replace(rig.blades, moving=moving))
    rows = cut(rig).rows
    running = steadily_running(rows["crack"])
    assert running.sum() > 5000
    opening, contact = rows["opening"][running], (rows["crack"] - rows["advance"])[running]
    depth, lever, slope = lever_and_slope(rig, opening, contact)
    assert np.allclose(rows["indentation"][running], depth, atol=1e-12)
    expected = 0.52 * lever / (rig.moving_blades * slope)
    torque = rows["cut_torque"][running]
    assert np.all(torque < expected * (1.0 + 1e-8))
    assert np.isclose(torque, expected, rtol=1e-8).mean() > 0.95  # else it rests within a tick
    step = 1e-6  # the contact's move per opening, at the same indentation
    moved = contact + step * lever / (rig.moving_blades * slope)
    assert np.allclose(lever_and_slope(rig, opening - step, moved)[0], depth, atol=1e-10)


@pytest.mark.parametrize("moving", ["both", "upper"])
def test_an_edge_through_the_pivot_has_the_published_torque(
    moving: Literal["both", "upper"],
) -> None:
    rig = fine(paper(kappa=1.0, variation=0.0, thickness_m=8e-3))
    rig = replace(rig, blades=replace(rig.blades, moving=moving, offset_m=0.0, taper_rad=0.0))
    opening = np.concatenate([np.full(200, 0.9), np.linspace(0.9, 0.25, 2000)])
    n = len(opening)
    timeline = Timeline(
        opening=opening,
        rate=np.gradient(opening, rig.tick_s),
        advance=np.full(n, -0.010),
        advance_rate=np.zeros(n),
        tremor=np.zeros(n),
        mode=np.full(n, SERVO, np.int32),
        stroke=np.zeros(n, np.int32),
        sheet=np.zeros(n, np.int32),
        gap_s=np.zeros(n),
    )
    rows = run(rig, timeline, np.random.default_rng(1)).rows
    running = steadily_running(rows["crack"])
    assert running.sum() > 1000
    theta, contact = rows["opening"][running], (rows["crack"] - rows["advance"])[running]
    sine = np.sin(theta) if moving == "both" else 0.5 * np.sin(2.0 * theta)
    right = np.isclose(rows["cut_torque"][running], 0.52 * contact / sine, rtol=1e-8)
    assert right.mean() > 0.95


def test_a_crack_starts_at_the_toughness_and_stops_at_kappa_times_it() -> None:
    rig = fine(paper(sheet_sd=0.03))
    books = cut(rig)
    jumps = books.jumps
    assert len(jumps) > 900
    grid = books.grid_m * np.arange(books.toughness.shape[1])
    ends = np.interp(jumps["end"], grid, books.toughness[0])
    assert np.allclose(jumps["toughness"], np.interp(jumps["start"], grid, books.toughness[0]))
    assert np.allclose(jumps["drive_after"], 0.75 * ends, atol=1e-8)
    depth, _, slope = lever_and_slope(rig, jumps["opening"], jumps["start"] - jumps["advance"])
    drive = 2.0 * response(rig, depth)[0] * slope
    assert np.allclose(drive, jumps["toughness"], atol=1e-7)
    assert np.all(jumps["end"] > jumps["start"])
    assert np.allclose(jumps["start"][1:], jumps["end"][:-1])


def test_teeth_have_the_period_and_the_mean_of_the_law() -> None:
    rig = fine(paper(variation=0.0))
    books = cut(rig)
    rows, jumps = books.rows, books.jumps
    n, kappa, energy = rig.material.exponent, rig.material.kappa, 0.52
    _, lever, slope = lever_and_slope(
        rig, jumps["opening"], 0.5 * (jumps["start"] + jumps["end"]) - jumps["advance"]
    )
    closing = np.diff(jumps["time"]) < 0.3
    period = -np.diff(jumps["opening"])[closing]
    critical = rig.material.reference_m * (energy / (2.0 * slope * rig.material.force_N)) ** (1 / n)
    grip = lever - critical * (1.0 + slope**2) / (n * slope)
    law = (2.0 * critical * (1.0 - kappa ** (1.0 / n)) / grip)[:-1][closing]
    inner = np.abs(period / law - 1.0) < 0.2  # sheets also yield with the sledge
    assert inner.mean() > 0.95
    assert np.median(period / law) == pytest.approx(1.0, abs=0.01)
    share = (1 - kappa ** ((n + 1) / n)) / ((n + 1) * (1 - kappa ** (1 / n)))
    steady = slice(40, 200)
    first, last = jumps["time"][steady][[0, -1]]
    inside = (rows_time := books.time_s) >= first
    inside &= rows_time <= last
    moved = rows["opening"][inside]
    middle = energy * lever[steady] / (2.0 * slope[steady])
    mean_law = share * np.trapezoid(middle, -jumps["opening"][steady])
    work = -np.diff(rows["cut_work"][inside][[0, -1]])[0]
    scale = (jumps["opening"][steady][0] - jumps["opening"][steady][-1]) / (moved[0] - moved[-1])
    assert work * scale == pytest.approx(mean_law, rel=0.01)


@pytest.mark.parametrize("kind", ["ou", "gaussian"])
def test_toughness_varies_as_stated(kind: str) -> None:
    sheet = paper(variation=0.05, correlation=kind, correlation_m=1e-3, sheet_sd=0.03)
    drawn = toughness_of(sheet, 400, np.random.default_rng(1)) / 0.52
    own = drawn.mean(axis=1, keepdims=True)
    unit = drawn / own - 1.0
    assert own.std() == pytest.approx(0.03, rel=0.15)
    assert unit.std() == pytest.approx(0.05, rel=0.03)
    at_length = np.mean(unit[:, 50:] * unit[:, :-50]) / unit.var()
    assert at_length == pytest.approx(np.exp(-1.0) if kind == "ou" else np.exp(-0.5), abs=0.03)


def test_a_bent_edge_bends_the_contact() -> None:
    straight, bent = fine(paper(variation=0.0)), fine(paper(variation=0.0))
    bent = replace(bent, blades=replace(bent.blades, curvature_per_m=0.35))
    deepest = [np.nanmax(cut(rig).rows["crack"]) for rig in (straight, bent)]
    assert deepest[1] < deepest[0] - 2e-3
    assert coarse().blades.curvature_per_m > 0.0
