"""Captures on the second rig: the product's own plans, driven or by hand, as recordings."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from scissorcal.device import (
    Plan,
    advance_plan,
    cut_plan,
    friction_plan,
    hand_travel,
    identity_facts,
)
from scissorcal.kernel import Capability, Identity, StateFlag
from scissorcal.recipe import Recipe
from scissorcal.recording import SAMPLE_DTYPE, Joint, Kind, Recording, Stroke, label_strokes

from .hand import hand_timeline
from .parameters import Rig
from .simulate import BRAKE, OFF, SERVO, Books, Timeline, run

LEAD_S = 0.3
"""Rest in the first pose before a segment begins."""
IDLE_S = 0.05
"""Motors off at the end of a segment."""
ZERO_S = 1.2
"""Motors off before the first and after the last segment, as a capture has it."""
PAUSE_S = 1.5
"""Unrecorded time while a sheet is changed."""
FIRST_SEQUENCE = 1000
FIRST_US = 3_000_000


@dataclass(frozen=True)
class Interruption:
    """A watchdog that stops the motors in the middle of a stroke, as a late host makes it do.

    It comes when ``at_share`` of the stroke's ticks have passed and lasts ``seconds``; the
    reference waits, samples of that time have the label -1, and the same stroke goes on after.
    ``brake`` short-circuits the motor instead of letting it go.
    """

    stroke: int
    at_share: float = 0.5
    seconds: float = 0.15
    brake: bool = False


def identity_of(rig: Rig) -> Identity:
    """What the rig states about itself, as plans ask for it."""
    mechanism = rig.mechanism
    return Identity(
        nonce_echo=0,
        name="second-rig",
        serial=rig.material.name[:16],
        capabilities=int(
            Capability.HANDLE_FORCE_SENSOR | Capability.ADVANCE_MOTOR | Capability.TORQUE_MEASURED
        ),
        firmware_version=1,
        tick_us=round(1e6 * rig.tick_s),
        torque_limit=rig.motor.torque_limit_Nm,
        force_limit=rig.motor.force_limit_N,
        opening_min=mechanism.opening_range_rad[0],
        opening_max=mechanism.opening_range_rad[1],
        advance_min=mechanism.sledge_range_m[0],
        advance_max=mechanism.sledge_range_m[1],
        opening_resolution=2.0 * np.pi / rig.sensors.counts_per_turn,
        advance_resolution=rig.sensors.sledge_step_m,
        handle_radius=mechanism.handle_radius_m,
    )


def capture_friction(
    rig: Rig, recipe: Recipe, rng: np.random.Generator, *, plan: Plan | None = None
) -> tuple[Recording, Books]:
    """Drive the empty sweeps of the recipe's friction plan (or an own plan) and record them."""
    plan = plan or friction_plan(recipe, identity_of(rig))
    timeline = driven_timeline(plan, zero_s=ZERO_S)
    books = run(rig, timeline, rng)
    return _recording(rig, "friction", plan.strokes, timeline, books, rng), books


def capture_friction_advance(
    rig: Rig, recipe: Recipe, rng: np.random.Generator
) -> tuple[Recording, Books]:
    """Drive the sledge over the recipe's empty sweeps and record them."""
    plan = advance_plan(recipe, identity_of(rig))
    timeline = driven_timeline(plan, zero_s=ZERO_S)
    books = run(rig, timeline, rng)
    return _recording(rig, "friction-advance", plan.strokes, timeline, books, rng), books


def capture_cut(
    rig: Rig,
    recipe: Recipe,
    rng: np.random.Generator,
    *,
    hand: bool = False,
    plan: Plan | None = None,
    interruptions: Sequence[Interruption] = (),
) -> tuple[Recording, Books]:
    """Cut (or press) through the sheets of the recipe's plan, by motors or by hand.

    By hand the motors are off, the force on the handle is measured, and strokes are found from
    the motion, as a real capture by hand does. ``interruptions`` stop driven strokes.
    """
    plan = plan or cut_plan(recipe, identity_of(rig))
    if not hand:
        timeline = driven_timeline(plan, interruptions, ZERO_S)
        books = run(rig, timeline, rng)
        return _recording(rig, "cut", plan.strokes, timeline, books, rng), books
    timeline = hand_timeline(rig, plan, rng)
    books = run(rig, timeline, rng)
    recording = _recording(rig, "cut", (), timeline, books, rng)
    samples = recording.samples.copy()
    labels = label_strokes(
        samples["opening"],
        recording.device_time_s,
        hand_travel(recipe, identity_of(rig)),
        sheet=timeline.sheet,
    )
    samples["stroke"] = labels.stroke_of_sample
    books = replace(books, stroke=labels.stroke_of_sample)
    return replace(recording, samples=samples, strokes=labels.strokes), books


def driven_timeline(
    plan: Plan, interruptions: Sequence[Interruption] = (), zero_s: float = 0.0
) -> Timeline:
    """String a plan's segments together, each with a rest before and motors off after it.

    At both ends the motors are off for ``zero_s`` more.
    """
    names = ("opening", "rate", "advance", "mode", "stroke", "sheet", "gap_s")
    columns: dict[str, list[NDArray[np.float64]]] = {name: [] for name in names}
    last = len(plan.segments) - 1
    for number, segment in enumerate(plan.segments):
        reference, sheet = segment.reference, segment.sheet
        order, mode = _order(reference.stroke, interruptions, plan.tick_s)
        zero = round(zero_s / plan.tick_s)
        lead = round(LEAD_S / plan.tick_s) + (zero if number == 0 else 0)
        idle = round(IDLE_S / plan.tick_s) + (zero if number == last else 0)
        padded = np.concatenate([np.zeros(lead, int), order, np.full(idle, order[-1])])
        modes = np.concatenate([np.full(lead, SERVO), mode, np.full(idle, OFF)])
        modes[: zero if number == 0 else 0] = OFF
        still = np.full(len(padded), False)
        still[:lead] = still[len(padded) - idle :] = True
        stroke = np.where(still | (modes != SERVO), -1, reference.stroke[padded])
        gap = np.zeros(len(padded))
        gap[0] = PAUSE_S if number else 0.0
        for name, values in (
            ("opening", reference.opening[padded]),
            ("rate", np.where(still, 0.0, reference.opening_rate[padded])),
            ("advance", reference.advance[padded]),
            ("mode", modes),
            ("stroke", stroke),
            ("sheet", np.full(len(padded), sheet)),
            ("gap_s", gap),
        ):
            columns[name].append(values)
    joined = {name: np.concatenate(parts) for name, parts in columns.items()}
    zeros = np.zeros(len(joined["opening"]))
    return Timeline(
        joined["opening"],
        joined["rate"],
        joined["advance"],
        zeros,
        zeros,
        joined["mode"].astype(np.int32),
        joined["stroke"].astype(np.int32),
        joined["sheet"].astype(np.int32),
        joined["gap_s"],
    )


def _order(
    stroke: NDArray[np.int32], interruptions: Sequence[Interruption], tick_s: float
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Index of the reference at each tick, and the mode: the reference waits in interruptions."""
    order = np.arange(len(stroke))
    mode = np.full(len(stroke), SERVO)
    for stop in sorted(interruptions, key=lambda one: -one.stroke - one.at_share):
        ticks = np.flatnonzero(stroke == stop.stroke)
        if len(ticks) == 0:
            continue
        at = int(np.searchsorted(order, ticks[int(stop.at_share * (len(ticks) - 1))]))
        count = round(stop.seconds / tick_s)
        order = np.insert(order, at, np.full(count, order[at]))
        mode = np.insert(mode, at, np.full(count, BRAKE if stop.brake else OFF))
    return order, mode


def _recording(
    rig: Rig,
    kind: Kind,
    strokes: tuple[Stroke, ...],
    timeline: Timeline,
    books: Books,
    rng: np.random.Generator,
) -> Recording:
    """Put what the sensors see of the books into a recording."""
    sensors, rows, count = rig.sensors, books.rows, len(timeline)
    samples = np.zeros(count, SAMPLE_DTYPE)
    tick = rig.tick_s
    sequence = np.rint(books.time_s / tick).astype(np.int64)
    drifting = books.time_s * (1.0 + 1e-6 * sensors.clock_drift_ppm)
    samples["sequence"] = (FIRST_SEQUENCE + sequence).astype(np.uint32)
    samples["device_time_us"] = FIRST_US + np.rint(1e6 * drifting).astype(np.int64)
    samples["host_time_ns"] = np.rint(1e9 * books.time_s).astype(np.int64) + 400_000
    samples["flags"] = np.where(timeline.mode == SERVO, int(StateFlag.MOTOR_ENABLED), 0)
    samples["opening"] = rows["measured_opening"]
    samples["advance"] = rows["measured_advance"]
    samples["motor_torque"] = (
        rows["motor_torque"]
        + sensors.torque_zero_Nm
        + _noise(sensors.torque_white_Nm, sensors.torque_slow_Nm, rig, count, rng)
    )
    samples["handle_force"] = (
        rows["handle_force"]
        + sensors.force_zero_N
        + _noise(sensors.force_white_N, sensors.force_slow_N, rig, count, rng)
    )
    samples["torque_command"] = rows["torque_command"]
    samples["force_command"] = rows["force_command"]
    samples["stroke"] = timeline.stroke
    samples["latency_ns"] = 250_000
    return Recording(
        kind=kind,
        samples=samples,
        strokes=strokes,
        joint=Joint("rotary"),
        handle_radius_m=rig.mechanism.handle_radius_m,
        device=identity_facts(identity_of(rig)),
        source=f"second-rig-{kind}",
    )


def _noise(
    white: float, slow: float, rig: Rig, count: int, rng: np.random.Generator
) -> NDArray[np.float64]:
    """White noise plus a stationary first-order autoregressive part of given deviations."""
    from scipy.signal import lfilter

    keep = float(np.exp(-rig.tick_s / rig.sensors.noise_time_s))
    drawn = rng.standard_normal(count)
    drawn[1:] *= np.sqrt(1.0 - keep * keep)
    wandering = np.asarray(lfilter([1.0], [1.0, -keep], drawn))
    return np.asarray(white * rng.standard_normal(count) + slow * wandering)
