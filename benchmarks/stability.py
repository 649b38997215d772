"""Simulate sampled loops and compare where they oscillate with the rule of the admission check.

    python -m benchmarks.stability [--loops 2000] [--seed 1]

Continuous blades (inertia, viscous and dry friction that sticks) meet a spring that a computer
renders: the encoder counts, the tick samples, the command arrives late and is held, the motor
follows with a lag. The blades start at the spring's centre with the rate that the rule allows for.
The simulation shares nothing with the rule. Every loop has its own rig and delays, drawn at random;
its stiffness is a multiple of the rule's. Prints at which multiple loops begin to oscillate, and
how many do at the rule itself.
"""

import argparse
from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from scissorcal.aliases import Array
from scissorcal.render.admission_rule import (
    OSCILLATION_RATE,
    LoopFacts,
    allowed_stiffness,
    delayed_stiffness,
)

STEP_S = 25e-6
"""A tenth of the shortest tick."""
TORQUE_LIMIT = 1.0
WINDOW_S = 1.0
DECAYS = 0.995
"""A swing that falls by less than this in two seconds does not die."""
COUNTS = (20_000, 1_000_000)
MULTIPLES = np.array([1.0, 1.2, 1.4, 1.6, 1.8, 1.9, 2.0, 2.1, 2.2, 2.3, 2.5, 3.0, 4.0])


@dataclass(frozen=True)
class Loops:
    """Rigs and loops, one entry each: shapes (n,), SI units and radians."""

    tick_s: Array
    wire_s: Array
    lag_s: Array
    inertia: Array
    damping: Array
    coulomb: Array
    encoder: Array
    press: Array
    """Torque that closes, against the spring, N m."""

    def facts(self, i: int) -> LoopFacts:
        """What the rule is told about loop ``i``."""
        return LoopFacts(
            float(self.tick_s[i]),
            float(self.wire_s[i] + self.lag_s[i]),
            float(self.inertia[i]),
            float(self.damping[i]),
            float(self.coulomb[i]),
            float(self.encoder[i]),
        )

    def rule(self) -> Array:
        """The rule's stiffness for each, N m/rad."""
        return np.array([allowed_stiffness(self.facts(i)) for i in range(len(self.tick_s))])

    def delayed(self) -> Array:
        """The rule without the encoder's part, N m/rad."""
        return np.array([delayed_stiffness(self.facts(i)) for i in range(len(self.tick_s))])

    def repeated(self, times: int) -> "Loops":
        """Each loop ``times`` times in a row."""
        return Loops(*(np.repeat(getattr(self, field.name), times) for field in fields(self)))


@dataclass(frozen=True)
class Swings:
    """What a simulation ended in; shapes (n,). ``last`` and ``before`` are the blades' swings (rad)
    in the last second and two seconds before; ``toggles`` counts changes of the command per
    second."""

    last: Array
    before: Array
    toggles: Array

    def oscillating(self, encoder: Array) -> NDArray[np.bool_]:
        """Loops whose blades go on to swing by more than two counts."""
        return (self.last > 2.05 * encoder) & (self.last > DECAYS * self.before)

    def chattering(self) -> NDArray[np.bool_]:
        """Loops whose command does not come to rest, within two counts or beyond."""
        return (self.toggles > 2) & (self.last > DECAYS * self.before)


def draw_loops(count: int, rng: np.random.Generator, *, friction: bool) -> Loops:
    """Random loops: 250 to 4000 Hz, 0 to 4 ms late, inertia and damping over decades."""

    def spread(low: float, high: float) -> Array:
        return np.exp(rng.uniform(np.log(low), np.log(high), count))

    ticks = np.array([4e-3, 2e-3, 1e-3, 5e-4, 2.5e-4])[rng.integers(5, size=count)]
    late = rng.uniform(0.0, 4e-3, count) * (rng.random(count) < 0.8)
    lag = np.minimum(late, rng.uniform(0.0, 1.5e-3, count))
    coulomb = spread(1e-3, 3e-2) if friction else np.zeros(count)
    return Loops(
        tick_s=ticks,
        wire_s=late - lag,
        lag_s=lag,
        inertia=spread(5e-5, 1e-3),
        damping=spread(3e-4 if friction else 2e-3, 1e-1),
        coulomb=coulomb,
        encoder=2.0 * np.pi / np.array(COUNTS)[rng.integers(2, size=count)],
        press=np.where(rng.random(count) < 0.5, 0.0, rng.uniform(0.0, 0.05, count)),
    )


def simulate(loops: Loops, stiffness: Array, *, seconds: float, one_sided: bool) -> Swings:
    """Run the loops for ``seconds`` from the scene's rate; all at once, in steps of 25 us.

    A ``one_sided`` spring pushes only, as material does. Friction is an impulse that at most stops
    the blades in a step (Moreau's scheme).
    """
    count = len(stiffness)
    ticks = np.rint(loops.tick_s / STEP_S).astype(np.int64)
    late = np.rint(loops.wire_s / STEP_S).astype(np.int64)
    keep = np.where(loops.lag_s > 0.0, np.exp(-STEP_S / np.maximum(loops.lag_s, 1e-9)), 0.0)
    groups = [(int(n), np.flatnonzero(ticks == n)) for n in np.unique(ticks)]
    arriving = np.full((int(late.max()) + 1, count), np.nan)
    mobility = STEP_S / loops.inertia
    opening = 0.37 * loops.encoder - loops.press / stiffness
    rate = np.full(count, -OSCILLATION_RATE)
    command, torque, toggles = loops.press.copy(), loops.press.copy(), np.zeros(count)
    steps, window = round(seconds / STEP_S), round(WINDOW_S / STEP_S)
    low, high = np.full((2, count), np.inf), np.full((2, count), -np.inf)
    for k in range(steps):
        for every, group in groups:
            if k % every == 0:
                step = loops.encoder[group]
                wanted = -stiffness[group] * step * np.floor(opening[group] / step + 0.5)
                if one_sided:
                    wanted = np.maximum(wanted, 0.0)
                wanted = np.clip(wanted, -TORQUE_LIMIT, TORQUE_LIMIT)
                arriving[(k + late[group]) % len(arriving), group] = wanted
        slot = arriving[k % len(arriving)]
        new = ~np.isnan(slot)
        if k >= steps - window:
            toggles += new & (slot != command)
        command = np.where(new, slot, command)
        slot[:] = np.nan
        torque = command + keep * (torque - command)
        free = rate + mobility * (torque - loops.press)
        left = np.maximum(np.abs(free) - mobility * loops.coulomb, 0.0)
        rate = np.copysign(left / (1.0 + mobility * loops.damping), free)
        opening = opening + STEP_S * rate
        for place, start in ((0, steps - 3 * window), (1, steps - window)):
            if start <= k < start + window:
                np.minimum(low[place], opening, out=low[place])
                np.maximum(high[place], opening, out=high[place])
    swing = high - low
    return Swings(last=swing[1], before=swing[0], toggles=toggles / WINDOW_S)


def onset(loops: Loops, *, one_sided: bool, seconds: float) -> Array:
    """The smallest multiple of the delay's rule at which each loop oscillates; inf if none does."""
    many = loops.repeated(len(MULTIPLES))
    multiple = np.tile(MULTIPLES, len(loops.tick_s))
    swings = simulate(many, multiple * many.delayed(), seconds=seconds, one_sided=one_sided)
    bad = swings.oscillating(many.encoder).reshape(-1, len(MULTIPLES))
    return np.where(bad.any(axis=1), MULTIPLES[np.argmax(bad, axis=1)], np.inf)


def main() -> None:
    """Print, for loops with and without friction, what the rule admits and gives away."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--loops", type=int, default=2000)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--seconds", type=float, default=6.0)
    arguments = parser.parse_args()
    for friction in (True, False):
        for one_sided in (False, True):
            rng = np.random.default_rng(arguments.seed)
            loops = draw_loops(arguments.loops, rng, friction=friction)
            rule = loops.rule() if friction else loops.delayed()
            at_rule = simulate(loops, rule, seconds=arguments.seconds, one_sided=one_sided)
            oscillating = at_rule.oscillating(loops.encoder)
            chattering = at_rule.chattering() & ~oscillating
            few = Loops(*(getattr(loops, f.name)[: arguments.loops // 5] for f in fields(loops)))
            found = onset(few, one_sided=one_sided, seconds=arguments.seconds)
            capped = float(np.mean(few.rule() < few.delayed())) if friction else 0.0
            print(
                f"{'with' if friction else 'without'} dry friction, "
                f"{'one' if one_sided else 'two'}-sided: at the rule {int(oscillating.sum())} of "
                f"{len(rule)} oscillate, {int(chattering.sum())} chatter within two counts; first "
                f"oscillation at {np.min(found):.3g} (median {np.median(found):.3g}) times the "
                f"rule; the encoder decides for {capped:.0%}"
            )


if __name__ == "__main__":
    main()
