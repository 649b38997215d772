"""Files whose fields have old names (rung, belief, believed) are read and compared whole."""

from dataclasses import fields, replace
from pathlib import Path

import pytest

from scissorcal.calibration import load
from scissorcal.calibration.edge.result import BladeResult
from scissorcal.calibration.result import FitResult, Result
from scissorcal.calibration.store import save
from scissorcal.calibration.verify.result import VerifyResult
from tests.calibration.results import difference
from tests.calibration.test_store import checked
from tests.report.fits import friction_fit
from tests.report.geometry_fits import blade_result

OLD_FILES = Path(__file__).parent / "old_files"


def short_friction_fit() -> FitResult:
    """Five draws and eight points of a fit, whose first parameter has a measured prior."""
    fit = friction_fit()
    points = {one.name: getattr(fit.series, one.name)[:8] for one in fields(fit.series)}
    first, *others = fit.parameters
    return replace(
        fit,
        draws=fit.draws[:5],
        series=replace(fit.series, **points),
        parameters=(replace(first, measured_prior=True), *others),
    )


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("friction.nc", short_friction_fit()),
        ("blade.nc", blade_result()),
        ("cut.verify.json", checked()),
    ],
)
def test_an_old_file_is_read_and_written_with_new_names(
    name: str, expected: Result, tmp_path: Path
) -> None:
    kind = type(expected)
    assert kind in (FitResult, BladeResult, VerifyResult)
    content = (OLD_FILES / name).read_bytes()
    assert b'"rung' in content
    assert difference(load(OLD_FILES / name, kind), expected) == ""
    save(expected, tmp_path / name)
    assert b'"rung' not in (tmp_path / name).read_bytes()
