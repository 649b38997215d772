"""The hybrid law in C against its reference, and at the extremes: finite and within limits."""

import json
import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from scissorcal.kernel import (
    HYBRID_INPUT_DTYPE,
    HYBRID_OUTPUT_DTYPE,
    Hybrid,
    HybridConfig,
    HybridFlag,
    NormalLaw,
    hybrid_inputs,
)
from tests.kernel.golden_hybrid import CONFIG, PATH, THREE, cases, golden, hybrid_config, motion
from tests.kernel.test_golden import same

GOLDEN = json.loads(PATH.read_text(encoding="utf-8"))


def test_stored_vectors_are_what_the_reference_gives() -> None:
    made = json.loads(json.dumps(golden()))
    assert same(made, GOLDEN), "run: python -m tests.kernel.golden_hybrid, and review"


@pytest.mark.parametrize("case", GOLDEN["cases"], ids=lambda case: case["title"])
def test_steps(case: dict[str, Any]) -> None:
    """From the stored inputs, all at once and one by one."""
    settings_of = {k: tuple(v) if isinstance(v, list) else v for k, v in case["config"].items()}
    settings_of["normal_law"] = NormalLaw(settings_of["normal_law"])
    config = HybridConfig(**settings_of)
    inputs = np.zeros(GOLDEN["steps"], dtype=HYBRID_INPUT_DTYPE)
    for name, values in case["in"].items():
        column = np.array([math.nan if value is None else value for value in values])
        inputs[name] = column.reshape(inputs[name].shape)
    law = Hybrid(config)
    out = law.step(inputs)
    for name in HYBRID_OUTPUT_DTYPE.names:
        wanted = np.array(case["out"][name]).reshape(out[name].shape)
        if name == "flags":
            assert out[name].tolist() == wanted.tolist()
        else:
            allowed = GOLDEN["tolerance"] * np.abs(wanted).max() + 1e-12
            assert np.abs(out[name] - wanted).max() <= allowed, name
    law.reset()
    singly = np.concatenate([law.step(inputs[k : k + 1]) for k in range(len(inputs))])
    assert singly.tobytes() == out.tobytes()


def test_the_vectors_show_every_flag() -> None:
    seen = {int(flag) for case in GOLDEN["cases"] for flag in case["out"]["flags"]}
    assert all(any(flags & flag for flags in seen) for flag in HybridFlag)


WILD = st.one_of(
    st.floats(width=32),
    st.sampled_from([0.0, -0.0, 1e-38, -1e9, 1e9, 1e38, -1e38, math.inf, math.nan]),
    st.floats(-2.0, 2.0, width=32),
)


@settings(max_examples=300)
@given(
    axes=st.sampled_from([2, 3]),
    law=st.sampled_from(list(NormalLaw)),
    seed=st.integers(0, 1000),
    changes=st.lists(
        st.tuples(st.sampled_from(HYBRID_INPUT_DTYPE.names), st.integers(0, 8), WILD), max_size=6
    ),
    gain=st.sampled_from([0.0, 1e-9, 1.0, 1e5, 1e9]),
    cutoff=st.sampled_from([0.0, 1e-9, 100.0, 1e9]),
)
def test_efforts_are_finite_and_within_limits_whatever_comes(
    axes: int,
    law: NormalLaw,
    seed: int,
    changes: list[tuple[str, int, float]],
    gain: float,
    cutoff: float,
) -> None:
    config = HybridConfig(
        **{
            **(CONFIG if axes == 2 else THREE),
            "normal_law": law,
            "contact_kd": gain,
            "force_kp": gain,
            "surface_cutoff_Hz": cutoff,
            "integral_most": gain,
        },
    )
    inputs = motion(axes, seed)
    for name, place, value in changes:
        column = inputs[name].reshape(len(inputs), -1)
        column[seed % len(inputs) :: 7, place % column.shape[1]] = value
    law_in_c = Hybrid(config)
    out = law_in_c.step(inputs)
    limits = np.float32([*config.effort_limit, *[0.0] * (3 - axes)])
    for name in HYBRID_OUTPUT_DTYPE.names:
        assert np.isfinite(out[name]).all(), name
    assert (np.abs(out["effort"]) <= limits).all()
    assert ((out["path_share"] >= 0.0) & (out["path_share"] <= 1.0)).all()
    refused = out["flags"] & (HybridFlag.INVALID | HybridFlag.SINGULAR) != 0
    assert not out["effort"][refused].any()
    assert (np.abs(out["pressing"]) <= config.force_most + 2.0 * config.integral_most).all()
    # and a usual state after it is answered as ever
    law_in_c.reset()
    assert (
        law_in_c.step(motion(axes, 3)[:1]).tobytes()
        == Hybrid(config).step(motion(axes, 3)[:1]).tobytes()
    )


def test_the_law_is_the_same_in_any_frame() -> None:
    """Turning point, normal, surface and path together changes no effort."""
    inputs = motion(3, 5)
    turn = np.linalg.qr(np.random.default_rng(1).normal(size=(3, 3)))[0]
    turned = inputs.copy()
    for name in ("point", "normal", "surface_velocity", "path", "path_rate", "path_acceleration"):
        turned[name] = inputs[name] @ turn.T
    turned["jacobian_rate"] = inputs["jacobian_rate"] @ turn.T
    turned["jacobian"] = turn @ inputs["jacobian"]
    config = HybridConfig(**THREE)
    one, other = (Hybrid(config).step(columns) for columns in (inputs, turned))
    assert one["flags"].tolist() == other["flags"].tolist()
    assert np.abs(one["effort"] - other["effort"]).max() < 1e-4 * np.abs(one["effort"]).max()


def test_pressing_alone_is_balanced_by_the_force_alone() -> None:
    """At rest, without an error, the effort is -J^T n times the wanted force."""
    law = Hybrid(hybrid_config(force_slew=1e6, friction_share=0.0))
    jacobian = np.array([[-0.02, 1.0], [0.07, 0.0]])
    normal = np.array([0.28, 0.96])
    inputs = hybrid_inputs(
        3,
        dt=1e-3,
        jacobian=jacobian,
        inertia=np.diag([2e-4, 0.8]),
        normal=normal,
        force=1.5,
        force_wanted=1.5,
    )
    out = law.step(inputs)
    assert law.touching
    assert law.integral == 0.0
    assert out["effort"][-1, :2] == pytest.approx(-1.5 * jacobian.T @ normal, rel=1e-6)


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"contact_kd": math.nan}, "contact_kd = nan is not usable"),
        ({"effort_limit": (1.0, -1.0)}, "effort_limit"),
        ({"effort_limit": (1.0,)}, "a number for each of 2 axes"),
        ({"axes": 4, "friction_rate": (1.0,) * 4, "effort_limit": (1.0,) * 4}, "not 4"),
        ({"axes": 1, "friction_rate": (1.0,), "effort_limit": (1.0,)}, "2 or 3 axes"),
        ({"leave_force": 0.25}, "leave_force below touch_force"),
        ({"approach_force": 0.2}, "approach_force"),
        ({"least_volume": 1.0}, "between 0 and 1"),
        ({"path_kp": 1e10}, "nothing beyond 1e9"),
        ({"force_kp": -1.0}, "force_kp"),
        ({"surface_cutoff_Hz": math.nan}, "surface_cutoff_Hz"),
        ({"approach_rate": -2.0}, "approach_rate"),
    ],
)
def test_settings_out_of_range_are_refused(changes: dict[str, Any], said: str) -> None:
    with pytest.raises(ValueError, match=said):
        hybrid_config(**changes)


def test_inputs_of_other_names_are_refused() -> None:
    with pytest.raises(ValueError, match="no field"):
        hybrid_inputs(1, forse=1.0)
    assert np.isinf(hybrid_inputs(1, gap=1e300)["gap"]).all()


def test_every_case_has_its_vectors() -> None:
    assert list(cases()) == [case["title"] for case in GOLDEN["cases"]]


def test_what_is_felt_of_a_surface_begins_anew_with_each_touch_and_after_a_gap_in_time() -> None:
    """At the rate that is given then; in between it follows the force at once."""
    law = Hybrid(hybrid_config(surface_cutoff_Hz=100.0))
    jacobian = np.array([[-0.02, 1.0], [0.07, 0.0]])

    def gap_rate(force: float, given: float, dt: float = 1e-3) -> float:
        inputs = hybrid_inputs(
            dt=dt,
            jacobian=jacobian,
            inertia=np.diag([2e-4, 0.8]),
            normal=(0.0, 1.0),
            force=force,
            compliance=1e-4,
            force_wanted=1.0,
            surface_velocity=(0.0, given),
        )
        return float(law.step(inputs)["gap_rate"][0])

    def follows(before: float, rise: float) -> float:
        corner = 2.0 * math.pi * 100.0
        return before + corner / (1.0 + corner * 1e-3) * (-1e-3 * before + 1e-4 * rise)

    felt = follows(0.01, 0.0)
    assert gap_rate(1.0, 0.01) == pytest.approx(-felt, rel=1e-5)
    felt = follows(felt, 0.5)
    assert gap_rate(1.5, 0.03) == pytest.approx(-felt, rel=1e-5)
    assert gap_rate(0.05, 0.04) == pytest.approx(-0.04)  # a bounce
    assert gap_rate(1.0, 0.02) == pytest.approx(-follows(0.02, 0.0), rel=1e-5)
    assert gap_rate(3.0, 0.05, dt=0.5) == pytest.approx(-0.05)
    assert gap_rate(3.0, 0.02) == pytest.approx(-follows(0.02, 0.0), rel=1e-5)
