"""The library's functions give what the commands give: fits of arrays, checks, packages."""

import json
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import scissorcal
from scissorcal.calibration import FitResult, VerifyResult
from scissorcal.errors import InputError
from scissorcal.package import open_package
from scissorcal.recording import Recording
from scissorcal.workday import Workspace, create_workspace
from tests.calibration.cut.test_predict import Straight
from tests.workday.made import fitted_copy, quick_workspace, record_cut, record_friction

ARGUMENTS = {
    "time_s": "time",
    "opening_rad": "opening",
    "torque_Nm": "motor_torque",
    "advance_m": "advance",
    "sheet": "sheet",
}


def command(folder: Path, *words: str) -> None:
    run = "from scissorcal.cli import main; main()"
    subprocess.run([sys.executable, "-c", run, *words], cwd=folder, check=True, capture_output=True)


@pytest.fixture
def here(tmp_path_factory: pytest.TempPathFactory, tmp_path: Path) -> Workspace:
    return fitted_copy(tmp_path_factory, tmp_path / "here", "friction", "cut")


@pytest.fixture
def there(tmp_path_factory: pytest.TempPathFactory, tmp_path: Path) -> Workspace:
    return fitted_copy(tmp_path_factory, tmp_path / "there", "friction", "cut")


def assert_equal(fit: FitResult, other: FitResult) -> None:
    """Everything that was computed; not what names the files."""
    assert fit.candidate == other.candidate
    assert [p.name for p in fit.parameters] == [p.name for p in other.parameters]
    assert np.array_equal(fit.draws, other.draws)
    assert np.array_equal(fit.map_point, other.map_point)
    assert fit.nuisance_draws is not None
    assert other.nuisance_draws is not None
    assert np.array_equal(fit.nuisance_draws, other.nuisance_draws)
    for field in ("measured", "predicted", "band_low", "band_high", "contact"):
        assert np.array_equal(
            getattr(fit.series, field), getattr(other.series, field), equal_nan=True
        ), field
    assert [(v.check, v.status) for v in fit.verdicts] == [
        (v.check, v.status) for v in other.verdicts
    ]


# --------------------------------------------------------------------------- captures, fits


@pytest.mark.slow
def test_a_workspaces_functions_do_what_the_commands_do(tmp_path: Path) -> None:
    here = create_workspace(tmp_path / "here", "paper-80gsm")
    there = create_workspace(tmp_path / "there", "paper-80gsm")
    captured = here.capture("friction", seed=3)
    assert here.recordings("friction") == (captured.path,)
    command(there.root, "capture", "friction", "--device", "sim", "--seed", "3", "--yes")
    recordings = [scissorcal.open_recording(w.recordings("friction")[0]) for w in (here, there)]
    for field in ("opening", "motor_torque", "device_time_us", "stroke"):
        assert np.array_equal(recordings[0].samples[field], recordings[1].samples[field])
    (outcome,) = here.fit("friction", effort="draft")
    command(there.root, "fit", "friction", "--effort", "draft")
    assert np.array_equal(outcome.result.draws, there.fits["friction"].draws)
    assert list(here.fits) == ["friction"]
    assert here.fit("friction", effort="draft")[0].cached
    alone = scissorcal.fit_friction(recordings[0], recipe=here.recipe(), effort="draft")
    assert np.array_equal(alone.draws, outcome.result.draws)
    assert here.report().fits == ("friction",)
    assert here.report_html.is_file()


@pytest.mark.slow
def test_fits_of_files_are_those_of_the_command(here: Workspace) -> None:
    """The cut's fit builds on the fit of friction, given as its file or as it is in memory."""
    (empty,), (cuts,) = here.recordings("friction"), here.recordings("cut")
    friction = scissorcal.fit_friction(empty, recipe=here.recipe_path, effort="draft")
    assert_equal(friction, here.fits["friction"])
    for known in (friction, here.fit_path("friction")):
        cut = scissorcal.fit_cut(cuts, here.recipe(), known, effort="draft")
        assert_equal(cut, here.fits["cut"])


@pytest.mark.slow
def test_a_cut_is_predicted_as_its_fit_expects_it(here: Workspace) -> None:
    """Over its own segments, within 1 % of the largest torque; the fit has a delay and an offset.

    Segments of a running crack have the contact at which it settles by the fit's best point.
    """
    cut, edge = here.fits["cut"], Straight()
    series = cut.series
    best = {p.name: value for p, value in zip(cut.parameters, cut.map_point, strict=True)}
    power = best["response_exponent"]
    assert "kappa" not in best, "its crack runs at one energy"
    force = best["fracture_energy"] / (2.0 * edge.slope(series.opening))
    depth = edge.reference * (force / best["response_force"]) ** (1.0 / power)
    settled = edge.contact_of(series.opening, edge.top - depth)
    runs = np.isclose(series.contact, settled, rtol=0.0, atol=1e-9)
    assert 0.5 < runs.mean() < 0.95
    assert np.ptp(depth[runs]) > 2e-5, "not the reference indentation everywhere"
    rests = {"contact": series.contact[~runs]}
    for places, where in ((runs, {}), (~runs, rests)):
        band = cut.predict(series.opening[places], series.opening_rate[places], **where)
        off = np.abs(band.torque - series.predicted[places])
        assert off.max() < 0.01 * series.predicted.max()


@pytest.mark.slow
def test_fits_of_arrays_are_those_of_the_command_from_the_same_table(tmp_path: Path) -> None:
    """The command reads a CSV file of the same numbers, and the handle's radius from the recipe."""
    workspace = quick_workspace(tmp_path / "there")
    recorded = quick_workspace(tmp_path / "recorded")
    radius_m = 1e-3 * workspace.recipe().rig.handle_radius_mm
    made: dict[str, Recording] = {}
    for kind, record in (("friction", record_friction), ("cut", record_cut)):
        samples = scissorcal.open_recording(record(recorded)).samples
        arrays: dict[str, Any] = {
            "time_s": 1e-6 * (samples["device_time_us"] - samples["device_time_us"][0]),
            "opening_rad": samples["opening"],
            "torque_Nm": samples["motor_torque"],
        }
        if kind == "cut":
            arrays["advance_m"] = samples["advance"]
            arrays["sheet"] = np.zeros(len(samples))  # a number alone is that of all samples
        rows = [",".join(map(repr, row)) for row in np.stack(list(arrays.values()), 1).tolist()]
        path = tmp_path / f"{kind}.csv"
        path.write_text("\n".join([",".join(arrays), *rows]) + "\n")
        columns = [word for name in arrays for word in ("-c", f"{ARGUMENTS[name]}={name}")]
        command(workspace.root, "import", str(path), "--kind", kind, *columns)
        if kind == "cut":
            arrays["sheet"] = 0
        made[kind] = Recording.from_arrays(**arrays, kind=kind, handle_radius_m=radius_m)
    command(workspace.root, "fit")
    recipe = workspace.recipe()
    friction = scissorcal.fit_friction(made["friction"], recipe=recipe, effort="draft")
    assert_equal(friction, workspace.fits["friction"])
    cut = scissorcal.fit_cut(made["cut"], recipe, friction, effort="draft")
    assert_equal(cut, workspace.fits["cut"])


# -------------------------------------------------------------------------- checks, packages


@pytest.mark.slow
def test_verify_writes_the_file_that_the_command_writes(here: Workspace, there: Workspace) -> None:
    outcomes = here.verify("friction", "cut", fits=2, seed=3, workers=1)
    options = ("--fits", "2", "--seed", "3", "--workers", "1")
    command(there.root, "verify", *options)
    for what, outcome in zip(("friction", "cut"), outcomes, strict=True):
        files = [w.root / "fits" / f"{what}.verify.json" for w in (here, there)]
        assert outcome.path == files[0]
        texts = [json.loads(file.read_text(encoding="utf-8")) for file in files]
        for text in texts:
            assert text["calibration"].pop("seconds") > 0.0
        assert texts[0] == texts[1]
        assert texts[0]["calibration"]["fits"] == 2


@pytest.mark.slow
def test_verify_fit_finds_what_the_workspace_finds(here: Workspace) -> None:
    """Also from files; all but what names the workspace's fit, and the time that it took."""
    outcomes = here.verify("friction", "cut", fits=2, seed=3, workers=1)
    (empty,), (cuts,) = here.recordings("friction"), here.recordings("cut")
    friction, cut = here.fit_path("friction"), here.fits["cut"]
    recipe = here.recipe()
    found = [
        scissorcal.verify_fit(friction, empty, recipe, fits=2, seed=3),
        scissorcal.verify_fit(cut, cuts, recipe, friction, fits=2, seed=3),
    ]
    for outcome, result in zip(outcomes, found, strict=True):
        assert as_in_a_workspace(result) == as_in_a_workspace(outcome.result)
    with pytest.raises(InputError, match="with its recipe and its fit of friction"):
        scissorcal.verify_fit(cut, cuts)


def as_in_a_workspace(result: VerifyResult) -> VerifyResult:
    assert result.calibration is not None
    timeless = replace(result.calibration, seconds=0.0)
    return replace(result, calibration=timeless, fit_content="")


@pytest.mark.slow
def test_build_package_writes_the_bytes_that_the_command_writes(
    here: Workspace, there: Workspace
) -> None:
    built = here.build_package(seed=5)
    command(there.root, "package", "build", "--seed", "5")
    path = there.package_path(there.recipe())
    assert built.path.read_bytes() == path.read_bytes()
    assert here.build_package(seed=5).cached
    opened, other = here.package(), open_package(path)
    assert opened.manifest == built.manifest == other.manifest
    place = ([0.3, 0.5], -0.2, 0.03)
    assert np.array_equal(opened.torque(*place), other.torque(*place))
    assert np.array_equal(opened.band(*place), other.band(*place))
