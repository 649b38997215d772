"""Whatever the model and the motion: finite, monotone, and close to the float64 reference."""

import math
from itertools import pairwise

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.strategies import DrawFn, composite

from scissorcal.kernel import (
    Command,
    Config,
    FrameDecoder,
    Kernel,
    Mode,
    ModelTables,
    Servo,
    ServoConfig,
    State,
    decode,
    encode,
    encode_frame,
)
from tests.kernel.reference_model import Reference
from tests.kernel.zoo import CONTOUR, CONTROL, arc_edge, make_tables, power_response

u16 = st.integers(0, 2**16 - 1)
u32 = st.integers(0, 2**32 - 1)
f32 = st.floats(width=32)


@composite
def models(draw: DrawFn, fracture: bool = True) -> ModelTables:
    """Blades from hollow to bulging, materials from air to steel."""
    blades = draw(st.sampled_from([1, 2]))
    exponent = draw(st.floats(0.5, 8.0))
    force = 10.0 ** draw(st.floats(-2.0, 3.0))
    return make_tables(
        edge=arc_edge(draw(st.floats(-2.0, 2.0)), offset=draw(st.floats(-0.012, 0.0))),
        response=power_response(force, exponent, last=draw(st.sampled_from([4e-4, 2e-3]))),
        moving_blades=blades,
        upper_face=draw(st.floats(1e-6, 3e-3)),
        fracture_energy=10.0 ** draw(st.floats(-3.0, 2.0)) if fracture else 0.0,
        kappa=draw(st.one_of(st.just(1.0), st.floats(0.3, 0.999))),
        closure=draw(st.sampled_from(["work", "eq4"])),
        render_friction=draw(st.booleans()),
        rate_damping=draw(st.sampled_from([0.0, 5.0])),
        tip_station=draw(st.sampled_from([0.04, 0.075, math.inf])),
    )


@composite
def motions(draw: DrawFn) -> list[tuple[float, float, float]]:
    corners = draw(
        st.lists(
            st.tuples(st.floats(0.0, 1.2), st.floats(-5.0, 5.0), st.floats(-0.06, 0.06)),
            min_size=2,
            max_size=6,
        )
    )
    path = np.concatenate([np.linspace(a, b, 12) for a, b in pairwise(corners)])
    return [tuple(map(float, row)) for row in path.astype(np.float32)]


@settings(max_examples=150)
@given(models(), motions())
def test_steps_are_finite_and_the_crack_never_falls_back(
    tables: ModelTables, motion: list[tuple[float, float, float]]
) -> None:
    kernel = Kernel(tables)
    crack = kernel.crack
    for row in motion:
        out = kernel.step(*row)
        assert all(math.isfinite(value) for value in out)
        assert out.arrest_J >= 0
        assert out.fracture_J >= 0
        assert kernel.crack >= crack
        crack = kernel.crack


@settings(max_examples=150)
@given(models(fracture=False), motions())
def test_pressing_agrees_with_the_float64_reference(
    tables: ModelTables, motion: list[tuple[float, float, float]]
) -> None:
    """In each step to 20 float32 roundings of the place, carried through the response's slope."""
    kernel, reference = Kernel(tables), Reference(tables)
    kernel.reset(0.05)
    reference.crack = float(np.float32(0.05))
    rounding = 20 * 2.0**-24 * 0.15  # places of up to 15 cm
    for row in motion:
        got, wanted = kernel.step(*row), reference.step(*row)
        if bool(got.flags & 16) != reference.detached or abs(wanted["indentation"]) < rounding:
            return  # at the tip or at first touch a rounding decides; from there the states differ
        grade = reference.response.at(max(wanted["indentation"], 0.0))[1]
        lever = 0.15
        allowed = 1e-5 * abs(wanted["torque"]) + 1e-9
        allowed += 4.0 * (grade * rounding + wanted["response"] * 1e-5) * lever
        assert abs(got.torque - wanted["torque"]) <= allowed
        assert abs(got.indentation - wanted["indentation"]) <= rounding


@settings(max_examples=100)
@given(models(), st.floats(0.05, 1.0), st.floats(-0.03, 0.03))
def test_a_run_leaves_no_more_than_the_fracture_energy(
    tables: ModelTables, opening: float, advance: float
) -> None:
    kernel, reference = Kernel(tables), Reference(tables)
    out = kernel.step(opening, 0.0, advance)
    reference.step(float(np.float32(opening)), 0.0, float(np.float32(advance)))
    if out.flags & 4:
        grade = reference.response.at(max(out.indentation, 0.0))[1]
        place = 2e-8  # what float32 makes of a station and its height, in metres
        allowed = 1e-3 * tables.fracture_energy + tables.moving_blades * grade * place
        assert -out.force <= tables.fracture_energy + allowed
    if tables.kappa == 1.0 and not out.flags & 16 and not reference.detached:
        assert abs(kernel.crack - reference.crack) <= 2e-6 * max(1.0, abs(reference.crack))


@settings(max_examples=200)
@given(st.lists(st.tuples(u16, u32, u32, f32, f32, f32, f32), min_size=1, max_size=40))
def test_commands_are_always_finite_and_within_limits(
    rows: list[tuple[int, int, int, float, float, float, float]],
) -> None:
    """Any states at all, fault flags, restarted clocks and NaN among them."""
    config = ServoConfig(
        torque_limit=0.5,
        torque_slew=100.0,
        force_limit=5.0,
        force_slew=100.0,
        opening_kp=6.0,
        opening_kd=0.06,
        opening_ki=20.0,
        advance_kp=3000.0,
        ramp_s=0.0,
    )
    for mode in Mode:
        servo = Servo(make_tables(render_friction=True), config, CONTROL)
        servo.set_reference([0.5] * 9, [0.0] * 9, [0.0] * 9, [0] * 9)
        assert servo.control is not None
        servo.control.set_path([0.0] * 9, [0.0] * 9, [2.0] * 9, [0] * 9)
        servo.control.send(CONTOUR)
        servo.engage(mode)
        for row in rows:
            command = servo.step(State(*row))
            assert abs(command.torque) <= 0.5
            assert abs(command.force) <= 5.0
            sample = servo.telemetry()
            assert np.isfinite(sample["torque_command"]).all()
        assert all(map(math.isfinite, servo.rates))


@settings(max_examples=200)
@given(st.binary(min_size=1, max_size=250), st.binary(max_size=300))
def test_any_payload_survives_and_noise_before_it_costs_one_frame(
    payload: bytes, noise: bytes
) -> None:
    decoder = FrameDecoder()
    got = decoder.feed(noise + b"\0" + encode_frame(payload))
    assert got[-1] == payload
    assert decoder.garbled <= noise.count(b"\0") + 1


@given(st.builds(State, u16, u32, u32, f32, f32, f32, f32, st.integers(0, 255)))
def test_states_survive_bit_for_bit(state: State) -> None:
    frame = encode(state)
    (payload,) = FrameDecoder().feed(frame)
    assert encode(decode(payload)) == frame


@given(st.binary(max_size=250))
def test_decoding_gives_a_message_or_an_error(payload: bytes) -> None:
    try:
        message = decode(payload)
    except ValueError as error:
        assert str(error).endswith(".")  # noqa: PT017
    else:
        assert encode(message)
        assert isinstance(message, tuple)
        assert not isinstance(message, Command | Config) or payload[0] in (2, 0x12)
