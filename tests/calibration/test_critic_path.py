"""The critic's forward regression takes the terms that PySINDy's takes."""

import warnings

import numpy as np
import pytest

from scissorcal.calibration.critic import forward_path


@pytest.mark.parametrize("seed", range(10))
def test_it_is_frols(seed):
    with warnings.catch_warnings():
        # Its dependencies announce changes of their own that do not concern the search.
        warnings.simplefilter("ignore")
        from pysindy.optimizers import FROLS

        rng = np.random.default_rng(seed)
        design = rng.standard_normal((60, 12))
        design[:, 5] = design[:, 4] + 0.05 * rng.standard_normal(60)
        design /= np.sqrt(np.sum(design**2, axis=0))
        target = design[:, [2, 4, 9]] @ np.array([1.0, -0.6, 0.4]) + 0.02 * rng.standard_normal(60)
        search = FROLS(max_iter=3, alpha=0.0, unbias=False)
        search.fit(design, target[:, None])
    theirs = [tuple(np.flatnonzero(step[0]).tolist()) for step in search.history_]
    assert forward_path(design, target, 3) == [s for s in theirs if 0 < len(s) <= 3]


def test_columns_that_are_made_up_already_are_never_taken():
    design = np.eye(4)[:, :2]
    doubled = np.column_stack([design, design @ np.array([1.0, 1.0])])
    assert len(forward_path(doubled, np.array([3.0, 1.0, 0.0, 0.0]), 3)) == 2
