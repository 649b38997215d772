"""The law on the plant: what a caller measures, knows and wants at each tick, and what came."""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from scissorcal.aliases import Array
from scissorcal.kernel import Hybrid, HybridConfig, hybrid_inputs
from tests.control.plant import Plant


@dataclass(frozen=True)
class Wish:
    """What is wanted at a time: angle on the disc from the top with derivatives, force, gap."""

    angle: float = 0.0
    rate: float = 0.0
    acceleration: float = 0.0
    force: float = 2.0
    gap: float = 0.0


@dataclass(frozen=True)
class Known:
    """What the law is told: the disc's centre may be off by `off` (m), the rest in any ratio."""

    rate_cutoff_Hz: float = 400.0
    off: tuple[float, float] = (0.0, 0.0)
    dry: tuple[float, float] = (1.0, 1.0)
    inertia: float = 1.0
    viscous: float = 1.0
    curvature: bool = True
    surface_friction: float = 0.0
    rising: float = 1.0
    compliance: float = 1.0


@dataclass
class Steering:
    """A law that holds a plant, tick by tick."""

    plant: Plant
    config: HybridConfig
    known: Known = Known()

    def __post_init__(self) -> None:
        self.law = Hybrid(self.config)
        self.last: tuple[float, float] | None = None
        self.rates = [0.0, 0.0]
        self.inputs = hybrid_inputs(1)

    def run(self, seconds: float, wish: Callable[[float], Wish]) -> dict[str, Array]:
        """Hold for a time; the columns of this run."""
        columns: dict[str, list[float]] = {}
        for _ in range(round(seconds / self.plant.tick_s)):
            for name, value in self.tick(wish(self.plant.time)).items():
                columns.setdefault(name, []).append(value)
        return {name: np.array(values) for name, values in columns.items()}

    def tick(self, wish: Wish) -> dict[str, float]:
        """Measure, ask the law, give its effort, let a tick pass."""
        self._fill(wish)
        out = self.law.step(self.inputs)[0]
        first, second = (float(value) for value in out["effort"][:2])
        point = self.plant.point()
        row = {
            "time": self.plant.time,
            "force": self.plant.force(),
            "gap": self.plant.gap(),
            "x": point[0],
            "y": point[1],
            "torque": first,
            "push": second,
            "integral": self.law.integral,
            **{name: float(out[name]) for name in ("force_aim", "pressing", "gap_rate")},
            **{name: float(out[name]) for name in ("path_error", "path_share", "flags")},
        }
        self.plant.give((first, second))
        self.plant.tick()
        return row

    def _fill(self, wish: Wish) -> None:
        plant, known, into = self.plant, self.known, self.inputs[0]
        blade, disc, tick = plant.blade, plant.disc, plant.tick_s
        opening, advance = places = plant.measured()
        if self.last is not None:
            passed = 2.0 * math.pi * known.rate_cutoff_Hz * tick
            weight = passed / (1.0 + passed) if passed else 1.0
            for axis in range(2):
                fresh = (places[axis] - self.last[axis]) / tick
                self.rates[axis] += weight * (fresh - self.rates[axis])
        self.last = places
        turning, moving = self.rates
        sine, cosine = math.sin(opening), math.cos(opening)
        x, y = advance + blade.length * cosine, blade.length * sine
        raised, rising = disc.raised(plant.time)
        rising *= known.rising
        cx, cy = disc.centre[0] + known.off[0], disc.centre[1] + known.off[1] + raised
        away = math.hypot(x - cx, y - cy)
        nx, ny = (x - cx) / away, (y - cy) / away
        vx, vy = moving - blade.length * sine * turning, blade.length * cosine * turning
        along = vx * ny - (vy - rising) * nx
        off = -blade.coupling * sine
        scale = known.inertia
        into["dt"] = tick
        into["rate"][:2] = self.rates
        into["inertia"][:2, :2] = [
            [scale * blade.inertia, scale * off],
            [scale * off, scale * blade.mass],
        ]
        into["bias"][:2] = [
            known.viscous * blade.viscous[0] * turning,
            known.viscous * blade.viscous[1] * moving - blade.coupling * cosine * turning * turning,
        ]
        into["dry_friction"][:2] = [a * b for a, b in zip(known.dry, blade.dry, strict=True)]
        into["jacobian"][:2, :2] = [[-blade.length * sine, 1.0], [blade.length * cosine, 0.0]]
        pull = -blade.length * turning * turning
        into["jacobian_rate"][:2] = [pull * cosine, pull * sine]
        into["point"][:2] = [x, y]
        into["normal"][:2] = [nx, ny]
        into["gap"] = away - disc.radius
        into["surface_velocity"][:2] = [0.0, rising]
        heave = -known.rising * (2.0 * math.pi * disc.swing_Hz) ** 2 * raised
        into["compliance"] = known.compliance / disc.stiffness
        into["surface_acceleration"] = ny * heave - known.curvature * along * along / away
        into["surface_friction"] = known.surface_friction
        into["force"] = plant.sensed()
        into["force_wanted"] = wish.force
        into["gap_wanted"] = wish.gap
        self._path(wish, (cx, cy), rising, heave)

    def _path(self, wish: Wish, centre: tuple[float, float], rising: float, heave: float) -> None:
        into, radius = self.inputs[0], self.plant.disc.radius
        sine, cosine = math.sin(wish.angle), math.cos(wish.angle)
        into["path"][:2] = [centre[0] + radius * sine, centre[1] + radius * cosine]
        speed = radius * wish.rate
        into["path_rate"][:2] = [speed * cosine, rising - speed * sine]
        rise, pull = radius * wish.acceleration, radius * wish.rate * wish.rate
        into["path_acceleration"][:2] = [
            rise * cosine - pull * sine,
            heave - rise * sine - pull * cosine,
        ]
