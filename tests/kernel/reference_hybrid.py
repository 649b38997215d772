"""The hybrid law in NumPy and float64, as published and with its additions: truth of the vectors.

The task has its own axes here, r = (along the normal, along the surface), with J_r = (n, S)^T J and
S any orthonormal basis of the surface; the C law has none. Mass along the normal comes from the
equations of motion under a unit of force.
"""

import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from scissorcal.aliases import Array
from scissorcal.kernel import HybridConfig, HybridFlag, NormalLaw

Row = dict[str, Any]
LARGEST = 1e9


@dataclass
class State:
    """Of the law; ``aim`` is None before an approach."""

    touching: bool = False
    aim: float | None = None
    speed: float = 0.0
    force_aim: float = 0.0
    integral: float = 0.0
    surface_rate: float | None = None
    force_before: float = 0.0
    below_s: float = 0.0
    gathered: Array = field(default_factory=lambda: np.zeros(3))


class ReferenceHybrid:
    """Steps as `Hybrid`, from dicts of float64."""

    def __init__(self, config: HybridConfig) -> None:
        self.config = config
        self.state = State()

    def step(self, row: Row) -> Row:
        """One step; the names of HYBRID_INPUT_DTYPE in, those of HYBRID_OUTPUT_DTYPE out."""
        config, axes = self.config, self.config.axes
        given = {name: _first(np.asarray(value, float), axes) for name, value in row.items()}
        if not all((np.abs(value) <= LARGEST).all() for value in given.values()):
            return self._refused(HybridFlag.INVALID)
        jacobian, inertia = given["jacobian"], given["inertia"]
        if abs(np.linalg.det(jacobian / np.linalg.norm(jacobian, axis=0))) < config.least_volume:
            return self._refused(HybridFlag.SINGULAR)
        normal = given["normal"]
        along = np.linalg.svd(normal[None])[2][1:]  # S^T, rows orthogonal to the normal
        task = np.vstack([normal, along]) @ jacobian  # J_r
        moved = jacobian @ np.linalg.solve(inertia, jacobian.T @ normal)  # by a newton
        flags, pressed = self._watch(given)
        velocity = jacobian @ given["rate"]
        dt = min(float(given["dt"]), 0.01)
        felt = self._felt(given, pressed, float(normal @ velocity), dt)
        gap_rate = float(normal @ velocity) - felt
        before = self.state.integral
        pressing, wanted, answer, grown, fall = 0.0, 0.0, 0.0, 0.0, 0.0
        if pressed and config.normal_law == NormalLaw.FORCE:
            wanted, flags = self._ramped(given, dt, flags)
            missing = wanted - float(given["force"])
            answer = config.force_kp * missing
            answer = min(max(answer, -config.integral_most), config.integral_most)
            pressing = wanted + answer + before
            grown = before + config.force_ki * missing * dt
            grown = min(max(grown, -config.integral_most), config.integral_most)
            a_n = -config.contact_kd * gap_rate
        elif config.normal_law == NormalLaw.FORCE:
            a_n, fall = self._approach(given, dt, gap_rate, float(normal @ moved))
        else:
            fall = float(given["gap_rate_wanted"])
            a_n = config.normal_kd * (fall - gap_rate)
            a_n += config.normal_kp * (given["gap_wanted"] - given["gap"])
        error = along @ (given["path"] - given["point"])
        far = float(np.linalg.norm(error))
        pull = along @ given["path_acceleration"] - along @ moved * (given["force"] - pressing)
        pull = pull + config.path_kd * along @ (given["path_rate"] - velocity)
        near = error * min(1.0, config.path_error_most / max(far, 1e-300))
        gathered = along @ self.state.gathered[:axes] + config.path_ki * near * dt
        most = config.path_kp * config.path_error_most
        gathered = gathered * min(1.0, most / max(float(np.linalg.norm(gathered)), 1e-300))
        pull = pull + config.path_kp * near + gathered
        bent = np.concatenate([[normal @ given["jacobian_rate"]], along @ given["jacobian_rate"]])
        stay = np.concatenate([[given["surface_acceleration"] + a_n], np.zeros(axes - 1)])
        effort = inertia @ np.linalg.solve(task, stay - bent)
        effort = effort + given["bias"] + self._friction(given, velocity, fall)
        path = inertia @ np.linalg.solve(task, np.concatenate([[0.0], pull]))
        if pressed and config.normal_law == NormalLaw.FORCE:
            flags |= self._integrate(effort, jacobian.T @ normal, wanted + answer, grown)
            effort = effort - jacobian.T @ normal * (wanted + answer + self.state.integral)
        given_effort, share, more = self._limited(effort, path)
        if share == 1.0:
            self.state.gathered[:axes] = along.T @ gathered
        return {
            "effort": [*given_effort, *[0.0] * (3 - axes)],
            "force_aim": wanted,
            "pressing": wanted + answer + self.state.integral if wanted else 0.0,
            "mass": 1.0 / float(normal @ moved),
            "gap_rate": gap_rate,
            "path_error": far,
            "path_share": share,
            "flags": int(flags | more),
        }

    def _refused(self, flag: HybridFlag) -> Row:
        self.state = State()
        zero = dict.fromkeys(
            ("force_aim", "pressing", "mass", "gap_rate", "path_error", "path_share"), 0.0
        )
        return {"effort": [0.0] * 3, **zero, "flags": int(flag)}

    def _watch(self, given: Row) -> tuple[HybridFlag, bool]:
        config, state, flags = self.config, self.state, HybridFlag(0)
        force, dt = float(given["force"]), min(float(given["dt"]), 0.01)
        if not state.touching and force >= config.touch_force:
            state.touching, state.integral, state.force_aim = True, 0.0, config.touch_force
            flags |= HybridFlag.TOUCHED
        pressed = state.touching and force >= config.leave_force
        if pressed:
            state.below_s, state.aim = 0.0, None
        elif state.touching:
            state.below_s += dt
            state.force_aim = config.touch_force
            flags |= HybridFlag.INTEGRAL_HELD
            if state.below_s > config.leave_s:
                state.touching, state.below_s = False, 0.0
                flags |= HybridFlag.LOST
        return flags | (HybridFlag.CONTACT if state.touching else HybridFlag(0)), pressed

    def _ramped(self, given: Row, dt: float, flags: HybridFlag) -> tuple[float, HybridFlag]:
        config, asked = self.config, float(given["force_wanted"])
        wanted = min(max(asked, config.touch_force), config.force_most)
        step = min(
            max(wanted - self.state.force_aim, -config.force_slew * dt), config.force_slew * dt
        )
        self.state.force_aim += step
        bounded = HybridFlag.FORCE_BOUNDED if wanted != asked else HybridFlag(0)
        return self.state.force_aim, flags | bounded

    def _approach(
        self, given: Row, dt: float, gap_rate: float, mobility: float
    ) -> tuple[float, float]:
        config, gap = self.config, float(given["gap"])
        state, most = self.state, config.approach_force * mobility / config.normal_kp
        fastest = max(config.approach_speed, config.approach_rate * gap)
        if state.aim is None:
            state.aim, state.speed = gap, min(max(-gap_rate, 0.0), fastest)
        share = min(1.0, dt * config.normal_kp / config.normal_kd)
        state.speed += share * (fastest - state.speed)
        state.aim = min(max(state.aim - state.speed * dt, gap - most), gap + most)
        ahead = config.normal_kp * (state.aim - gap)
        return config.normal_kd * (-state.speed - gap_rate) + ahead, -state.speed

    def _felt(self, given: Row, pressed: bool, out: float, dt: float) -> float:
        """The surface's rate along the normal: a first-order filter of what the point says of it,
        by the backward rule; the given one where nothing is felt."""
        told = float(given["normal"] @ given["surface_velocity"])
        state, cutoff = self.state, self.config.surface_cutoff_Hz
        untold = cutoff == 0.0 or float(given["dt"]) > 0.01
        if untold or not pressed or self.config.normal_law != NormalLaw.FORCE:
            state.surface_rate = None
            return told
        if state.surface_rate is None:
            state.surface_rate, state.force_before = told, float(given["force"])
        sunk = given["compliance"] * (float(given["force"]) - state.force_before)
        period = 1.0 / (2.0 * math.pi * cutoff)
        state.surface_rate = (period * state.surface_rate + dt * out + sunk) / (period + dt)
        state.force_before = float(given["force"])
        return state.surface_rate

    def _friction(self, given: Row, velocity: Array, fall: float) -> Array:
        config, normal = self.config, given["normal"]
        flat = np.eye(config.axes) - np.outer(normal, normal)
        moving = flat @ given["path_rate"] + normal * (fall + normal @ given["surface_velocity"])
        wanted = np.linalg.solve(given["jacobian"], moving)
        band = np.array(config.friction_rate)
        sure = np.minimum(1.0, 5.0 * np.abs(wanted) / band)
        axes = np.sign(wanted) * sure + (1.0 - sure) * np.clip(given["rate"] / band, -1.0, 1.0)
        glide = flat @ (given["path_rate"] - given["surface_velocity"])
        slip = flat @ (velocity - given["surface_velocity"])
        way = max(float(np.linalg.norm(glide)), 1e-300)
        known = min(1.0, 5.0 * way / config.slip_rate)
        drag = known * glide / way
        drag = drag + (1.0 - known) * slip / max(float(np.linalg.norm(slip)), config.slip_rate)
        force = min(max(float(given["force"]), 0.0), config.force_most)
        rubbing = given["surface_friction"] * force * given["jacobian"].T @ drag
        return np.asarray(config.friction_share * (given["dry_friction"] * axes + rubbing))

    def _integrate(self, effort: Array, push: Array, wanted: float, grown: float) -> HybridFlag:
        limits = np.array(self.config.effort_limit)
        whole = effort - push * (wanted + grown)
        further = -whole * push * (grown - self.state.integral) > 0.0
        if (further & (np.abs(whole) > limits)).any():
            return HybridFlag.INTEGRAL_HELD
        self.state.integral = grown
        return HybridFlag(0)

    def _limited(self, effort: Array, path: Array) -> tuple[Array, float, HybridFlag]:
        limits = np.array(self.config.effort_limit)
        flags, share = HybridFlag(0), 1.0
        if (np.abs(effort) > limits).any():
            flags |= HybridFlag.EFFORT_LIMITED
        for at, by, most in zip(effort, path, limits, strict=True):
            if abs(at + by) > most:
                share = min(share, max(0.0, (math.copysign(most, by) - at) / by))
        flags |= HybridFlag.PATH_YIELDS if share < 1.0 else HybridFlag(0)
        return np.clip(effort + share * path, -limits, limits), share, flags


def _first(values: Array, axes: int) -> Array:
    """The places that count."""
    return values[tuple(slice(axes) for _ in values.shape)]
