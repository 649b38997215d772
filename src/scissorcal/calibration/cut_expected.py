"""What a cut's parameters expect of every bin: mean torque, its spread, and where cracks rest."""

from dataclasses import dataclass
from functools import cache, cached_property

import numpy as np
from numpy.typing import NDArray

from scissorcal.calibration.cut_motion import CutMotion
from scissorcal.model import (
    Cutting,
    Settled,
    Stance,
    damped,
    held_torque,
    settle,
    take_stance,
    torque_of,
)

Array = NDArray[np.float64]

UNEVEN_LENGTH_M = 2e-3
"""Length over which a sheet's toughness is taken to vary: fibres of paper, threads of cloth."""

ACCELERATION_CUTOFF_HZ = 150.0
"""Cutoff of the acceleration's low-pass in a cut, which a ripple passes too."""
SAMPLE_S = 1e-3
UNSTEADY = 0.1
"""Relative spread of a ripple's period in a steady stroke."""

MOST_PERIODS, PER_PERIOD = 4.0, 100

BLOCK_BINS = 8
FARTHEST_REST = 4.0
"""Standard deviations from where it is expected within which a crack is taken to rest."""
SHORTEST_RESTART_M = 2e-5
"""A waiting crack starts over a length that follows from the material's unevenness, at least over
this."""


@dataclass(frozen=True)
class Spread:
    """What the parameters say of spread; scalars, shares unless a unit is given.

    ``variation`` is the unevenness of the material, ``visibility`` and ``period`` are factors on
    the ripple's size and on its periods in a bin. ``rest_phase`` is where cracks come to rest, in
    cycles from the mean place, each of them with a standard deviation of ``rest_spread`` cycles.
    """

    noise_Nm: float
    slow_noise_Nm: float
    variation: float
    visibility: float = 0.0
    period: float = 1.0
    rest_phase: float = 0.0
    rest_spread: float = 0.0


@dataclass(frozen=True)
class Resting:
    """Where the crack rests (rests,): expected ``place`` (m, in the sheet) with its ``sd`` (m)."""

    place: Array
    sd: Array


class Expected:
    """Expected torque at bins (n,) for one set of parameters.

    ``resting`` says where cracks are expected to rest, ``mean`` (n,) is the torque if they do.
    ``slow`` is the variance that bins of a block share, ``fast`` what each has alone, both (n,).
    """

    def __init__(
        self, motion: CutMotion, cutting: Cutting, spread: Spread, stance: Stance | None = None
    ) -> None:
        """Settle the crack along the motion; each sheet is cut from its edge at 0 on.

        ``stance`` is the edge on the motion's openings, where it is known already.
        """
        self.motion, self.cutting, self.spread = motion, cutting, spread
        nodes = motion.nodes
        self.stance = stance or take_stance(cutting.edge, nodes.turned)
        self.settled: Settled | None = None
        if cutting.fracture_energy is not None:
            self.settled = settle(cutting, self.stance)
        self.run, self.breaks, self.resting = self._history()
        self.running_torque = self._running_torque()
        soft = nodes.soft
        self.soft_stance = self.stance.of(soft)
        self.waiting = np.zeros(len(nodes.advance))
        self.torque = self.running_torque.copy()
        self.waiting[soft], self.torque[soft] = self.held_at(
            slice(None), self.soft_stance, np.append(self.resting.place, 0.0)[nodes.rest[soft]]
        )
        self.mean = motion.binned(self.torque)

    def held_at(
        self, which: NDArray[np.int64] | slice, stance: Stance, place: Array
    ) -> tuple[Array, Array]:
        """Share in which a crack at ``place`` (..., k) still waits, and the torque (..., k).

        ``which`` selects soft nodes, ``stance`` is the edge on them. A crack that rests bears what
        the response gives, until that has grown to the peak that starts it; from then on it runs,
        and on average bears less. The local toughness, and with it the moment, is uncertain.
        """
        nodes = self.motion.nodes
        k = nodes.soft[which]
        held = held_torque(self.cutting, stance, place - nodes.advance[k], nodes.rate[k])
        if self.settled is None:
            return np.ones_like(held), held
        share = np.clip((place - self.breaks[k]) / self._restart[which] + 0.5, 0.0, 1.0)
        waits = np.where(nodes.leaving[k], 1.0, share * share * (3.0 - 2.0 * share))
        running = self.running_torque[k]
        return waits, running + waits * (held - running)

    @cached_property
    def borne(self) -> "Borne":
        """What resting cracks bear on, wherever within their spread they rest."""
        nodes, motion = self.motion.nodes, self.motion
        soft = nodes.soft
        rest = nodes.rest[soft]
        margin = FARTHEST_REST * np.append(self.resting.sd, 0.0)[rest]
        place = np.append(self.resting.place, 0.0)[rest]
        late = place + margin + 0.5 * self._restart
        waits = nodes.leaving[soft] | (self.breaks[soft] < late)
        nearest = self.soft_stance.view(place - margin - nodes.advance[soft])
        bears = waits & (margin > 0.0) & (nearest.height < self.cutting.upper_face_m)
        which = np.flatnonzero(bears)
        bins, at = np.unique(nodes.bin[soft[which]], return_inverse=True)
        return Borne(self, which, self.soft_stance.of(which), bins, at, motion.bin_rest[bins])

    def mean_with(self, place: Array) -> Array:
        """Mean torque (n,) if cracks rest at ``place`` (rests,)."""
        mean = self.mean.copy()
        mean[self.borne.bins] += self.borne.change(place[None, :])[0]
        return mean

    @cached_property
    def contact(self) -> Array:
        """Contact x_c (n,): the crack's place, which stays while the blades are away from it."""
        motion, nodes = self.motion, self.motion.nodes
        rested = np.append(self.resting.place, 0.0)[nodes.rest]
        place = np.where((self.waiting > 0.5) | ~np.isfinite(self.run), rested, self.run)
        near = motion.binned(np.ones(len(place))) > 0.0
        index = np.maximum.accumulate(np.where(near, np.arange(len(near)), 0))
        same = near[index] & (motion.bins.sheet[index] == motion.bins.sheet)
        return np.where(same, motion.binned(place)[index], 0.0) - motion.bins.advance

    @cached_property
    def variances(self) -> tuple[Array, Array]:
        """Slow and fast variance of each bin (n,)."""
        motion, spread = self.motion, self.spread
        slow = np.full(len(self.mean), spread.slow_noise_Nm**2)
        fast = np.full(len(self.mean), spread.noise_Nm**2)
        if self.settled is None:
            return slow + (spread.variation * self.mean) ** 2, fast
        running = self.running
        uneven = (spread.variation * running * self.mean) ** 2
        apart = BLOCK_BINS * motion.travel_m / UNEVEN_LENGTH_M
        within = apart / (3.0 + apart)
        fast = fast + uneven * within + (running * self.ripple) ** 2
        return slow + uneven * (1.0 - within), fast

    @cached_property
    def running(self) -> Array:
        """Share of each bin (n,) in which the crack runs on rather than waits."""
        return self.motion.binned(1.0 - self.waiting)

    @cached_property
    def periods(self) -> Array:
        """Cycles of the ripple in each bin (n,), as seen; 0 where nothing ripples."""
        assert self.settled is not None
        nodes, motion = self.motion.nodes, self.motion
        length = self._stroke(self.settled.peak)
        lever = np.where(self.settled.cuts, np.abs(self.settled.view.lever), 0.0)
        sinking = np.abs(nodes.rate) * lever / self.cutting.moving_blades
        cycles = motion.bins.bin_s * self.spread.period * sinking / np.maximum(length, 1e-15)
        return motion.binned(np.where(length > 0.0, cycles, 0.0))

    @cached_property
    def ripple(self) -> Array:
        """Standard deviation of running bins (n,) by the ripple, as seen in their averages.

        See :func:`kept_of_a_saw_tooth`.
        """
        kept = kept_of_a_saw_tooth(self.motion.bins.bin_s)
        at = np.minimum(self.periods, MOST_PERIODS) * PER_PERIOD
        low = np.minimum(at.astype(np.int64), len(kept) - 2)
        kept = kept[low] + (at - low) * (kept[low + 1] - kept[low])
        return np.asarray(self.spread.visibility * self.saw_tooth * kept)

    @cached_property
    def saw_tooth(self) -> Array:
        """Standard deviation of the torque's saw-tooth itself while the crack runs (n,)."""
        assert self.settled is not None
        settled = self.settled
        lever = np.where(settled.cuts, np.abs(settled.view.lever), 0.0)
        depth = (1.0 - np.asarray(self.cutting.kappa)) / np.sqrt(12.0)
        peak = damped(self.cutting, settled.view, settled.peak, self.motion.nodes.rate)
        return self.motion.binned(lever * peak * depth)

    @cached_property
    def cycle(self) -> Array:
        """How far the crack runs in a cycle where it came to rest (rests,), in metres."""
        if self.settled is None:
            return np.zeros(len(self.motion.arrived))
        arrived = self.motion.arrived
        slope = np.where(self.settled.cuts[arrived], self.settled.view.slope[arrived], 1.0)
        return np.asarray(self._stroke(self.settled.peak[arrived]) / slope)

    def _running_torque(self) -> Array:
        """Torque at the nodes (N,) if the crack runs on, on average over its ripple."""
        cutting, nodes = self.cutting, self.motion.nodes
        if self.settled is None:
            return held_torque(cutting, self.stance, self.run - nodes.advance, nodes.rate)
        settled, contact = self.settled, self.run - nodes.advance
        force = np.where(settled.cuts, settled.force, 0.0)
        force = damped(cutting, settled.view, force, nodes.rate)
        torque = torque_of(cutting, settled.view, np.where(settled.cuts, contact, 0.0), force)
        behind = np.flatnonzero(np.isfinite(contact) & (contact != settled.contact))
        torque[behind] = held_torque(
            cutting, self.stance.of(behind), contact[behind], nodes.rate[behind]
        )
        return torque

    def _stroke(self, peak: Array) -> Array:
        """Indentation that one cycle of the ripple takes (m)."""
        if np.all(np.asarray(self.cutting.kappa) >= 1.0):
            return np.zeros_like(peak)
        response = self.cutting.response
        return response.indentation_at(peak) - response.indentation_at(self.cutting.kappa * peak)

    @cached_property
    def _restart(self) -> Array:
        """Length over which a waiting crack starts to run at the soft nodes (k,), in metres."""
        return np.maximum(3.0 * self._uneven(self.motion.nodes.soft), SHORTEST_RESTART_M)

    def _uneven(self, index: NDArray[np.int64]) -> Array:
        """Standard deviation of the place at which a crack starts, by the toughness there (m)."""
        if self.settled is None:
            return np.zeros(len(index))
        response = self.cutting.response
        peak = self.settled.peak[index]
        stiffness = response.stiffness_at(response.indentation_at(peak))
        slope = np.where(self.settled.cuts[index], self.settled.view.slope[index], 1.0)
        return np.asarray(self.spread.variation * peak / (stiffness * slope))

    def _history(self) -> tuple[Array, Array, Resting]:
        """Furthest places since the last rest, and where cracks rest.

        The first (N,) are those at which a running crack settles, the second (N,) those from
        which a waiting one starts: there the force is at its peak.
        """
        motion, nodes, settled = self.motion, self.motion.nodes, self.settled
        run = np.zeros(len(nodes.advance))
        breaks = np.full(len(nodes.advance), -np.inf)
        place = np.zeros(len(motion.arrived))
        if settled is None:
            return run, breaks, Resting(place, np.zeros_like(place))
        tip = settled.contact + nodes.advance
        ahead = tip - self._climb(settled)
        reached = 0.0
        for first, end, rest in motion.spans:
            if rest < 0:
                reached = 0.0
            else:
                place[rest] = reached
            furthest = np.maximum.accumulate(tip[first:end])
            run[first:end] = np.maximum(furthest, 0.0) if rest < 0 else furthest
            breaks[first:end] = np.maximum.accumulate(ahead[first:end])
            if end > first:
                reached = max(reached, float(run[end - 1]))
        begun = place > 0.0
        sd = np.hypot(self.spread.rest_spread * self.cycle, self._uneven(motion.arrived))
        place = place + np.where(begun, self.spread.rest_phase * self.cycle, 0.0)
        return run, breaks, Resting(place, np.where(begun, sd, 0.0))

    def _climb(self, settled: Settled) -> Array:
        """How much nearer a crack stands at its peak force than where it settles (N,), in m."""
        if np.all(np.asarray(self.cutting.kappa) >= 1.0):
            return np.zeros_like(settled.peak)
        response = self.cutting.response
        deeper = response.indentation_at(settled.peak) - response.indentation_at(settled.force)
        return np.asarray(deeper / np.where(settled.cuts, settled.view.slope, 1.0))


@dataclass(frozen=True)
class Borne:
    """The nodes (k,) and bins (b,) that bear on resting cracks.

    ``which`` (k,) selects the motion's soft nodes, ``at`` (k,) is a node's place among ``bins``,
    ``rest`` (b,) the rest of each bin.
    """

    expected: Expected
    which: NDArray[np.int64]
    stance: Stance
    bins: NDArray[np.int64]
    at: NDArray[np.int64]
    rest: NDArray[np.int64]

    def change(self, place: Array) -> Array:
        """Change of the mean torque (tries, b) if cracks rest at ``place`` (tries, rests)."""
        expected, nodes = self.expected, self.expected.motion.nodes
        k = nodes.soft[self.which]
        _, torque = expected.held_at(self.which, self.stance, place[:, nodes.rest[k]])
        parts = nodes.weight[k] * (torque - expected.torque[k])
        tries, count = len(place), len(self.bins)
        at = self.at + count * np.arange(tries)[:, None]
        summed = np.bincount(at.ravel(), weights=parts.ravel(), minlength=tries * count)
        return np.asarray(summed, dtype=np.float64).reshape(tries, count)


@cache
def kept_of_a_saw_tooth(bin_s: float) -> Array:
    """Share of a saw-tooth's standard deviation that bins keep, at its periods in a bin.

    By ``PER_PERIOD`` values to the period, from 0 to ``MOST_PERIODS``.

    Blades that are not held yield to a ripple faster than their controller: then it shows in
    their acceleration, which is low-passed forwards and backwards and differenced twice. The k-th
    harmonic, 1 / k^2 of the variance, at the frequency f = k r / bin keeps sinc(k r)^2 of it by
    the averaging over a bin, 1 / (1 + (f / cutoff)^8)^2 by the filter and sinc(2 f dt)^4 by the
    differences over samples dt apart. The speed of a crack is never steady, so that the variance is
    averaged over a tenth of r about each r.
    """
    periods = np.linspace(0.0, MOST_PERIODS, round(MOST_PERIODS * PER_PERIOD) + 1)
    fine = np.linspace(0.0, 1.5 * MOST_PERIODS, 1201)
    harmonic = np.arange(1, 80)[:, None]
    frequency = harmonic * fine / bin_s
    passed = 1.0 / (1.0 + (frequency / ACCELERATION_CUTOFF_HZ) ** 8)
    passed = passed * np.sinc(2.0 * frequency * SAMPLE_S) ** 2 * np.sinc(harmonic * fine)
    variance = 6.0 / np.pi**2 * np.sum((passed / harmonic) ** 2, axis=0)
    width = np.maximum(UNSTEADY * periods[:, None], 5e-3)
    weight = np.exp(-0.5 * ((fine - periods[:, None]) / width) ** 2)
    return np.asarray(np.sqrt((weight @ variance) / weight.sum(axis=1)))
