"""Least squares in pushes and prior: residuals, their derivatives, modes and a posterior there."""

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from scissorcal.aliases import Array
from scissorcal.device.probe.idle import correlation_time
from scissorcal.device.probe.joint_values import (
    HIGH,
    LATE_S,
    LOW,
    NAMES,
    WORDS,
    JointFit,
    Prior,
    Push,
    joint_of,
    joints_of,
    perturbed,
    prior_of,
    starts_of,
)
from scissorcal.kernel.joint import follow_joint, follow_joints
from scissorcal.recording.probe import Swing

COAST_S, TRAVEL_STEP_S = 0.15, 1e-3
LONGEST = 6
"""Swings whose own fit begins the search of all: three pairs that go to the aim tell inertia and
lag apart (`swings.LEAST_PAIRS`)."""


def fit_joint(
    pushes: Sequence[Push],
    prior: Prior,
    noise_rad: float,
    start: Array | None = None,
    modes: bool = True,
) -> JointFit:
    """Fit all pushes together, from ``start`` or from what the longest swings tell.

    ``noise_rad`` is the sd of the encoder: step and jitter. The best mode is returned. ``modes``:
    others are sought around it and from the longest swings, and one that explains the pushes as
    well widens its interval; a fit that only plans the next push does without, at a fifth of the
    time.
    """
    problem = Problem(pushes, prior, noise_rad)
    found = []
    if start is not None:
        around = perturbed(start, prior.stop) if modes else []
        found += problem.best_of([start, *around])
    if start is None or modes:
        found += [problem.solved(x) for x in _of_longest(pushes, prior, noise_rad)]
    best = min(found, key=lambda one: one[1])
    if problem.rescale(best[0]):
        found = [problem.solved(best[0])]
        if modes:
            found += problem.best_of(perturbed(found[0][0], prior.stop))
    best = min(found, key=lambda one: one[1])
    problem.vary(best[0])
    fit = problem.posterior(best[0])
    others = [x for x, cost in found if cost < best[1] + 3.0 * problem.repeated]
    spread = np.array([x - fit.values for x in others])
    widened = fit.covariance + spread.T @ spread / max(len(others), 1)
    return replace(fit, covariance=widened)


def _of_longest(pushes: Sequence[Push], prior: Prior, noise_rad: float) -> list[Array]:
    """Modes of the longest swings alone, which slide most of their way.

    Pushes near breakaway stand or go by the value of their friction: their residuals jump, and a
    search of all pushes ends where it jumps, with a lag in place of the inertia for example.
    """
    ways = sorted((push.way for push in pushes if push.rested), reverse=True)
    longest = [push for push in pushes if push.rested and push.way >= ways[:LONGEST][-1]]
    problem = Problem(longest, prior, noise_rad)
    return [x for x, _ in problem.best_of(starts_of(pushes, prior))]


def swings_of(
    pushes: Sequence[Push], prior: Prior, noise_rad: float, values: Array, most: int
) -> tuple[Swing, ...]:
    """The strongest ``most`` pushes in their order, thinned, beside the joint of ``values``."""
    problem = Problem(pushes, prior, noise_rad)
    parts = problem.parts(values)
    ranked = sorted(range(len(parts)), key=lambda place: -abs(parts[place].torque_Nm))
    return tuple(parts[place] for place in sorted(ranked[:most]))


def travel_of(
    values: Array, effort: float, seconds: float, hold: float = 0.0, stop: int = 0
) -> tuple[float, float]:
    """Largest way (rad) and rate (rad/s) of a push of ``hold + effort`` for ``seconds`` from rest.

    ``hold`` acts before and after, as in `push`.
    """
    joint = joint_of(values, stop)
    joint = replace(joint, carrying=joint.carrying + hold)
    times = np.arange(0.0, seconds + COAST_S, TRAVEL_STEP_S)
    rests = np.full(len(times), np.nan)
    rests[0] = 0.0
    switches = np.array([0.0, seconds])
    places = follow_joint(joint, times, rests, switches, np.array([effort, 0.0]), STEP_S)
    rates = np.diff(places) / TRAVEL_STEP_S
    return float(np.abs(places).max()), float(np.abs(rates).max())


STEP_S = 2.5e-4
"""Longest step of the simulation; a tenth of the fastest motor lag that matters would be shorter,
but the lag is followed exactly and the rate changes by less than 2 % in one."""
WAY_SHARE = 0.012
"""Of the way of a push: what two lengths of presliding leave of bristles of other shape."""
LEAST_SHARE, RESCALED_BELOW = 0.1, 0.7
"""Of WAY_SHARE and SHAPE_RAD: a law that holds to 0.1 % of the way is not told from the encoder's
errors; and above 0.7 another fit would move nothing by a standard deviation."""
FRICTION_SD = 0.03
"""Share by which friction differs from push to push: cogging, and friction along the angle."""
SHAPE_RAD = 1e-5
"""The same of the shortest way that yields (0.1 mrad), which all pushes have."""
STOP_SHAPE_RAD = 5e-5
"""The same of a stop, how it gives and damps: a quarter of the 0.2 mrad by which 10 mN m press
blades into rubber of 50 N m/rad."""
MOST_SAMPLES, LONGEST_S = 120, 0.3
STRANGE_SDS = 4.0
RUNAWAY_RAD = 1e3
"""A joint on a falling slope may run away in a trial of the search: so far and no farther."""
FIRST_EVALUATIONS, EVALUATIONS, ROUNDS, KEPT, KEPT_STOP = 8, 60, 2, 2, 4
"""Off a stop twice as many modes are kept: pushes of 5 mrad leave two or three there."""
GAINED = 1.0
"""Of the log posterior: less does not tell modes apart."""


class Problem:
    """Residuals of pushes and prior, their derivatives, and the least squares in them."""

    def __init__(self, pushes: Sequence[Push], prior: Prior, noise_rad: float) -> None:
        pushes = [_thinned(push) for push in pushes]
        self._times = np.concatenate([push.times for push in pushes])
        self._places = np.concatenate([push.places for push in pushes])
        self._at = np.concatenate([push.at for push in pushes])
        self._torques = np.concatenate([push.torques for push in pushes])
        self._rests = np.full(len(self._times), np.nan)
        begin = np.cumsum([0, *(len(push.times) for push in pushes)])
        self._begin = begin
        self._rests[begin[:-1]] = [_rest_of(push) if push.rested else math.nan for push in pushes]
        self._rests[0] = _rest_of(pushes[0])
        turn = float(np.mean(self._places))
        self._turn = turn
        self._pushes, self._noise, self._stop = pushes, noise_rad, prior.stop
        self._way = max(float(np.ptp(push.places)) for push in pushes)
        self._plain_sd: Array | None = None
        self._friction_sd = FRICTION_SD
        self._sd = np.concatenate([_errors_of(push, noise_rad, prior.stop) for push in pushes])
        self._known = noise_rad / self._sd
        self._effects = np.zeros((len(self._sd), 2))
        self._shrunk: Array | None = None
        self._evidence = 0.0
        self.repeated = 1.0  # how many times over a posterior counts what residuals tell
        self._mean, self._prior_sd = prior_of(prior)

    def rescale(self, x: Array) -> bool:
        """Lower the errors of the law to what the residuals at ``x`` show; False where they fit.

        Without it a joint that follows the law would be told by the prior, not by its motion.
        """
        n = len(self._times)
        self.vary(x)
        misfit = float(np.mean(self._residuals(x)[:n] ** 2))
        share = min(1.0, max(LEAST_SHARE, math.sqrt(misfit)))
        if share > RESCALED_BELOW:
            return False
        self._plain_sd = self._sd
        self._friction_sd = share * FRICTION_SD
        self._sd = np.concatenate(
            [_errors_of(push, self._noise, self._stop, share) for push in self._pushes]
        )
        self._known = self._noise / self._sd
        return True

    def vary(self, x: Array) -> None:
        """Let each push begin a reading off and rub a few percent more or less, near ``x``.

        Its residuals then have the covariance D + V V^T, of the place at which it began and of what
        a share of the friction does to it; that of a weak push is most of its way.
        """
        more = x.copy()
        more[NAMES.index("log_coulomb")] += self._friction_sd
        plain, more_rubbed = self._places_of(np.array([x, more]))
        rubbed = (plain - more_rubbed) / self._sd
        columns = np.column_stack([self._known, rubbed])
        shrunk, evidence = [], 0.0
        for a, b in zip(self._begin[:-1], self._begin[1:], strict=True):
            u, s, _ = np.linalg.svd(columns[a:b], full_matrices=False)
            self._effects[a:b, : len(s)] = u
            root = np.sqrt(1.0 + s**2)
            shrunk.append(np.resize(1.0 - 1.0 / root, 2))
            evidence += float(np.log(root).sum())
        self._shrunk, self._evidence = np.array(shrunk), evidence

    def best_of(self, starts: Sequence[Array]) -> list[tuple[Array, float]]:
        """Modes from the KEPT starts that are the best after a few evaluations."""
        self._shrunk, self._evidence = None, 0.0
        begun = [self._climbed(start, FIRST_EVALUATIONS) for start in starts]
        begun.sort(key=lambda one: one[1])
        return [self.solved(x) for x, _ in begun[: KEPT_STOP if self._stop else KEPT]]

    def solved(self, start: Array) -> tuple[Array, float]:
        """Values at a mode and minus the log of its posterior, up to a constant.

        The pushes' covariance is that at the values themselves, so that modes compare: a search
        with one of elsewhere is repeated from where it ended, while that helps.
        """
        self.vary(start)
        best, least = start, math.inf
        for _ in range(ROUNDS):
            found = self._climbed(best, EVALUATIONS)[0]
            self.vary(found)
            cost = 0.5 * float(np.sum(self._residuals(found) ** 2)) + self._evidence
            gained = least - cost
            if gained > 0.0:
                best, least = found, cost
            if gained < GAINED:
                break
        return best, least

    def _climbed(self, start: Array, evaluations: int) -> tuple[Array, float]:
        from scipy.optimize import least_squares

        done = least_squares(
            self._residuals,
            start,
            jac=self._jacobian,
            method="lm",
            x_scale=self._prior_sd,
            max_nfev=evaluations,
            ftol=1e-4,
            xtol=1e-6,
            gtol=1e-8,
        )
        return np.clip(done.x, LOW, HIGH), float(done.cost) + self._evidence

    def parts(self, x: Array) -> list[Swing]:
        """Each push beside the joint of ``x``, from where it began."""
        model = self._places_of(x[None, :])[0]
        found = []
        for push, a, b in zip(self._pushes, self._begin[:-1], self._begin[1:], strict=True):
            torque = float(push.torques[np.argmax(np.abs(push.torques))])
            columns = (
                self._times[a:b] - self._times[a],
                self._places[a:b] - self._places[a],
                model[a:b] - self._places[a],
            )
            times, places, goes = (tuple(np.round(one, 7).tolist()) for one in columns)
            found.append(Swing(torque, times, places, goes))
        return found

    def posterior(self, x: Array) -> JointFit:
        """The posterior near a mode."""
        residuals, jacobian = self._residuals(x), self._jacobian(x)
        n = len(self._times)
        data, rest = jacobian[:n], residuals[:n]
        precision = np.diag(1.0 / self._prior_sd**2)
        curvature = data.T @ data + precision
        inverse = np.linalg.pinv(curvature, hermitian=True)
        misfit = float(np.mean(rest**2))
        pieces = zip(self._begin[:-1], self._begin[1:], strict=True)
        gradients = np.array([data[a:b].T @ rest[a:b] for a, b in pieces])
        count = len(gradients)
        meat = gradients.T @ gradients * count / max(count - 1, 1) + precision
        sandwich = inverse @ meat @ inverse
        self.repeated = max(misfit * 2.0 * correlation_time(rest), 1.0)
        inflated = inverse * self.repeated
        scale = np.sqrt(np.maximum(1.0, np.diag(sandwich) / np.maximum(np.diag(inflated), 1e-30)))
        delay, lag = NAMES.index("delay"), NAMES.index("log_lag")
        out = np.abs(x - self._mean) / self._prior_sd > STRANGE_SDS
        out[delay] = False  # it is told with the lag, and judged with it
        out |= (x <= LOW) | (x >= HIGH)  # as `_climbed` clips them
        out[lag] = x[lag] > math.log(LATE_S)  # many motors have none that shows
        strange = tuple(
            f"{WORDS[name]} of {math.exp(value) if name.startswith('log') else value:.2g}"
            for name, value, wrong in zip(NAMES, x, out, strict=True)
            if wrong and name in WORDS
        )
        plain = self._sd if self._plain_sd is None else self._plain_sd
        stated = float(np.mean((rest * self._sd / plain) ** 2))
        covariance = inflated * np.outer(scale, scale)
        return JointFit(x, covariance, stated, strange, self._stop, self._way)

    def _places_of(self, several: Array) -> Array:
        """Places (k, samples) of vectors (k, names) whose delay is that of the first."""
        inside = np.clip(several, LOW, HIGH)
        at = self._at + inside[0, NAMES.index("delay")]
        joints = joints_of(inside, self._turn, self._stop)
        places = follow_joints(joints, self._times, self._rests, at, self._torques, STEP_S)
        return np.nan_to_num(np.clip(places, -RUNAWAY_RAD, RUNAWAY_RAD), nan=RUNAWAY_RAD)

    def _residuals(self, x: Array) -> Array:
        return np.asarray(self._weighed(self._places_of(x[None, :]), x[None, :])[0])

    def _weighed(self, places: Array, several: Array) -> Array:
        """Residuals (k, samples and names) of pushes and prior, in units of their errors."""
        off = np.clip((self._places - places) / self._sd, -1e6, 1e6)
        if self._shrunk is not None:
            begin, sizes = self._begin[:-1], np.diff(self._begin)
            for effect, shrunk in zip(self._effects.T, self._shrunk.T, strict=True):
                along = np.add.reduceat(effect * off, begin, axis=1)
                off = off - effect * np.repeat(along * shrunk, sizes, axis=1)
        return np.hstack([off, (several - self._mean) / self._prior_sd])

    def _jacobian(self, x: Array) -> Array:
        """Differences over a thousandth of the prior; only a delay moves the commands in time."""
        steps = 1e-3 * self._prior_sd
        moved = x + np.vstack([np.zeros(len(x)), np.diag(steps)])
        late = 1 + NAMES.index("delay")
        together = np.delete(np.arange(len(moved)), late)
        places = np.empty((len(moved), len(self._times)))
        places[together] = self._places_of(moved[together])
        places[late] = self._places_of(moved[[late]])[0]
        rows = self._weighed(places, moved)
        return np.asarray((rows[1:] - rows[0]).T / steps)


def _errors_of(push: Push, noise_rad: float, stop: int, share: float = 1.0) -> Array:
    """Standard deviations of a push's readings; one that repeats the last tells nothing new."""
    changed = np.flatnonzero(np.diff(push.places, prepend=math.nan) != 0.0)
    lasting = np.diff(changed, append=len(push.places))
    repeated = np.repeat(lasting, lasting)
    law = share * (WAY_SHARE * push.way + SHAPE_RAD) + abs(stop) * STOP_SHAPE_RAD
    return np.asarray(np.hypot(noise_rad * np.sqrt(repeated), law), dtype=np.float64)


def _thinned(push: Push) -> Push:
    """The begin of a push, at most MOST_SAMPLES of it.

    What lies between hardly moves the posterior; later than LONGEST_S blades that swing on what
    yields add errors of its shape alone.
    """
    count = int(np.searchsorted(push.times, push.times[0] + LONGEST_S))
    every = -(-count // MOST_SAMPLES)
    return replace(push, times=push.times[:count:every], places=push.places[:count:every])


def _rest_of(push: Push) -> float:
    """Where the blades stood before the push: the mean until the first command arrives."""
    first = push.at[np.flatnonzero(push.torques != push.torques[0])[:1]]
    before = push.times <= (first[0] if len(first) else push.times[0])
    return float(np.mean(push.places[before])) if before.any() else float(push.places[0])
