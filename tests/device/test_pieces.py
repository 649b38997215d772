"""A plate with a hole and a layer, rendered on the virtual rig: in lockstep and over a port."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from scissorcal.device.link import open_link
from scissorcal.device.lockstep import LockstepLink
from scissorcal.device.motion import LoopTask, Motion, Samples
from scissorcal.device.port_motion import PortMotion, open_motion
from scissorcal.device.sim.process import SimProcess
from scissorcal.kernel import (
    ConfigKey,
    ModelTables,
    PassivityConfig,
    Piece,
    PiecesModel,
    PlateConfig,
    ServoConfig,
    Strip,
)
from tests.kernel.zoo import make_tables

FACE = 5e-5
PLATE = (
    Piece(0.0, FACE, 1.0, (Strip(0.015, 0.6),)),
    Piece(0.02, FACE, 1.0, (Strip(0.03, 0.6), Strip(0.05, 0.3))),
    Piece(0.035, 2e-4, 0.5, (Strip(0.045, 0.4),)),
)
CONFIG = ServoConfig(
    torque_limit=0.5, torque_slew=500.0, force_limit=0.0, force_slew=0.0, ramp_s=0.1
)


def strokes(motion: Motion, seconds: float, count: int) -> Samples:
    """Let the virtual hand close into the rendered plate."""
    motion.configure(ConfigKey.MATERIAL, 0.0)
    motion.configure(ConfigKey.HAND_STROKES, float(count))
    motion.configure(ConfigKey.HAND_SPEED_rad_per_s, 0.4)
    motion.fresh_sheet()
    samples = np.concatenate(list(motion.render(seconds)))
    motion.configure(ConfigKey.HAND_SPEED_rad_per_s, 0.0)
    return samples


def replayed(tables: ModelTables, samples: Samples) -> tuple[Any, PiecesModel]:
    model = PiecesModel(tables, PLATE)
    return model.step_many(samples["opening"], 0.0, samples["advance"]), model


@pytest.mark.parametrize("kappa", [1.0, 0.8])
def test_a_plate_with_a_hole_on_the_virtual_rig(kappa: float) -> None:
    """The commands are those of the pieces along the recorded way; the hole is felt as none."""
    tables = make_tables(kappa=kappa, moving_blades=2)
    link = LockstepLink("office-paper", np.random.default_rng(1))
    with open_motion(link, CONFIG, LoopTask(tables, PLATE)) as motion:
        samples = strokes(motion, 12.0, 3)
        report = motion.report()
    steps, model = replayed(tables, samples)
    on = slice(200, np.flatnonzero(samples["torque_command"])[-1])  # past the ramp
    wanted, commanded = steps["torque"][on], samples["torque_command"][on]
    slow = np.abs(np.diff(wanted, prepend=wanted[0])) < 0.4  # within the slew
    assert np.count_nonzero(commanded) > 500
    assert np.mean(slow) > 0.99
    assert np.abs(wanted - commanded)[slow].max() < 1e-6
    assert model.cut_through[0]
    assert max(model.cracks) > 0.03
    # blades that close through the hole: past the first piece, above the second
    cut = np.cumsum(steps["arrest_J"] > 0.0)
    closing = np.gradient(samples["opening"]) < -1e-5
    beyond = steps["contact"] + samples["advance"] > 0.0199
    hole = closing & beyond & (steps["indentation"] < 0.0) & (cut > 0)
    assert np.count_nonzero(hole) > 20
    assert np.all(samples["torque_command"][hole] == 0.0)
    ledger = report.ledger
    assert ledger.fracture_J > 0.01
    assert ledger.arrest_J > 1e-4
    exchanged = np.abs(np.diff(samples["opening"]) * samples["torque_command"][1:]).sum()
    assert abs(ledger.unbooked_J) < 0.01 * exchanged


@pytest.mark.realtime
def test_a_hand_feels_pieces_over_a_port_as_in_lockstep() -> None:
    """A busy computer may leave frames unanswered: what is answered is the pieces' torque."""
    tables = make_tables(fracture_energy=0.1)  # a uniform sheet would be a sixth as tough
    patient = replace(CONFIG, supervisor_ms=5000, fault_clearings=100)
    with SimProcess("office-paper", seed=1) as sim, open_link(sim.port) as link:
        link.configure(ConfigKey.BRAKE_AFTER_MS, 500.0)  # a busy machine is not what is tested
        with open_motion(link, patient, LoopTask(tables, PLATE)) as motion:
            assert isinstance(motion, PortMotion)
            samples = strokes(motion, 5.0, 1)
            ledger = motion.report().ledger
    steps, _ = replayed(tables, samples)
    answered = (samples["torque_command"] != 0.0) & (samples["latency_ns"] > 0)
    assert np.count_nonzero(answered) > 100
    off = np.abs(steps["torque"] - samples["torque_command"])[answered]
    assert np.median(off) < 1e-6
    assert ledger.fracture_J > 1e-3


def test_pieces_and_a_tracked_plate_are_refused_before_anything_moves() -> None:
    link = LockstepLink("office-paper", np.random.default_rng(1))
    config = ServoConfig(
        torque_limit=0.5,
        torque_slew=200.0,
        force_limit=0.0,
        force_slew=0.0,
        plate=PlateConfig(is_estimated=True),
        passivity=PassivityConfig(),
    )
    with pytest.raises(ValueError, match="estimated pose"):
        open_motion(link, config, LoopTask(make_tables(), PLATE))
    assert link.virtual_time == 0.0
