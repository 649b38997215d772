"""The store: every result comes back, equal results give equal bytes, damage is one sentence."""

import json
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from scissorcal.calibration import load, load_fit, read_header, save
from scissorcal.calibration.camera.result import CameraFit
from scissorcal.calibration.plate.result import PlateFit
from scissorcal.calibration.result import FitResult, Result
from scissorcal.calibration.store import EARLIER
from scissorcal.calibration.verify.result import FORMAT, VerifyResult
from scissorcal.errors import InputError
from scissorcal.verdicts import Verdict
from scissorcal.vision import Pose
from tests.calibration.results import difference, results

RESULTS = results()


@pytest.fixture(params=RESULTS)
def result(request: pytest.FixtureRequest) -> Result:
    return RESULTS[request.param]


def test_a_result_equals_the_one_that_is_loaded(result: Result, tmp_path: Path) -> None:
    path = tmp_path / "fits" / f"{result.what}.nc"
    save(result, path)
    assert difference(load(path, type(result)), result) == ""
    assert [file.name for file in path.parent.iterdir()] == [path.name]


def test_the_header_has_what_a_plan_asks_for(tmp_path: Path) -> None:
    fit = RESULTS["friction"]
    bad = Verdict("fit.friction", "k-hat", "fail", 0.9, 0.7, "The weights are too heavy.")
    save(replace(fit, verdicts=(bad,)), tmp_path / "friction.nc")  # type: ignore[type-var]
    header = read_header(tmp_path / "friction.nc")
    assert (header.what, header.effort, header.model) == ("friction", "standard", fit.model)
    assert (header.inputs_hash, header.failed) == (fit.inputs_hash, ("k-hat",))
    save(RESULTS["imported camera"], tmp_path / "camera.nc")
    assert read_header(tmp_path / "camera.nc").origin == "imported"


def test_equal_results_give_equal_bytes_in_another_process(tmp_path: Path) -> None:
    script = (
        "import sys; from pathlib import Path; from tests.calibration.results import results;"
        "from scissorcal.calibration import save;"
        "[save(one, Path(sys.argv[1]) / f'{name}.nc') for name, one in results().items()]"
    )
    command = [sys.executable, "-c", script, str(tmp_path / "other")]
    subprocess.run(command, cwd=Path(__file__).parents[2], check=True)
    for name, one in RESULTS.items():
        here, again = tmp_path / f"{name}.nc", tmp_path / "again.nc"
        save(one, here)
        save(load(here, type(one)), again)
        assert here.read_bytes() == again.read_bytes()
        assert here.read_bytes() == (tmp_path / "other" / here.name).read_bytes()


def test_a_repr_is_one_short_line(result: Result) -> None:
    assert repr(result).startswith(f"<{type(result).__name__} {result.what}")
    assert len(repr(result)) < 120


def test_h5py_alone_reads_a_file(tmp_path: Path) -> None:
    """As docs/files.md says: groups and variables by name, the rest as JSON."""
    fit = RESULTS["cut"]
    assert isinstance(fit, FitResult)
    save(fit, tmp_path / "cut.nc")
    with h5py.File(tmp_path / "cut.nc") as file:
        draws = {name: v[0] for name, v in file["posterior"].items() if v.ndim == 2}
        assert list(draws) == [parameter.name for parameter in fit.parameters]
        np.testing.assert_array_equal(np.stack(list(draws.values()), axis=1), fit.draws)
        assert file["posterior/kappa"].attrs["unit"] == "1"
        np.testing.assert_array_equal(file["observed_data/torque"][:], fit.series.measured)
        assert file["posterior_predictive/torque"].shape == (1, 4, len(fit.series.measured))
        facts = json.loads(file.attrs["scissorcal"])
        assert facts["candidate"] == fit.candidate
        assert facts["draws"]["variables"][0] == "/posterior/" + fit.parameters[0].name
        assert json.loads(file.attrs["header"])["inputs_hash"] == fit.inputs_hash


def test_a_plates_file_has_euler_angles_and_is_read_without_them(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    fit = RESULTS["plate"]
    assert isinstance(fit, PlateFit)
    path = tmp_path / "plate.nc"
    save(fit, path)
    with h5py.File(path) as file:
        written = json.loads(file.attrs["scissorcal"])
    for name in ("camera_plate", "rig_plate"):
        angles = written[name]["euler_angles"]
        assert angles["pitch_deg"] == getattr(fit, name).euler_angles.pitch_deg
        assert angles["convention"].startswith("intrinsic z-y'-x''")
    monkeypatch.setattr(Pose, "also_written", ())
    save(fit, path)
    with h5py.File(path) as file:
        assert "euler_angles" not in json.loads(file.attrs["scissorcal"])["rig_plate"]
    monkeypatch.undo()
    assert difference(load(path, PlateFit), fit) == ""


def test_xarray_reads_the_groups_of_a_blade_with_their_coordinates(tmp_path: Path) -> None:
    xarray = pytest.importorskip("xarray")
    save(RESULTS["blade"], tmp_path / "blade.nc")
    with xarray.open_datatree(tmp_path / "blade.nc", engine="h5netcdf") as tree:
        offset = tree["blades/0/offset"]
        assert offset["mean"].dims == ("station",)
        np.testing.assert_array_equal(offset["station"], RESULTS["blade"].blades[0].station)  # type: ignore[attr-defined]
        assert tree["blades/0/height/mean"].dims == ("opening", "contact")


@pytest.fixture(scope="module")
def stored(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path: Path = tmp_path_factory.mktemp("stored") / "plate.nc"
    save(RESULTS["plate"], path)
    return path


def refused(path: Path, kind: type[Any], why: str, remedy: str) -> None:
    for read in (lambda: load(path, kind), lambda: read_header(path)):
        with pytest.raises(InputError) as error:
            read()
        said = str(error.value)
        assert said.startswith(str(path))
        assert why in said
        assert "\n" not in said
    with pytest.raises(InputError, match=remedy):
        load(path, kind)


@settings(max_examples=60)
@given(place=st.floats(0.0, 1.0, exclude_max=True), flip=st.integers(1, 255), cut=st.booleans())
def test_a_flipped_or_missing_byte_is_refused(
    stored: Path, place: float, flip: int, cut: bool
) -> None:
    content = bytearray(stored.read_bytes())
    index = int(place * len(content))
    if cut:
        del content[index:]
    else:
        content[index] ^= flip
    path = stored.with_name("damaged.nc")
    path.write_bytes(content)
    why = "or it is damaged" if content else "is empty"
    refused(path, PlateFit, why, "run 'scissorcal fit plate' again")


@pytest.mark.parametrize("content", [b"", b"{}", b"[1, 2", b"not a fit", b"\x89HDF\r\n\x1a\n"])
def test_a_file_of_another_format_is_refused(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "camera.nc"
    path.write_bytes(content)
    why = "is not a" if content else "is empty"
    refused(path, CameraFit, why, "run 'scissorcal fit camera' again")


def test_a_result_of_another_kind_is_refused(stored: Path) -> None:
    with pytest.raises(InputError, match=r"plate.nc is a plate fit, not a camera fit\."):
        load(stored, CameraFit)


@pytest.mark.parametrize("version", EARLIER)
def test_a_fit_of_an_earlier_version_is_refused_with_the_remedy(
    tmp_path: Path, version: str
) -> None:
    path = tmp_path / "friction.nc"
    with h5py.File(path, "w") as file:
        file.create_group("posterior").attrs["format"] = version
    with pytest.raises(InputError, match=r"earlier version .*: remove it and run 'scissorcal fit'"):
        load_fit(path)


def test_a_missing_file_is_named(tmp_path: Path) -> None:
    refused(tmp_path / "none.nc", FitResult, "No such file", "scissorcal fit")


def checked() -> VerifyResult:
    verdict = Verdict("verify.cut", "halves", "pass", 0.4, 0.01, "Halves agree.")
    return VerifyResult(
        format=FORMAT,
        what="cut",
        fit_hash="abc",
        candidate="power",
        effort="draft",
        seed=1,
        calibration=None,
        halves=None,
        sensitivity=None,
        not_done=("No strokes.",),
        false_alarm=0.01,
        verdicts=(verdict,),
    )


def test_a_trust_check_is_plain_json(tmp_path: Path) -> None:
    path = tmp_path / "cut.verify.json"
    save(checked(), path)
    assert json.loads(path.read_text())["fit_hash"] == "abc"
    assert load(path, VerifyResult) == checked()


@pytest.mark.parametrize(
    "change", [{"format": "scissorcal-verify/9"}, {"seed": "one"}, {"extra": 1}, {"verdicts": None}]
)
def test_a_trust_check_of_wrong_types_is_refused(tmp_path: Path, change: dict[str, Any]) -> None:
    path = tmp_path / "cut.verify.json"
    save(checked(), path)
    path.write_text(json.dumps({**json.loads(path.read_text()), **change}))
    with pytest.raises(InputError, match=r"is not a verification .* run 'scissorcal verify' again"):
        load(path, VerifyResult)
