"""Each part of the filter is needed: without it the filter fails its consistency check."""

import numpy as np
import pytest

from scissorcal.bench.control.objects import PLATES, plate_of
from scissorcal.bench.control.pose_study import pose_runs
from scissorcal.bench.control.traps import (
    BLACKOUT,
    FIXED_PLATE,
    FLIPS,
    MOVING_PLATE,
    settings_for,
    trap_runs,
    traps,
)
from scissorcal.bench.control.world import Scenario
from scissorcal.tracking.consistency import mean_band

RUNS = 16
SEEDS = range(880_000, 880_000 + RUNS)
TRAPPED = 12


@pytest.mark.slow
@pytest.mark.parametrize("trap", traps(), ids=lambda trap: trap.left_out)
def test_a_crippled_filter_fails_where_the_whole_one_passes(trap):
    """Mean NEES over 12 runs against the band that holds a consistent filter with 99.9 %.

    The whole filter's false alarms are 0.1 % a case, 0.8 % over all eight.
    """
    without, whole = trap_runs(trap, SEEDS[:TRAPPED])
    low, high = mean_band(TRAPPED, share=0.999)
    assert float(np.mean([run.nees for run in without])) > 1.2 * high
    assert low < float(np.mean([run.nees for run in whole])) < high


@pytest.mark.slow
@pytest.mark.parametrize("scenario", [FIXED_PLATE, MOVING_PLATE, BLACKOUT, FLIPS], ids=str)
def test_contact_brings_the_normal_down_and_the_filter_is_consistent(scenario: Scenario):
    """Medians of 16 runs scatter by some 30 %: the limits of 200 runs are taken times 1.5."""
    runs = pose_runs(
        scenario, plate_of("plane"), ("vision", "contact"), settings_for(scenario), SEEDS
    )
    low, high = mean_band(RUNS, share=0.999)
    for source in ("vision", "contact"):
        assert low < float(np.mean([run.nees for run in runs[source]])) < high
    limit = 0.35 if not scenario.moving else 0.2
    medians = {s: float(np.median([abs(run.normal_m) for run in runs[s]])) for s in runs}
    assert medians["contact"] < 1.5 * limit * medians["vision"]


@pytest.mark.parametrize("name", PLATES)
def test_a_plates_true_shape_lies_on_the_filters_surface(name: str):
    """Two independent codes for one shape; a probed face is off by its probes' noise."""
    plate = plate_of(name)
    times = np.linspace(0.0, 20.0, 200)
    points, normals = plate.shape(*plate.path(times, 0.3, 2.0))
    assert np.abs(plate.surface.level(points)).max() < (2e-5 if name == "spline" else 1e-15)
    gradients = plate.surface.gradient(points)
    gradients = gradients / np.linalg.norm(gradients, axis=1, keepdims=True)
    assert np.abs(gradients - normals).max() < (5e-3 if name == "spline" else 1e-12)
    if plate.probe is not None:
        distance, normal = plate.probe(points[7] + 1e-3 * normals[7])
        assert abs(distance - 1e-3) < 1e-15
        np.testing.assert_allclose(normal, normals[7], atol=1e-12)
