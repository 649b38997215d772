"""What --device sim opens: a virtual rig in virtual time, or served as a port."""

from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np
import pytest

from scissorcal.device import LockstepLink, PortLink
from scissorcal.errors import InputError
from scissorcal.kernel import ConfigKey
from scissorcal.workday.rigs import open_rig
from tests.device.in_step import InStepRig, in_step, patient


def first_states(run: int) -> list[bytes]:
    with open_rig("sim", "office-paper", seed=4, run=run) as link:
        assert isinstance(link, LockstepLink)
        link.configure(ConfigKey.STREAM, 1.0)
        return [payload for _ in range(50) for payload in link.exchange(None)]


def test_a_virtual_rig_runs_in_virtual_time_and_repeats_itself_by_seed_and_run() -> None:
    assert first_states(run=0) == first_states(run=0)
    assert first_states(run=0) != first_states(run=1)


def test_in_real_time_it_is_a_port_of_its_specimen_and_seed(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    patient(monkeypatch)
    served: list[tuple[str, int]] = []

    @contextmanager
    def serve(specimen: str, seed: int) -> Iterator[InStepRig]:
        served.append((specimen, seed))
        with in_step(specimen, seed) as rig:
            yield rig

    monkeypatch.setattr("scissorcal.device.sim.process.SimProcess", serve)
    with open_rig("sim", "office-paper", seed=4, realtime=True) as link:
        assert isinstance(link, PortLink)
        assert link.identity.serial == "office-paper"
    assert served == [("office-paper", 4)]


@pytest.mark.realtime
def test_in_real_time_it_is_a_port() -> None:
    with open_rig("sim", "office-paper", realtime=True) as link:
        assert isinstance(link, PortLink)
        assert np.isfinite(link.identity.torque_limit)


@pytest.mark.parametrize("realtime", [False, True])
def test_without_a_specimen_there_is_nothing_to_simulate(realtime: bool) -> None:
    with pytest.raises(InputError, match="specimen"), open_rig("sim", None, realtime=realtime):
        pass
