"""Gains of the hybrid law, from what it presses on and how late it is answered. Pure."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from scissorcal.control.contact_loop import ContactGains, ContactLoop, contact_decays
from scissorcal.device.control import Axis, Gains, rate_weight
from scissorcal.device.control_design import LEADS, fastest_design
from scissorcal.errors import InputError

WITHIN_S = 0.25
"""An error of the force falls to 1/e within this time, or gains are refused."""
TOUCH_FORCE_N = 0.2
MOST_KD_PER_S, LEAST_KI_PER_S, MOST_KI_PER_S = 1500.0, 0.5, 500.0
LEAST_DAMPING_PER_S = 1.0
NO_KP = (0.0,)
FORCE_KP = (0.0, 0.25, 0.5, 0.75, 1.0, 1.5, 2.0, 3.0)
KEPT_DECAY = 0.75
PATH_INTEGRAL = 4.0
"""Corner of the path's rate over that of its integral, as in the slowest of a capture's shapes."""
GRID, ROUNDS, ROUGH = 14, 4, 2
SLOWER = 0.8
"""An approach that is unstable in contact is tried with this share of its crossover, and so on."""
SLOWEST = 0.01
SOFTER = tuple(0.5**step for step in range(1, 11))
SOONER = (0.75, 0.5, 0.25, 0.0)
"""Shares of stiffness and of delay that a refusal tries."""
STEPS, HALVINGS = 16, 2


@dataclass(frozen=True)
class HybridGains:
    """Gains of `HybridConfig` by its names, and how fast and how surely they settle.

    ``decay_per_s`` is the slowest decay while touching, stiffness and mass wrong by their factors;
    ``phase_deg`` the largest lag of the damping at the stated ones.
    """

    contact_kd: float
    force_kp: float
    force_ki: float
    normal_kp: float
    normal_kd: float
    path_kp: float
    path_kd: float
    path_ki: float
    approach_speed: float
    decay_per_s: float
    phase_deg: float

    def settings(self) -> dict[str, Any]:
        """What `HybridConfig` takes of them."""
        reported = ("decay_per_s", "phase_deg")
        return {name: value for name, value in vars(self).items() if name not in reported}


def choose_gains(
    loops: Sequence[ContactLoop],
    peak_N: float,
    within_s: float = WITHIN_S,
    force_kp: Sequence[float] = NO_KP,
) -> HybridGains:
    """Gains that hold at each of ``loops``: a scene's lightest and heaviest, softest and hardest.

    Damping along the normal and integral gain are those at which the slowest decay of the sampled
    loop is fastest, stiffness and mass wrong by their factors. Of ``force_kp`` it takes the largest
    at which that decay is at least 0.75 of the fastest at any of them: a surface that moves with an
    acceleration a presses by m a / (1 + force_kp). Only a measured force may be answered so, not
    one that is reconstructed from the axes' own efforts. Path and approach get the stiffest
    gains that keep 45 degrees and a factor of 2 (`scissorcal.device.control`), the approach's no
    integral, and softer where they would be unstable in contact. Its speed is that at which
    touching peaks at ``peak_N``. Raises InputError where no gains let the force settle
    ``within_s``, with the stiffness and the delay that would do.

    >>> loop = ContactLoop(1e4, 0.05, 1.0, 0.0, 1.5e-3, 1e-3, rate_cutoff_Hz=400.0)
    >>> gains = choose_gains([loop], peak_N=1.0)
    >>> round(gains.contact_kd), round(gains.force_ki), round(1e3 * gains.approach_speed)
    (109, 12, 30)
    """
    if not loops:
        raise ValueError("gains are chosen for one loop or more")
    contact, decay = contact_gains(loops, ROUNDS, _largest_kp(loops, force_kp))
    if not decay >= 1.0 / within_s:
        raise InputError(_refusal(loops, within_s, min(force_kp)))
    path = _motion_gains(loops, PATH_INTEGRAL)
    normal = _stable_in_contact(loops, _motion_gains(loops, math.inf))
    if normal is None:
        raise InputError(_refusal(loops, within_s, min(force_kp)))
    return HybridGains(
        contact_kd=contact.contact_kd,
        force_kp=contact.force_kp,
        force_ki=contact.force_ki,
        normal_kp=normal.kp,
        normal_kd=normal.kd,
        path_kp=path.kp,
        path_kd=path.kd,
        path_ki=path.ki,
        approach_speed=approach_speed(loops, peak_N),
        decay_per_s=decay,
        phase_deg=max(loop.phase_deg for loop in loops),
    )


def contact_gains(
    loops: Sequence[ContactLoop], rounds: int = ROUNDS, force_kp: float = 0.0
) -> tuple[ContactGains, float]:
    """Damping and integral gain of the fastest slowest decay, and that decay (1/s; below 0: none).

    Sought on grids, each of ``rounds`` about the best of the one before.
    """
    return _contact_gains(tuple(loops), rounds, force_kp)


@lru_cache(maxsize=64)  # a path's runs ask for the same loops
def _contact_gains(
    loops: tuple[ContactLoop, ...], rounds: int, force_kp: float
) -> tuple[ContactGains, float]:
    most_kd = min(_most_kd(loop) for loop in loops)
    kd = np.array([0.0, *np.geomspace(1e-3 * most_kd, most_kd, GRID - 1)])
    ki = np.geomspace(LEAST_KI_PER_S, MOST_KI_PER_S, GRID)
    best, most = ContactGains(0.0, LEAST_KI_PER_S, force_kp), -math.inf
    for _ in range(rounds):
        gains = [ContactGains(float(one), float(other), force_kp) for one in kd for other in ki]
        found = np.min([contact_decays(loop, gains) for loop in loops], axis=0)
        place = int(np.argmax(found))
        if found[place] > most:
            best, most = gains[place], float(found[place])
        kd, ki = _narrower(kd, best.contact_kd), _narrower(ki, best.force_ki)
    return best, most


def approach_speed(loops: Sequence[ContactLoop], peak_N: float) -> float:
    """Speed (m/s) of an approach whose touch peaks at ``peak_N``.

    A mass that meets a spring presses by v sqrt(k m); TOUCH_FORCE_N comes on top. InputError where
    the peak may not be above that.
    """
    if not peak_N > TOUCH_FORCE_N:
        raise InputError(
            f"Touching is noticed at {TOUCH_FORCE_N:g} N, so that its peak cannot stay within "
            f"{peak_N:g} N: allow a higher one."
        )
    hardest = max(math.sqrt(stiffness * mass) for loop in loops for stiffness, mass in loop.corners)
    return (peak_N - TOUCH_FORCE_N) / hardest


def friction_rates(
    gains: HybridGains, inertia: Sequence[float], dry_friction: Sequence[float]
) -> tuple[float, ...]:
    """Rates of the axes up to which their dry friction is compensated in proportion.

    Compensation in proportion to a rate is negative damping. Here all of ``dry_friction`` would
    just cancel the law's damping of ``inertia`` (each axis's own, D_jj), so that the usual share of
    it leaves damping; a narrower band chatters.

    >>> gains = HybridGains(100.0, 0.0, 10.0, 4e3, 110.0, 4e3, 110.0, 4e4, 0.02, 8.0, 40.0)
    >>> friction_rates(gains, (2e-4, 0.8), (5e-3, 0.8))
    (0.25, 0.01)
    """
    damping = max(LEAST_DAMPING_PER_S, min(gains.contact_kd, gains.path_kd))
    return tuple(dry / (own * damping) for own, dry in zip(inertia, dry_friction, strict=True))


def _largest_kp(loops: Sequence[ContactLoop], force_kp: Sequence[float]) -> float:
    """The largest that is bought with no more than a quarter of the fastest decay."""
    if len(force_kp) == 1:
        return force_kp[0]
    decays = {kp: contact_gains(loops, ROUGH, kp)[1] for kp in force_kp}
    enough = KEPT_DECAY * max(decays.values())
    return max((kp for kp, decay in decays.items() if decay >= enough), default=min(force_kp))


def _most_kd(loop: ContactLoop) -> float:
    """Damping at which a count of the encoder changes the force by no more than it may.

    Its effort lasts a tick, and a mass m on a spring k turns an impulse J into J sqrt(k / m).
    """
    weight = rate_weight(loop.rate_cutoff_Hz, loop.tick_s)
    swing = max(math.sqrt(stiffness / mass) for stiffness, mass in loop.corners)
    per_count = loop.mass_kg * loop.step_m * weight * min(swing, 1.0 / loop.tick_s)
    return min(MOST_KD_PER_S, loop.most_per_count_N / per_count if per_count > 0.0 else math.inf)


def _narrower(grid: NDArray[np.float64], middle: float) -> NDArray[np.float64]:
    """A grid between the neighbours of one of its values."""
    place = int(np.argmin(np.abs(grid - middle)))
    return np.linspace(grid[max(place - 1, 0)], grid[min(place + 1, len(grid) - 1)], len(grid))


def _motion_gains(loops: Sequence[ContactLoop], integral: float) -> Gains:
    """The stiffest gains of place and rate, per mass, that keep the margins at all loops.

    ``integral`` is as in `fastest_design`: infinite for none.
    """
    weakest = Gains(math.inf, 0.0, 0.0)
    for loop in loops:
        axis = Axis(
            inertia=1.0,
            viscous=0.0,
            coulomb=0.0,
            delay_s=loop.delay_s + loop.motor_lag_s,
            tick_s=loop.tick_s,
            step=loop.step_m,
            rate_cutoff_Hz=loop.rate_cutoff_Hz,
            most_per_count=loop.most_per_count_N / loop.mass_kg,
            inertia_factor=loop.mass_factor,
        )
        found = [fastest_design(axis, lead, integral) for lead in LEADS]
        gains = max((one.gains for one in found if one), key=lambda one: one.kp, default=None)
        if gains is None:
            raise InputError(
                f"No path can be followed {1e3 * axis.delay_s:.2g} ms late with counts of "
                f"{1e6 * loop.step_m:.2g} um and {loop.mass_kg:.2g} kg: answer sooner (a shorter "
                "latency timer of the adapter, a faster motor) or take a finer encoder."
            )
        weakest = min(weakest, gains, key=lambda one: one.kp)
    return weakest


def _stable_in_contact(loops: Sequence[ContactLoop], gains: Gains) -> Gains | None:
    """Gains of place and rate, as fast as given or slower, that press stably at all loops."""
    share = 1.0
    while share > SLOWEST:
        slower = Gains(share * share * gains.kp, share * gains.kd, 0.0)
        pressed = [ContactGains(slower.kd, 0.0)]
        if all(contact_decays(loop, pressed, slower.kp)[0] > 0.0 for loop in loops):
            return slower
        share *= SLOWER
    return None


def _has_gains(loops: Sequence[ContactLoop], within_s: float, force_kp: float) -> bool:
    if not contact_gains(loops, ROUGH, force_kp)[1] >= 1.0 / within_s:
        return False
    try:
        gains = _motion_gains(loops, math.inf)
    except InputError:
        return False
    return _stable_in_contact(loops, gains) is not None


def _refusal(loops: Sequence[ContactLoop], within_s: float, force_kp: float) -> str:
    worst = max(loops, key=lambda loop: loop.phase_deg)

    def has_gains(**changes: float) -> bool:
        """Whether there are some with fields of all loops at a share of what they are."""
        changed = [
            replace(loop, **{name: share * getattr(loop, name) for name, share in changes.items()})
            for loop in loops
        ]
        return _has_gains(changed, within_s, force_kp)

    sentence = (
        f"No gains hold a force against {1e-3 * worst.stiffness_N_per_m:.3g} N/mm with "
        f"{worst.mass_kg:.2g} kg along the normal, stiffness and mass wrong by factors of "
        f"{worst.stiffness_factor:g} and {worst.mass_factor:g}: an effort acts "
        f"{1e3 * worst.delay_s:.2g} ms and the motor's {1e3 * worst.motor_lag_s:.2g} ms after the "
        f"measurement that it answers, and damping lags by {worst.phase_deg:.0f} degrees where the "
        "material swings."
    )
    remedies = []
    softer = _figure(
        SOFTER, lambda share: has_gains(stiffness_N_per_m=share), 1e-3 * worst.stiffness_N_per_m
    )
    if softer is not None:
        remedies.append(f"a stiffness of at most {softer:.2g} N/mm")
    if worst.delay_s > 0.0:
        sooner = _figure(SOONER, lambda share: has_gains(delay_s=share), 1e3 * worst.delay_s)
        if sooner is not None:
            remedies.append(f"a delay of at most {sooner:.2g} ms besides the motor's")
    if force_kp > 0.0 and _has_gains(loops, within_s, 0.0):
        remedies.append("no force_kp")
    if not remedies:
        return (
            f"{sentence} Neither softer material nor a shorter delay alone would do: answer "
            "sooner, filter the rate less, or know stiffness and mass better."
        )
    return f"{sentence} What would do: {' or '.join(remedies)}."


def _figure(shares: Sequence[float], holds: Callable[[float], bool], whole: float) -> float | None:
    """Of ``whole`` what the largest share gives, in two digits that hold as they are read."""
    share = _largest(shares, holds)
    while share is not None and share > 0.0:
        value = share * whole
        digit = 10.0 ** (math.floor(math.log10(value)) - 1)
        rounded = float(f"{digit * math.floor(value / digit * (1.0 + 1e-12)):.2g}")
        if holds(rounded / whole):
            return rounded
        share = _largest([one for one in shares if one < share], holds)
    return share


def _largest(shares: Sequence[float], holds: Callable[[float], bool]) -> float | None:
    """About the share up to which something holds from one of ``shares`` on; None for no such.

    Damping that lags by more than a half turn damps again, so that what holds lies in several
    ranges: only the lowest that joins the share found is counted.
    """
    low = next((share for share in shares if holds(share)), None)
    if low is None:
        return None
    high = min((share for share in (1.0, *shares) if share > low), default=1.0)
    step = (high - low) / STEPS
    while low + step < high and holds(low + step):
        low += step
    for _ in range(HALVINGS):
        step *= 0.5
        low += step if holds(low + step) else 0.0
    return low
