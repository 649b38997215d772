"""Fits and recordings as a Python user has them: tables, draws, pictures, arrays, workspaces."""

import logging
import re
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import scissorcal
from scissorcal import examples
from scissorcal.calibration import FitResult, friction_curve
from scissorcal.errors import InputError, MissingError, UnknownNameError
from scissorcal.recording import Recording, import_table, write_recording
from scissorcal.workday import create_workspace
from tests.package.fits import cut_fit, friction_fit, recipe


@pytest.fixture(scope="module")
def fit() -> FitResult:
    return scissorcal.fit_friction(examples.load("friction"), effort="draft")


# ------------------------------------------------------------------------------------- summary


def test_the_summary_has_the_values_of_arviz(fit: FitResult) -> None:
    from tests.with_arviz import arviz

    fit = replace(fit, diagnostics={**fit.diagnostics, "effective_samples": np.inf})
    for row in fit.summary(probability=0.8):
        draws = fit.sample(row.name)
        assert row.hdi == pytest.approx(arviz.hdi(draws, hdi_prob=0.8), rel=1e-12)
        assert row.ess == pytest.approx(float(arviz.ess(draws[None, :])), rel=1e-9)
        if row.mean is not None:
            assert row.mean == pytest.approx(draws.mean(), rel=1e-12)
            assert row.sd == pytest.approx(draws.std(ddof=1), rel=1e-12)


@pytest.mark.parametrize("memory", [-0.6, 0.0, 0.5, 0.95])
def test_the_effective_size_of_a_chain_is_that_of_arviz(memory: float) -> None:
    from scissorcal.inference import bulk_ess
    from tests.with_arviz import arviz

    steps = np.random.default_rng(4).normal(size=(3, 1001))
    chains = np.zeros_like(steps)
    for place in range(1, steps.shape[1]):
        chains[:, place] = memory * chains[:, place - 1] + steps[:, place]
    assert bulk_ess(chains) == pytest.approx(float(arviz.ess(chains)), rel=1e-9)


def test_the_effective_size_is_no_larger_than_that_of_the_sampling(fit: FitResult) -> None:
    few = replace(fit, diagnostics={**fit.diagnostics, "effective_samples": 120.0})
    assert {row.ess for row in few.summary()} == {120.0}


def test_moments_are_left_out_where_tails_are_heavy(fit: FitResult) -> None:
    heavy = replace(fit["inertia"], sd=10.0 * fit["inertia"].sd)
    changed = replace(fit, parameters=(heavy, *fit.parameters[1:]))
    row = changed.summary()["inertia"]
    assert (row.mean, row.sd) == (None, None)
    assert row.median == fit["inertia"].q50
    assert "say something else: inertia." in str(changed.summary())


def test_the_table_is_text_and_html(fit: FitResult) -> None:
    lines = str(fit.summary()).splitlines()
    assert lines[0] == f"friction: {fit.candidate} (draft), {len(fit.draws)} draws"
    assert re.match(r"inertia +kg m\^2 +0\.00019", lines[2])
    assert fit._repr_html_().count("<tr") == len(fit.parameters) + 1
    assert "<td>kg m^2</td>" in fit._repr_html_()


def test_a_probability_that_is_none_is_refused(fit: FitResult) -> None:
    for wrong in (0.0, 1.0, 90):
        with pytest.raises(InputError, match="give one from 0 to 1"):
            fit.summary(wrong)
        with pytest.raises(InputError, match="give one from 0 to 1"):
            fit.predict(0.5, 0.3, probability=wrong)


# ------------------------------------------------------------------------- parameters and draws


def test_a_parameter_and_its_draws_are_those_of_the_fit(fit: FitResult) -> None:
    assert fit["inertia"] is fit.parameters[0]
    assert fit["inertia"].interval == (fit["inertia"].q05, fit["inertia"].q95)
    assert np.array_equal(fit.sample("coulomb_pos"), fit.column("coulomb_pos"))
    assert fit.nuisance_draws is not None
    assert np.array_equal(fit.sample(fit.nuisance[0].name), fit.nuisance_draws[:, 0])
    assert "inertia" in fit
    assert "kappa" not in fit


def test_a_datatree_holds_the_draws(fit: FitResult) -> None:
    pytest.importorskip("xarray")
    tree = fit.to_datatree()
    inertia = tree["posterior"]["inertia"]
    assert np.array_equal(inertia.to_numpy()[0], fit.sample("inertia"))
    assert inertia.attrs["unit"] == "kg m^2"


def test_without_xarray_a_sentence_says_what_to_do(
    fit: FitResult, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "xarray", None)
    with pytest.raises(InputError, match=r"pip install 'scissorcal\[analysis\]'"):
        fit.to_datatree()


# ---------------------------------------------------------------------------------- prediction


def test_a_prediction_is_the_friction_curve_with_its_band() -> None:
    fit = friction_fit(symmetric=False, draws=300)
    rates = np.array([-1.0, 1.0])
    fit = replace(fit, series=replace(fit.series, opening_rate=rates))
    curve = friction_curve(fit)
    assert curve is not None
    band = fit.predict(curve.opening, curve.rate)
    assert band.low == pytest.approx(curve.low, rel=1e-12)
    assert band.high == pytest.approx(curve.high, rel=1e-12)
    pushed = fit.predict(curve.opening, [0.3], acceleration=[2.0])
    still = fit.predict(curve.opening, [0.3])
    assert pushed.torque - still.torque == pytest.approx(2.0 * fit["inertia"].q50, rel=0.05)


def test_a_prediction_follows_what_was_measured(fit: FitResult) -> None:
    """Of the sweeps alone, where the acceleration is small: half a mN m of noise in 15."""
    series = fit.series
    swept = np.abs(series.measured) < np.inf
    swept &= series.stroke < 5
    band = fit.predict(series.opening[swept], series.opening_rate[swept])
    assert band.torque.shape == (np.count_nonzero(swept),)
    error = np.median(np.abs(band.torque - series.predicted[swept]))
    assert error < 0.02 * np.median(np.abs(series.measured[swept]))


def test_places_that_are_no_numbers_are_refused(fit: FitResult) -> None:
    with pytest.raises(InputError, match="not finite"):
        fit.predict([0.5, np.nan], 0.3)
    assert fit.predict([], 0.3).torque.shape == (0,)


# ------------------------------------------------------------------------------------- pictures


def test_pictures_show_data_and_model_with_units(fit: FitResult) -> None:
    matplotlib = pytest.importorskip("matplotlib")
    matplotlib.use("Agg")
    from matplotlib import pyplot

    curve, torque, left = fit.plot.friction_curve(), fit.plot.torque(), fit.plot.residuals()
    assert curve.get_xlabel() == "rate (rad/s)"
    assert torque.get_ylabel() == "torque (N m)"
    assert [text.get_text() for text in left.get_legend().get_texts()] == ["closing", "opening"]
    shown = np.asarray(torque.collections[0].get_offsets())
    assert set(shown[:, 1]) <= set(fit.series.measured)
    grid = fit.plot.pairs(["inertia", "coulomb_pos"])
    drawn = np.asarray(grid[1, 0].collections[0].get_offsets())
    assert np.array_equal(drawn[:, 0], fit.sample("inertia"))
    assert fit.plot.residuals(axes=left) is left
    pyplot.close("all")


def test_without_matplotlib_a_sentence_names_the_extra(
    fit: FitResult, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    with pytest.raises(InputError, match=r"pip install 'scissorcal\[plots\]'"):
        fit.plot.torque()


def test_a_cut_has_no_friction_curve() -> None:
    with pytest.raises(InputError, match="no friction curve"):
        cut_fit(recipe()).plot.friction_curve()


# ----------------------------------------------------------------------------------- typing slips


@pytest.mark.parametrize(
    ("call", "nearest"),
    [
        (lambda fit: fit["inertai"], "inertia"),
        (lambda fit: fit.sample("columb_pos"), "coulomb_pos"),
        (lambda fit: fit.summary()["inertai"], "inertia"),
        (lambda fit: fit.plot.pairs(["inertai"]), "inertia"),
        (lambda _: scissorcal.fit_friction("a.mcap", effort="standrad"), "standard"),
        (lambda _: scissorcal.fit_cut("a", "paper-80gsm", "b", effort="drafty"), "draft"),
        (lambda _: scissorcal.fit_friction(examples.load("friction"), recipe="paper-80gms"), "pap"),
        (lambda _: examples.load("fricton"), "friction"),
        (lambda _: Recording.from_arrays(time_s=[0, 1], torqe_Nm=[0, 1]), "torque_Nm"),
    ],
)
def test_a_wrong_name_is_refused_with_the_nearest(call, nearest: str, fit: FitResult) -> None:
    with pytest.raises(InputError, match=f'Did you mean "{nearest}'):
        call(fit)


def test_a_wrong_name_of_a_workspace_is_refused_with_the_nearest(tmp_path: Path) -> None:
    workspace = create_workspace(tmp_path / "day", "paper-80gsm")
    for call in (
        lambda: workspace.recordings("fricton"),  # type: ignore[arg-type]
        lambda: workspace.fits["fricton"],
        lambda: workspace.fit("fricton"),
        lambda: workspace.verify("fricton"),  # type: ignore[arg-type]
        lambda: workspace.capture("fricton"),  # type: ignore[arg-type]
    ):
        with pytest.raises(UnknownNameError, match='Did you mean "friction"'):
            call()
    with pytest.raises(UnknownNameError, match=r'"fast" is no effort of a fit\. There are: draft'):
        workspace.fit("friction", effort="fast")  # type: ignore[arg-type]
    with pytest.raises(UnknownNameError, match='Did you mean "hand"'):
        workspace.capture("cut", hnd=True)
    with pytest.raises(MissingError, match="scissorcal"):
        workspace.package()
    with pytest.raises(MissingError, match="capture friction"):
        workspace.fits["friction"]
    assert list(workspace.fits) == []
    with pytest.raises(KeyError):
        workspace.fits["fricton"]


def test_data_of_others_are_named_with_their_source() -> None:
    with pytest.raises(InputError, match=r"nonlinearbenchmark\.org"):
        examples.load("emps")


# ---------------------------------------------------------------------------- recordings of arrays


def test_arrays_are_read_as_the_file_that_holds_them(tmp_path: Path, fit: FitResult) -> None:
    arrays = examples.arrays("friction")
    path = tmp_path / "log.csv"
    table = np.stack(list(arrays.values()), axis=1)
    lines = [",".join(map(repr, row)) for row in table.tolist()]
    path.write_text("\n".join(["time_s,opening_rad,torque_Nm", *lines]) + "\n")
    columns = {"time": "time_s", "opening": "opening_rad", "motor_torque": "torque_Nm"}
    read = import_table(path, columns=columns)
    made = Recording.from_arrays(**arrays)
    assert np.array_equal(read.samples, made.samples)
    assert read.strokes == made.strokes
    of_file = scissorcal.fit_friction(read, effort="draft")
    assert np.array_equal(of_file.draws, fit.draws), "a fit of arrays is that of the file"
    stored = tmp_path / "friction.mcap"
    write_recording(made, stored)
    several = scissorcal.fit_friction([str(stored)], effort="draft", seed=0)
    assert np.array_equal(several.draws, fit.draws)
    other = scissorcal.fit_friction(made, effort="draft", seed=1)
    assert not np.array_equal(other.draws, fit.draws)


def test_a_table_becomes_the_recording_it_was_made_of() -> None:
    pytest.importorskip("pandas")
    made = examples.load("friction")
    again = Recording.from_pandas(made.to_pandas())
    assert np.array_equal(again.samples, made.samples)
    assert again.strokes == made.strokes
    cut = Recording.from_pandas(made.to_pandas().assign(sheet=1), kind="cut")
    assert {stroke.sheet for stroke in cut.strokes} == {1}
    table = made.to_pandas()[["time_s", "motor_torque_Nm"]].assign(
        angle=np.degrees(made.samples["opening"])
    )
    named = {"time": "time_s", "opening": "angle [deg]", "motor_torque": "motor_torque_Nm"}
    turned = Recording.from_pandas(table.rename(columns={"angle": "angle [deg]"}), named)
    assert turned.samples["opening"] == pytest.approx(made.samples["opening"], rel=1e-12)


@pytest.mark.parametrize(
    ("changes", "sentence"),
    [
        ({"torque_Nm": [1.0]}, r"torque_Nm has shape \(1,\)"),
        ({"torque_Nm": [0.0, 1.0, np.nan, 0.0]}, "torque_Nm is nan in row 3"),
        ({"time_s": [0.0, 1.0, 1.0, 2.0]}, "the time 1 s is repeated"),
        ({"time_s": [[0.0, 1.0]]}, "one dimension"),
        ({"torque_Nm": None}, "No torque is given"),
        ({"opening_rad": None}, "give opening_rad or opening_m"),
        ({"opening_m": [0.0, 1.0, 2.0, 3.0]}, "give one of them"),
        ({"torque_Nm": None, "force_N": [0.0] * 4}, "not measured at a rotary joint"),
        ({"kind": "cutt"}, 'Did you mean "cut"'),
        ({"sheet": 0.5}, "0.5 counts no sheet"),
        ({"sheet": [0, 1]}, r"sheet has shape \(2,\)"),
    ],
)
def test_arrays_that_are_no_motion_are_refused(changes: dict, sentence: str) -> None:
    arrays = {
        "time_s": [0.0, 1.0, 2.0, 3.0],
        "opening_rad": [0.0, 0.5, 0.2, 0.6],
        "torque_Nm": [0.01, -0.01, 0.01, 0.0],
    }
    with pytest.raises(InputError, match=sentence):
        Recording.from_arrays(**{**arrays, **changes})


def test_a_recording_of_another_kind_is_refused() -> None:
    with pytest.raises(InputError, match="is of friction, not of cut"):
        scissorcal.fit_cut(examples.load("friction"), "paper-80gsm", "friction.nc")
    with pytest.raises(InputError, match="no recording to fit"):
        scissorcal.fit_friction([])


def test_what_verify_fit_does_not_check_is_refused_with_what_to_do(fit: FitResult) -> None:
    empty = examples.load("friction")
    carriage = replace(fit, what="friction-advance")
    with pytest.raises(InputError, match="verify friction --axis advance"):
        scissorcal.verify_fit(carriage, empty)
    with pytest.raises(InputError, match="fits=0 simulates nothing: give 20"):
        scissorcal.verify_fit(fit, empty, fits=0)
    samples = empty.samples.copy()
    samples["motor_torque"] *= 1.5
    with pytest.raises(InputError, match="was not made of these recordings"):
        scissorcal.verify_fit(fit, replace(empty, samples=samples))


def test_progress_and_the_log_are_told_the_stages(caplog: pytest.LogCaptureFixture) -> None:
    told: list[tuple[float, str]] = []
    with caplog.at_level(logging.INFO, logger="scissorcal"):
        scissorcal.fit_friction(
            examples.load("friction"),
            effort="draft",
            progress=lambda done, sentence: told.append((done, sentence)),
        )
    assert all(0.0 <= done <= 1.0 for done, _ in told)
    assert caplog.messages[0] == told[0][1]
    assert {record.name for record in caplog.records} == {"scissorcal"}
