"""Golden vectors of the hybrid law: the answers of its reference in float64, for C and Python.

Written anew by ``python -m tests.kernel.golden_hybrid``.
"""

import json
import math
from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np

from scissorcal.kernel import (
    HYBRID_INPUT_DTYPE,
    HYBRID_OUTPUT_DTYPE,
    HybridConfig,
    NormalLaw,
    hybrid_inputs,
)
from tests.kernel.reference_hybrid import ReferenceHybrid

PATH = Path(__file__).resolve().parents[1] / "golden" / "hybrid.json"
TOLERANCE = 1e-5
STEPS = 48
Inputs = np.ndarray

CONFIG: dict[str, Any] = {
    "axes": 2,
    "contact_kd": 120.0,
    "force_ki": 20.0,
    "normal_kp": 4096.0,
    "normal_kd": 96.0,
    "path_kp": 4096.0,
    "path_kd": 100.0,
    "path_ki": 32768.0,
    "force_most": 4.0,
    "force_slew": 40.0,
    "touch_force": 0.25,
    "leave_force": 0.125,
    "leave_s": 0.0056,
    "approach_speed": 0.0078125,
    "approach_force": 0.5,
    "friction_share": 0.75,
    "friction_rate": (0.0625, 0.0078125),
    "effort_limit": (0.5, 16.0),
}
THREE: dict[str, Any] = {
    **CONFIG,
    "axes": 3,
    "friction_rate": (0.0625, 0.0078125, 0.0625),
    "effort_limit": (0.5, 16.0, 8.0),
}


def hybrid_config(**changes: Any) -> HybridConfig:
    """Settings for two axes."""
    return HybridConfig(**{**CONFIG, **changes})


def motion(axes: int, seed: int, jacobian: float = 0.3) -> Inputs:
    """Everything that a mechanism measures and wants, smooth in time and of plausible size.

    The force comes, bounces, stays, goes for good and comes again.
    """
    rng = np.random.default_rng(seed)
    phase = np.linspace(0.0, 2.0 * math.pi, STEPS)

    def wave(size: float, *shape: int) -> np.ndarray:
        starts, turns = rng.uniform(0.0, 6.0, shape), rng.uniform(0.3, 2.0, shape)
        return size * np.sin(starts + np.multiply.outer(phase, turns))

    inertia = np.zeros((STEPS, axes, axes))
    levers = np.array([0.07, 1.0, 0.3])[:axes]
    masses = np.array([2e-4, 0.8, 0.05])[:axes]
    inertia[:, range(axes), range(axes)] = masses
    for one, other in ((0, 1), (0, 2), (1, 2))[: 1 if axes == 2 else 3]:
        between = 0.3 * math.sqrt(masses[one] * masses[other]) * np.sin(phase + one + other)
        inertia[:, one, other] = inertia[:, other, one] = between
    frame = np.eye(axes) + jacobian * wave(1.0, axes, axes) / axes
    normal = wave(1.0, axes) + np.eye(axes)[1] * 2.0
    force = np.array([0.0] * 5 + [0.375] * 2 + [0.0625] * 3 + [0.5, 1.0] * 4 + [1.75] * 8)
    force = np.concatenate([force, [0.0625] * 8, [-0.5] * 3, [0.75] * 5, [2.5] * STEPS])[:STEPS]
    return hybrid_inputs(
        STEPS,
        dt=1e-3,
        rate=wave(0.3, axes) * np.array([1.0, 0.1, 1.0])[:axes],
        inertia=inertia,
        bias=wave(0.05, axes),
        dry_friction=np.abs(wave(0.02, axes)),
        jacobian=frame * levers,
        jacobian_rate=wave(0.5, axes),
        point=wave(0.02, axes),
        normal=normal / np.linalg.norm(normal, axis=1, keepdims=True),
        gap=wave(1e-3),
        surface_velocity=wave(0.01, axes),
        surface_acceleration=wave(0.5),
        surface_friction=0.25,
        force=force,
        compliance=2.0**-13,
        force_wanted=np.repeat([2.0, 0.125, 6.0, 3.0], STEPS // 4),
        gap_wanted=wave(1e-3),
        gap_rate_wanted=wave(1e-2),
        path=wave(0.02, axes),
        path_rate=wave(0.05, axes),
        path_acceleration=wave(0.5, axes),
    )


def _near(inputs: Inputs) -> Inputs:
    """A path near the point, so that it needs no more than the axes have."""
    changed = inputs.copy()
    changed["path"] = inputs["point"] + 0.01 * inputs["path"]
    return changed


def _broken(inputs: Inputs) -> Inputs:
    """Inputs that are not finite, and a singular Jacobian, now and then."""
    changed = _near(inputs)
    changed["force"][15] = np.nan
    changed["jacobian"][22] = changed["jacobian"][22][:, [0, 0, 2]]
    changed["rate"][44, 1] = 1e10
    return changed


def _irregular(inputs: Inputs) -> Inputs:
    """Ticks that were lost, repeated and late."""
    changed = _near(inputs)
    changed["dt"] = np.array([1e-3, 0.0, 2e-3, 0.25])[np.arange(STEPS) % 4]
    return changed


def cases() -> dict[str, tuple[HybridConfig, Inputs]]:
    """Title -> settings and inputs."""
    position = {**CONFIG, "normal_law": NormalLaw.POSITION}
    weak = {**CONFIG, "effort_limit": (0.03, 1.0), "force_ki": 100.0}
    tight = {**CONFIG, "integral_most": 0.0625, "force_ki": 100.0}
    felt = {**CONFIG, "surface_cutoff_Hz": 100.0, "force_kp": 0.75, "integral_most": 1.0}
    return {
        "two axes": (HybridConfig(**CONFIG), _near(motion(2, 1))),
        "a path far away": (HybridConfig(**CONFIG), motion(2, 2)),
        "three axes": (HybridConfig(**THREE), _near(motion(3, 3))),
        "three axes, a path far away": (HybridConfig(**THREE), motion(3, 4)),
        "position": (HybridConfig(**position), _near(motion(2, 5))),
        "weak motors": (HybridConfig(**weak), motion(2, 6)),
        "an integral at its end": (HybridConfig(**tight), _near(motion(2, 7))),
        "broken inputs": (HybridConfig(**CONFIG), _broken(motion(2, 8))),
        "irregular ticks": (HybridConfig(**THREE), _irregular(motion(3, 9))),
        "from afar": (HybridConfig(**{**CONFIG, "approach_rate": 16.0}), _near(motion(2, 12))),
        "a surface that is felt": (HybridConfig(**felt), _irregular(motion(2, 10))),
        "a felt surface, weak motors": (HybridConfig(**{**felt, **weak}), motion(2, 11)),
    }


def golden() -> dict[str, Any]:
    """Settings, inputs and answers of every case; not a number is null."""
    made = []
    for title, (config, inputs) in cases().items():
        law = ReferenceHybrid(rounded(config))
        rows = [law.step({name: row[name] for name in HYBRID_INPUT_DTYPE.names}) for row in inputs]
        made.append(
            {
                "title": title,
                "config": {f.name: getattr(law.config, f.name) for f in fields(config)},
                "in": {name: _flat(inputs[name]) for name in HYBRID_INPUT_DTYPE.names},
                "out": {
                    name: _flat(np.array([row[name] for row in rows]))
                    for name in HYBRID_OUTPUT_DTYPE.names
                },
            }
        )
    return {"tolerance": TOLERANCE, "steps": STEPS, "cases": made}


def rounded(config: HybridConfig) -> HybridConfig:
    """The settings as the core has them, in float32."""
    return HybridConfig(
        **{field.name: _single(getattr(config, field.name)) for field in fields(config)}
    )


def _single(value: Any) -> Any:
    if isinstance(value, tuple):
        return tuple(map(_single, value))
    return float(np.float32(value)) if isinstance(value, float) else value


def _flat(values: np.ndarray) -> list[Any]:
    numbers = np.asarray(values, dtype=float).reshape(-1)
    return [None if math.isnan(value) else float(f"{value:.9g}") for value in numbers]


if __name__ == "__main__":
    text = json.dumps(golden(), allow_nan=False, separators=(",", ":"))
    PATH.write_text(text.replace('{"title"', '\n{"title"') + "\n", encoding="utf-8")
