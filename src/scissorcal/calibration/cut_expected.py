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
SHORTEST_RESTART_M = 1e-4
"""A crack that starts again passes from resting to running over one cycle, at least over this."""


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
        self.run, self.resting = self._history()
        self.place = self._places(self.resting.place)
        self.torque = self._torque()
        self.mean = motion.binned(self.torque)

    @cached_property
    def borne(self) -> "Borne":
        """What resting cracks bear on, wherever within their spread they rest."""
        nodes, motion = self.motion.nodes, self.motion
        soft = nodes.soft
        rest = nodes.rest[soft]
        margin = FARTHEST_REST * self.resting.sd[rest]
        place = self.resting.place[rest]
        waits = nodes.leaving[soft] | (self.run[soft] < place + margin)
        nearest = self.stance.of(soft).view(place - margin - nodes.advance[soft])
        soft = soft[waits & (margin > 0.0) & (nearest.height < self.cutting.upper_face_m)]
        bins, which = np.unique(nodes.bin[soft], return_inverse=True)
        return Borne(self, soft, self.stance.of(soft), bins, which, motion.bin_rest[bins])

    def mean_with(self, place: Array) -> Array:
        """Mean torque (n,) if cracks rest at ``place`` (rests,)."""
        mean = self.mean.copy()
        mean[self.borne.bins] += self.borne.change(place[None, :])[0]
        return mean

    @cached_property
    def contact(self) -> Array:
        """Contact x_c (n,) where the blades are near the crack, 0 elsewhere."""
        return self.motion.binned(self.place - self.motion.nodes.advance)

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
        """Share of each bin (n,) in which the crack runs on rather than rests.

        A crack that rested at a phase that nobody knows starts again within a cycle.
        """
        nodes, motion = self.motion.nodes, self.motion
        rested = np.append(self.resting.place, 0.0)[nodes.rest]
        length = np.append(np.maximum(self.cycle, SHORTEST_RESTART_M), SHORTEST_RESTART_M)
        gone = np.where(nodes.leaving, -1.0, (self.run - rested) / length[nodes.rest])
        share = np.clip(gone + 0.5, 0.0, 1.0)
        return motion.binned(share * share * (3.0 - 2.0 * share))

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
        return self.motion.binned(lever * settled.peak * depth)

    @cached_property
    def cycle(self) -> Array:
        """How far the crack runs in a cycle where it came to rest (rests,), in metres."""
        if self.settled is None:
            return np.zeros(len(self.motion.arrived))
        arrived = self.motion.arrived
        slope = np.where(self.settled.cuts[arrived], self.settled.view.slope[arrived], 1.0)
        return np.asarray(self._stroke(self.settled.peak[arrived]) / slope)

    def _torque(self) -> Array:
        """Torque at the nodes (N,): of the settled force where the crack just stands."""
        cutting, nodes, contact = (
            self.cutting,
            self.motion.nodes,
            self.place - self.motion.nodes.advance,
        )
        if self.settled is None:
            return held_torque(cutting, self.stance, contact, nodes.rate)
        settled = self.settled
        view = settled.view
        force = settled.force
        if np.any(cutting.rate_damping):
            force = damped(cutting, view, force, nodes.rate)
        torque = torque_of(cutting, view, settled.contact, np.where(settled.cuts, force, 0.0))
        waits = np.flatnonzero(contact != settled.contact)
        torque[waits] = held_torque(
            cutting, self.stance.of(waits), contact[waits], nodes.rate[waits]
        )
        return torque

    def _stroke(self, peak: Array) -> Array:
        """Indentation that one cycle of the ripple takes (m)."""
        if np.all(np.asarray(self.cutting.kappa) >= 1.0):
            return np.zeros_like(peak)
        response = self.cutting.response
        return response.indentation_at(peak) - response.indentation_at(self.cutting.kappa * peak)

    def _places(self, resting: Array) -> Array:
        nodes = self.motion.nodes
        rested = np.append(resting, -np.inf)[nodes.rest]
        return np.where(nodes.leaving, rested, np.maximum(rested, self.run))

    def _uneven(self) -> Array:
        """Standard deviation of a resting place (rests,) by the toughness there, in metres."""
        assert self.settled is not None
        arrived, response = self.motion.arrived, self.cutting.response
        peak = self.settled.peak[arrived]
        stiffness = response.stiffness_at(response.indentation_at(peak))
        slope = np.where(self.settled.cuts[arrived], self.settled.view.slope[arrived], 1.0)
        return np.asarray(self.spread.variation * peak / (stiffness * slope))

    def _history(self) -> tuple[Array, Resting]:
        """Furthest settled place since the last rest (N,), and where cracks rest."""
        motion, nodes = self.motion, self.motion.nodes
        run = np.zeros(len(nodes.advance))
        place = np.zeros(len(motion.arrived))
        if self.settled is None:
            return run, Resting(place, np.zeros_like(place))
        tip = self.settled.contact + nodes.advance
        reached = 0.0
        for first, end, rest in motion.spans:
            if rest < 0:
                reached = 0.0
            else:
                place[rest] = reached
            furthest = np.maximum.accumulate(tip[first:end])
            run[first:end] = np.maximum(furthest, 0.0) if rest < 0 else furthest
            if end > first:
                reached = max(reached, float(run[end - 1]))
        begun = place > 0.0
        sd = np.hypot(self.spread.rest_spread * self.cycle, self._uneven())
        place = place + np.where(begun, self.spread.rest_phase * self.cycle, 0.0)
        return run, Resting(place, np.where(begun, sd, 0.0))


@dataclass(frozen=True)
class Borne:
    """The nodes (k,) and bins (b,) that bear on resting cracks.

    ``which`` (k,) is a node's place among ``bins``, ``rest`` (b,) the rest of each bin.
    """

    expected: Expected
    nodes: NDArray[np.int64]
    stance: Stance
    bins: NDArray[np.int64]
    which: NDArray[np.int64]
    rest: NDArray[np.int64]

    def change(self, place: Array) -> Array:
        """Change of the mean torque (tries, b) if cracks rest at ``place`` (tries, rests)."""
        expected, nodes, k = self.expected, self.expected.motion.nodes, self.nodes
        rested = place[:, nodes.rest[k]]
        here = np.where(nodes.leaving[k], rested, np.maximum(rested, expected.run[k]))
        contact = here - nodes.advance[k]
        torque = held_torque(expected.cutting, self.stance, contact, nodes.rate[k])
        parts = nodes.weight[k] * (torque - expected.torque[k])
        tries, count = len(place), len(self.bins)
        at = self.which + count * np.arange(tries)[:, None]
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
