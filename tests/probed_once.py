"""Commands that probe a virtual rig first get what one probe of it found, made once in a run."""

from hashlib import sha256

import numpy as np
import pytest

from scissorcal.device import LockstepLink, RigSession
from scissorcal.recording import ProbeResult
from scissorcal.workday import Workspace
from scissorcal.workday.runs import probe
from tests.made_once import made_once

SEED = 0


@pytest.fixture(autouse=True)
def probed_once(
    request: pytest.FixtureRequest,
    tmp_path_factory: pytest.TempPathFactory,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Probe each virtual rig once in a run; a test marked ``probes`` probes by itself."""
    real = probe.probe_into

    def kept(workspace: Workspace, session: RigSession, then: str = "") -> ProbeResult:
        link, recipe = session.link, session.recipe
        if type(link) is not LockstepLink or recipe.specimen is None:
            return real(workspace, session, then)
        own = LockstepLink(recipe.specimen, np.random.default_rng(SEED))
        if own.identity != link.identity:
            return real(workspace, session, then)
        told = f"{recipe.specimen} {recipe.rig.model_dump_json()}"
        key = sha256(told.encode()).hexdigest()[:16]
        folder = made_once(
            tmp_path_factory,
            f"probe {key}",
            lambda made: real(Workspace(made), RigSession(own, recipe)),
        )
        found = probe.last_probe(Workspace(folder))
        assert found is not None
        probe._store(workspace, found)
        return found

    if request.node.get_closest_marker("probes") is None:
        monkeypatch.setattr(probe, "probe_into", kept)
