"""Cracks at rest that scatter more than noise, encoder and friction explain fail a fit."""

from types import SimpleNamespace

import numpy as np
import pytest

from scissorcal.calibration.cut.checks import scatter_verdict
from scissorcal.recipe import CutPriors


@pytest.mark.parametrize(
    ("scale", "status"), [(0.6, "pass"), (1.7, "pass"), (2.0, "fail"), (3.4, "fail")]
)
def test_the_limit_is_three_sds_of_the_prior(scale: float, status: str) -> None:
    """A factor of 1.4 holds 90 %, so three sds are a factor of 1.85."""
    design = SimpleNamespace(
        layout=SimpleNamespace(natural=lambda point: {"noise_scale": scale}),
        likelihood=SimpleNamespace(segments=SimpleNamespace(steps=30.0)),
    )
    found = scatter_verdict(design, np.zeros(1), CutPriors().noise_scale)  # type: ignore[arg-type]
    assert found.status == status
    assert found.threshold == pytest.approx(1.85, abs=0.01)
    assert f"scatter {scale:.2g} times" in found.why
    assert ("30 steps of a loading" in found.why) == (status == "fail")
