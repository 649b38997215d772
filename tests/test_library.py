"""The library surface: what `scissorcal` offers by name, and what each function opens."""

import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import scissorcal
from scissorcal.calibration import save
from scissorcal.errors import InputError, MissingError
from scissorcal.package import build_package
from scissorcal.recording import SAMPLE_DTYPE, Joint, Recording, Stroke, write_recording
from scissorcal.workday import create_workspace
from tests.package.fits import cut_fit, friction_fit, recipe

FUNCTIONS = ("open_workspace", "open_recording", "open_fit", "open_package")


@pytest.fixture(scope="module")
def package(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("library") / "paper.zip"
    chosen = recipe()
    build_package(chosen, friction_fit(), cut_fit(chosen), path, np.random.default_rng(3))
    return path


def sweep(joint: Joint) -> Recording:
    samples = np.zeros(1001, SAMPLE_DTYPE)
    samples["device_time_us"] = 1000 * np.arange(1001)
    samples["opening"] = np.linspace(0.2, 0.8, 1001)
    return Recording("friction", samples, (Stroke(0, "opening", 0.6),), joint)


def test_the_functions_are_listed_without_loading_numpy() -> None:
    code = (
        "import sys, scissorcal; names = dir(scissorcal);"
        "print('numpy' in sys.modules, [hasattr(scissorcal, n) for n in scissorcal.__all__]);"
        f"assert set({FUNCTIONS}) <= set(names), names"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.startswith("False")
    assert "False" not in done.stdout.partition("[")[2]


def test_a_name_that_is_not_offered_is_an_attribute_error() -> None:
    with pytest.raises(AttributeError, match="open_everything"):
        scissorcal.open_everything  # noqa: B018


@pytest.mark.parametrize("name", FUNCTIONS)
def test_a_missing_path_is_named(name: str, tmp_path: Path) -> None:
    with pytest.raises(MissingError, match="nothing-here"):
        getattr(scissorcal, name)(tmp_path / "nothing-here")


@pytest.mark.parametrize("name", FUNCTIONS[1:])
def test_a_file_of_another_format_is_refused(name: str, tmp_path: Path) -> None:
    path = tmp_path / "notes.txt"
    path.write_text("not a file of scissorcal")
    with pytest.raises(InputError, match=r"notes\.txt"):
        getattr(scissorcal, name)(path)


def test_a_workspace_is_found_from_a_folder_inside_it(tmp_path: Path) -> None:
    made = create_workspace(tmp_path / "paper", "paper-80gsm")
    (made.root / "captures").mkdir()
    found = scissorcal.open_workspace(str(made.root / "captures"))
    assert found == made
    assert repr(found) == f"<workspace {made.root}>"


@pytest.mark.parametrize(("kind", "column"), [("rotary", "opening_rad"), ("linear", "opening_m")])
def test_a_recording_becomes_a_table_with_units(kind: str, column: str, tmp_path: Path) -> None:
    pd = pytest.importorskip("pandas")
    path = tmp_path / "sweep.mcap"
    write_recording(sweep(Joint(kind)), path)  # type: ignore[arg-type]
    recording = scissorcal.open_recording(path)
    assert repr(recording) == (
        f"<friction recording: 1001 samples, 1.0 s, 1 strokes, {kind} joint, {path}>"
    )
    table = recording.to_pandas()
    assert isinstance(table, pd.DataFrame)
    assert table[column].to_numpy() == pytest.approx(recording.samples["opening"])
    assert table["time_s"].iloc[-1] == pytest.approx(1.0)


def test_without_pandas_a_sentence_says_what_to_do(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "pandas", None)
    with pytest.raises(InputError, match=r"pip install 'scissorcal\[analysis\]', or use recording"):
        sweep(Joint()).to_pandas()


def test_a_fit_is_described_in_one_line(tmp_path: Path) -> None:
    path = tmp_path / "cut.nc"
    save(cut_fit(recipe()), path)
    fit = scissorcal.open_fit(path)
    text = repr(fit)
    assert re.match(r"<\w* ?\w+[ ;]", text)
    assert "cut" in text
    assert "\n" not in text
    assert len(text) < 200


def test_a_package_is_described_in_one_line(package: Path) -> None:
    text = repr(scissorcal.open_package(package))
    assert "opening 12 to 50 deg" in text
    assert "contact 15 to 60 mm" in text
    assert "\n" not in text


def test_a_torque_inside_the_ranges_does_not_warn(package: Path) -> None:
    opened = scissorcal.open_package(str(package))
    assert opened.torque(opening=0.5, opening_rate=-0.2, contact=0.03) > 0
    edges = np.radians([12.0, 50.0])
    assert np.isfinite(opened.torque(edges, [-0.05, 1.0], [0.015, 0.06])).all()


@pytest.mark.parametrize(
    ("place", "by"),
    [
        ((np.radians(60.0), -0.2, 0.03), "opening 60 deg is 10 deg outside 12 to 50 deg"),
        ((0.5, -1.5, 0.03), "rate 1.5 rad/s is 0.5 rad/s outside 0.05 to 1 rad/s"),
        ((0.5, -0.2, 0.01), "contact 10 mm is 5 mm outside 15 to 60 mm"),
    ],
)
def test_a_torque_outside_the_ranges_warns_by_how_much(
    package: Path, place: tuple[float, float, float], by: str
) -> None:
    opened = scissorcal.open_package(package)
    with pytest.warns(scissorcal.OutsideCoverageWarning, match=by):
        opened.torque(*place)
    with pytest.warns(scissorcal.OutsideCoverageWarning, match=by):
        opened.band(*place)


def test_the_warning_counts_the_places_and_points_at_the_caller(package: Path) -> None:
    opened = scissorcal.open_package(package)
    with pytest.warns(scissorcal.OutsideCoverageWarning, match="2 of 3 places") as told:
        opened.torque(np.radians([20.0, 60.0, 5.0]), -0.2, 0.03)
    assert told[0].filename == __file__
