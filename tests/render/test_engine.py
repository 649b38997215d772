"""Rendering on the virtual rig, in lockstep time."""

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from scissorcal.device import Faults, LockstepLink, Operator, RigSession
from scissorcal.errors import DeviceError, InputError
from scissorcal.kernel import Capability, ConfigKey, Identity, StateFlag
from scissorcal.package import ModelPackage
from scissorcal.recipe import Limits
from scissorcal.recording import Recording, read_attachments, read_recording
from scissorcal.render import Rendering, RenderResult, VirtualStrokes, open_writer, render
from scissorcal.render.rig_facts import RigFacts, rig_facts
from tests.strange_device import FAULTS, StrangeDevice, VirtualPort
from tests.strange_device.mechanics import Hand

TWO = VirtualStrokes(count=2, rate_rad_per_s=0.5)


def rig(specimen: str = "office-paper", seed: int = 1, **faults: Any) -> LockstepLink:
    return LockstepLink(specimen, np.random.default_rng(seed), Faults(**faults))


def rendered(
    package: ModelPackage,
    path: Path,
    link: LockstepLink | None = None,
    limits: Limits | None = None,
    known: RigFacts | None = None,
    **options: Any,
) -> tuple[RenderResult, Recording]:
    recipe = package.recipe.model_copy(update=limits and {"limits": limits})
    operator = Operator(progress=options.pop("progress", lambda *_: None))
    session = RigSession(link or rig(), recipe, operator, recipe_toml="# a recipe")
    with open_writer(session, package, path) as writer:
        how = Rendering(**({"strokes": TWO, "seconds": 20.0} | options))
        result = render(session, package, how, writer=writer, rig=known)
    return result, read_recording(path)


def enabled(samples: NDArray[np.void]) -> NDArray[np.void]:
    return samples[(samples["flags"] & int(StateFlag.MOTOR_ENABLED)) != 0]


class Disguised(LockstepLink):
    """The virtual rig with an identity of our choosing."""

    def __init__(self, **changes: Any) -> None:
        super().__init__("office-paper", np.random.default_rng(1))
        self.identity: Identity = self.identity._replace(**changes)


def test_strokes_are_rendered_recorded_and_judged(paper: ModelPackage, tmp_path: Path) -> None:
    told: list[tuple[float, str]] = []
    result, recording = rendered(
        paper, tmp_path / "r.mcap", progress=lambda done, sentence: told.append((done, sentence))
    )
    assert result.strokes == 2
    assert result.seconds < 15.0
    assert result.misses == result.garbled == result.faults == result.fallback_frames == 0
    assert result.latency is None
    assert {verdict.check: verdict.status for verdict in result.verdicts} == {
        "admission": "pass",
        "felt torque": "pass",
        "deadline": "not_evaluated",
        "misses": "pass",
        "faults": "pass",
        "supervision": "pass",
        "passivity": "pass",
        "motor sense": "pass",
    }
    unsigned, derated = result.warnings
    assert "not signed" in unsigned
    assert "elastic slope" in derated
    assert recording.notes[0] == unsigned
    assert result.package_hash == paper.manifest.content_hash
    assert result.ledger.fracture_J > 0.005
    assert recording.kind == "render"
    assert recording.recipe_toml == "# a recipe"
    assert len(recording.samples) >= round(result.seconds * 1000)
    assert sum(stroke.kind == "closing" for stroke in recording.strokes) == 2
    assert any(paper.manifest.content_hash in note for note in recording.notes)
    (attached,) = read_attachments(tmp_path / "r.mcap")
    assert json.loads(attached.data)["content_hash"] == paper.manifest.content_hash
    shares = [done for done, _ in told]
    assert shares == sorted(shares)
    assert 0.0 < shares[0] <= shares[-1] <= 1.0
    assert "stroke 2 of 2" in told[-1][1]


def test_the_loop_renders_the_step_of_the_package(
    silent_paper: ModelPackage, tmp_path: Path
) -> None:
    """Replaying the recorded motion through ``package.kernel()`` gives the commands that left."""
    result, recording = rendered(silent_paper, tmp_path / "r.mcap")
    samples = recording.samples
    on = np.flatnonzero(samples["torque_command"] != 0.0)
    kernel = silent_paper.kernel()
    kernel.reset(0.0)
    steps = kernel.step_many(samples["opening"], 0.0, samples["advance"])
    free = on[samples["device_time_us"][on] > samples["device_time_us"][0] + 1_000_000]
    replayed = steps["torque"][free]
    slow = np.abs(np.diff(replayed, prepend=replayed[0])) < 0.15
    assert len(free) > 1000
    assert np.mean(slow) > 0.99
    commanded = samples["torque_command"][free]
    assert np.max(np.abs(replayed - commanded)[slow]) < 1e-6
    assert result.largest_torque_Nm == pytest.approx(np.max(samples["torque_command"]))


@pytest.mark.filterwarnings("ignore::scissorcal.package.OutsideCoverageWarning")
def test_the_rendered_torque_averages_to_the_packages_torque(
    silent_paper: ModelPackage, tmp_path: Path
) -> None:
    """While the crack advances, the mean command is the mean of ``torque`` at those openings."""
    _, recording = rendered(silent_paper, tmp_path / "r.mcap")
    samples = recording.samples
    kernel = silent_paper.kernel()
    kernel.reset(0.0)
    steps = kernel.step_many(samples["opening"], 0.0, samples["advance"])
    moved = np.diff(steps["contact"] + samples["advance"], prepend=0.0) > 0
    runs = np.flatnonzero(moved & (samples["torque_command"] > 0.0))
    cut = samples[runs[20] : runs[-20]]
    cut = cut[cut["torque_command"] > 0.02]
    stated = silent_paper.torque(cut["opening"], 0.0, 0.0)
    assert np.mean(cut["torque_command"]) == pytest.approx(np.mean(stated), rel=0.03)


def test_the_tightest_limit_holds(paper: ModelPackage, tmp_path: Path) -> None:
    limits = Limits(torque_Nm=0.03, torque_slew_Nm_per_s=5.0, engagement_ramp_s=0.8)
    result, recording = rendered(paper, tmp_path / "r.mcap", limits=limits)
    assert result.limits.torque_Nm == 0.03
    assert result.limits.engagement_ramp_s == 0.8
    command = recording.samples["torque_command"]
    assert np.max(np.abs(command)) <= np.float32(0.03)
    on = np.abs(np.diff(command[command != 0.0]))
    assert np.max(on) <= 5.0 * 1e-3 * 1.05
    assert result.limited_share > 0.01
    assert any("weaker than the model" in sentence for sentence in result.warnings)


def test_a_wider_recipe_does_not_widen_the_package(paper: ModelPackage, tmp_path: Path) -> None:
    limits = Limits(torque_Nm=500.0, force_N=1e4, engagement_ramp_s=0.01)
    link = rig()
    result, _ = rendered(paper, tmp_path / "r.mcap", link, limits=limits)
    own = paper.manifest.limits
    assert result.limits.torque_Nm == min(own.torque_Nm, link.identity.torque_limit)
    assert result.limits.engagement_ramp_s == own.engagement_ramp_s


def test_force_grows_from_zero_after_engagement(paper: ModelPackage, tmp_path: Path) -> None:
    _, recording = rendered(paper, tmp_path / "r.mcap")
    samples = enabled(recording.samples)
    since = (samples["device_time_us"] - samples["device_time_us"][0]) * 1e-6
    ramping = since < 0.45
    command = np.abs(samples["torque_command"][ramping])
    friction = 0.021
    assert np.max(command) > 0.003
    assert np.all(command <= friction * (since[ramping] + 0.002) / 0.5)


def test_translation_force_is_rendered_only_where_the_scene_names_it(
    paper: ModelPackage, pushing_paper: ModelPackage, tmp_path: Path
) -> None:
    result, recording = rendered(paper, tmp_path / "a.mcap")
    assert result.limits.force_N == 0.0
    assert not recording.samples["force_command"].any()
    result, recording = rendered(pushing_paper, tmp_path / "b.mcap")
    assert result.limits.force_N > 0.0
    assert np.min(recording.samples["force_command"]) < -0.5
    assert np.max(recording.samples["force_command"]) <= 0.0


def test_a_pad_is_pressed_and_gives_its_energy_back(pad: ModelPackage, tmp_path: Path) -> None:
    result, _ = rendered(pad, tmp_path / "r.mcap", rig("soft-pad"))
    assert result.ledger.fracture_J == result.ledger.arrest_J == 0.0
    assert result.largest_torque_Nm > 0.03
    assert next(v for v in result.verdicts if v.check == "passivity").status == "pass"


def test_a_soft_rendering_is_stated_and_the_cut_keeps_its_energy(
    paper: ModelPackage, tmp_path: Path
) -> None:
    """A rig with little friction renders softer; one that answers at once renders all."""
    slow, _ = rendered(paper, tmp_path / "a.mcap")
    known = rig_facts(paper)
    quick, _ = rendered(
        paper, tmp_path / "b.mcap", known=replace(known, late_s=1e-5, damping_Nm_s_per_rad=0.03)
    )
    assert slow.admission.derated
    assert slow.admission.rendered <= slow.admission.allowed_in_hand < slow.admission.needed
    assert not quick.admission.derated
    assert not any("elastic slope" in sentence for sentence in quick.warnings)
    assert slow.ledger.injected_J == quick.ledger.injected_J == 0.0
    assert abs(slow.ledger.unbooked_J) < 1e-3 * slow.ledger.absorbed_J
    assert slow.ledger.fracture_J == pytest.approx(quick.ledger.fracture_J, rel=0.1)


def test_a_rig_that_cannot_render_a_package_is_refused_before_anything_moves(
    paper: ModelPackage,
) -> None:
    link = rig()
    late = replace(rig_facts(paper), late_s=0.05)
    with pytest.raises(InputError, match="What would cure it: A delay of"):
        render(RigSession(link, paper.recipe), paper, Rendering(strokes=TWO), rig=late)
    assert link.virtual_time < 0.1


def test_a_translation_force_needs_an_advance_motor(
    pushing_paper: ModelPackage,
) -> None:
    link = Disguised(capabilities=int(Capability.SIMULATOR), force_limit=0.0)
    result = render(
        RigSession(link, pushing_paper.recipe), pushing_paper, Rendering(0.5, strokes=TWO)
    )
    assert any("no advance motor" in sentence for sentence in result.warnings)
    manifest = pushing_paper.manifest
    alone = manifest.mechanics.model_copy(update={"render": ("translation_force",)})
    only = replace(pushing_paper, manifest=manifest.model_copy(update={"mechanics": alone}))
    with pytest.raises(InputError, match="nothing would be felt"):
        render(RigSession(link, only.recipe), only, Rendering(0.5, strokes=TWO))


@pytest.mark.parametrize("fault", ["none", "motor reversed"])
def test_a_reversed_motor_is_told_by_the_hands_work(paper: ModelPackage, fault: str) -> None:
    """Also where the device reports what it commands its amplifier, not what the motor gives."""
    device = StrangeDevice(FAULTS[fault], seed=1)

    def grasp(_: str) -> None:
        device.grasp(Hand(stiffness=8.0, damping=0.05, strokes=2))

    result = render(
        RigSession(VirtualPort(device), paper.recipe, Operator(grasp)), paper, Rendering(6.0)
    )
    sense = next(verdict for verdict in result.verdicts if verdict.check == "motor sense")
    assert sense.status == ("pass" if fault == "none" else "fail")


def test_equal_seeds_render_equally(paper: ModelPackage, tmp_path: Path) -> None:
    first, one = rendered(paper, tmp_path / "a.mcap")
    second, two = rendered(paper, tmp_path / "b.mcap")
    assert first == second
    assert np.array_equal(one.samples["torque_command"], two.samples["torque_command"])


def test_time_ends_a_rendering_whose_strokes_take_longer(
    paper: ModelPackage, tmp_path: Path
) -> None:
    result, _ = rendered(paper, tmp_path / "r.mcap", seconds=3.0)
    assert result.seconds == pytest.approx(3.0, abs=0.1)
    assert result.strokes < 2


def test_lost_and_garbled_frames_are_counted_and_skipped(
    paper: ModelPackage, tmp_path: Path
) -> None:
    result, recording = rendered(
        paper, tmp_path / "r.mcap", rig(drop_share=0.02, garble_share=0.01)
    )
    assert result.misses > 50
    assert result.garbled > 20
    verdict = next(verdict for verdict in result.verdicts if verdict.check == "misses")
    assert verdict.status == "fail"
    assert "cable" in verdict.why
    assert any("garbled" in note for note in recording.notes)
    assert np.isfinite(recording.samples["torque_command"]).all()


def test_a_device_that_brakes_is_ramped_up_again_and_noted(
    paper: ModelPackage, tmp_path: Path
) -> None:
    link = rig(drop_share=0.1)
    link.configure(ConfigKey.BRAKE_AFTER_MS, 3.0)
    result, recording = rendered(paper, tmp_path / "r.mcap", link, seconds=4.0)
    assert result.faults > 2
    verdict = next(verdict for verdict in result.verdicts if verdict.check == "faults")
    assert verdict.status == "fail"
    assert "ramped up from zero" in verdict.why
    samples = recording.samples
    latched = (samples["flags"] & int(StateFlag.FAULT_LATCHED)) != 0
    cleared = np.flatnonzero(latched[:-1] & ~latched[1:]) + 1
    assert np.all(np.abs(samples["torque_command"][latched]) == 0.0)
    assert np.all(np.abs(samples["torque_command"][cleared[1:]]) < 0.002)


def test_an_unplugged_rig_leaves_what_was_recorded(paper: ModelPackage, tmp_path: Path) -> None:
    link = rig(unplug_s=2.5)
    path = tmp_path / "r.mcap"
    with (
        pytest.raises(DeviceError, match="unplugged"),
        open_writer(RigSession(link, paper.recipe), paper, path) as writer,
    ):
        render(RigSession(link, paper.recipe), paper, Rendering(strokes=TWO), writer=writer)
    assert read_recording(path).duration_s == pytest.approx(2.5, abs=0.3)


def test_it_runs_without_a_recording(paper: ModelPackage) -> None:
    assert render(RigSession(rig(), paper.recipe), paper, Rendering(2.0, strokes=TWO)).frames > 1900


def test_a_missing_confirm_callback_is_refused_before_anything_moves(paper: ModelPackage) -> None:
    link = Disguised(capabilities=1)
    with pytest.raises(InputError, match="clear the blades"):
        render(RigSession(link, paper.recipe), paper, Rendering(1.0))
    assert link.virtual_time < 0.1


def test_confirmation_is_requested_before_any_force(paper: ModelPackage) -> None:
    link = Disguised(capabilities=1)
    asked: list[str] = []
    result = render(RigSession(link, paper.recipe, Operator(asked.append)), paper, Rendering(1.0))
    assert len(asked) == 1
    assert "push back" in asked[0]
    assert result.seconds == pytest.approx(1.0, abs=0.1)

    def leave(request: str) -> None:
        raise KeyboardInterrupt

    link = Disguised(capabilities=1)
    with pytest.raises(KeyboardInterrupt):
        render(RigSession(link, paper.recipe, Operator(leave)), paper, Rendering(1.0))
    assert link.virtual_time < 0.5


def test_a_device_that_cannot_reach_the_scene_is_refused(paper: ModelPackage) -> None:
    with pytest.raises(InputError, match="build a package for this rig"):
        render(RigSession(Disguised(opening_min=1.2, opening_max=1.5), paper.recipe), paper)


def test_a_device_of_another_rate_or_handle_is_named(paper: ModelPackage) -> None:
    other_handle = Disguised(handle_radius=0.05)
    with pytest.raises(InputError, match=r"is of another rig.*handle radius of 50\.0 mm"):
        render(RigSession(other_handle, paper.recipe), paper, Rendering(0.5, strokes=TWO))
    assert other_handle.virtual_time < 0.1
    result = render(
        RigSession(other_handle, paper.recipe),
        paper,
        Rendering(0.5, strokes=TWO, allow_mismatch=True),
    )
    assert any("handle radius of 50.0 mm" in sentence for sentence in result.warnings)
    manifest = paper.manifest
    slow = manifest.mechanics.model_copy(update={"loop_rate_Hz": 500.0})
    other = replace(paper, manifest=manifest.model_copy(update={"mechanics": slow}))
    result = render(RigSession(rig(), other.recipe), other, Rendering(0.5, strokes=TWO))
    assert any("built for 500 Hz" in sentence for sentence in result.warnings)


@pytest.mark.parametrize("seconds", [0.0, -1.0, float("nan"), float("inf")])
def test_impossible_times_are_refused(seconds: float, paper: ModelPackage) -> None:
    with pytest.raises(InputError, match="above 0"):
        render(RigSession(rig(), paper.recipe), paper, Rendering(seconds))
