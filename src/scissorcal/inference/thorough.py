"""Independent ensembles of walkers, run until they are long, stable and agree."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import cast

import numpy as np

from scissorcal.aliases import Array
from scissorcal.inference.checkpoint import RandomState, Walk, load_walks, save_walks
from scissorcal.inference.mixture import Mixture
from scissorcal.inference.posterior import InferOptions
from scissorcal.inference.problem import NotFiniteError, SamplingStatus, TimeUsedUpError

ENSEMBLES = 4
LONG = 100.0
"""Steps wanted, in autocorrelation times."""

STABLE = 0.05
"""Largest relative change of an autocorrelation time between two looks."""

AGREEING = 1.01
"""Largest R-hat between ensembles (Vehtari et al. 2021, doi:10.1214/20-BA1221)."""

BURN_IN = 0.1
"""Share of the steps that is left out at the beginning."""

BLOCK = 256
"""Steps between two checkpoints."""

GROWTH = 1.25
"""How much longer a chain gets between two looks at its convergence."""

MOST_STORED = 4096
"""Stored steps beyond which every other one is dropped: those are a few per autocorrelation."""

LEAST_BLOCKS = 2
DISAGREEING_AFTER = 5.0
"""Ensembles that disagree although they are this many times longer than needed never agree."""

STUCK_STEPS = 4 * BLOCK
"""A parameter that has not moved after so many steps never will."""

STRETCHES = 0.2
"""Share of moves along the line to one other walker, which do well where scales change."""

JUMPS = 0.1
"""Share of moves by a whole difference between two walkers, which lead from mode to mode."""


@dataclass(frozen=True)
class Chains:
    """Stored walks after burn-in (ensembles, steps, walkers, p) and what they say of themselves.

    ``tau`` (p,) is the integrated autocorrelation time in steps, NaN for a parameter that never
    moved; ``r_hat`` (p,) compares ensembles, each split in half; ``effective`` counts independent
    draws of the worst parameter. ``acceptance`` is the share of moves that were accepted.
    """

    draws: Array
    tau: Array
    r_hat: Array
    effective: float
    acceptance: float
    steps: int
    status: SamplingStatus


def _walkers_for(size: int) -> int:
    """Walkers of one ensemble over ``size`` parameters; even, and more than twice as many."""
    return max(16, 2 * size + 4)


def fewest_evaluations(size: int) -> int:
    """Evaluations below which ensembles over ``size`` parameters come to no end that counts."""
    return ENSEMBLES * _walkers_for(size) * 6 * BLOCK


def run_ensembles(
    log_posterior: Callable[[Array], float],
    proposal: Mixture,
    rng: np.random.Generator,
    options: InferOptions,
    many: Callable[[Array], Array] | None = None,
) -> Chains:
    """Sample a posterior with four independent ensembles of walkers (emcee).

    Seven moves in ten are along differences between two other walkers (ter Braak 2006,
    doi:10.1007/s11222-006-8769-1), one is by a whole such difference, two stretch the line to one
    other walker (Goodman and Weare 2010, doi:10.2140/camcos.2010.5.65). Walkers begin as draws of
    ``proposal``. The run ends when what follows the burn-in is longer than 100 autocorrelation
    times of every parameter, those times have settled, and the ensembles agree; or when the
    budget of ``options`` is used up. Its checkpoint is written after every 256 steps; where it
    exists, the run goes on from there exactly as if it had never stopped. Randomness comes from
    ``rng`` alone. ``many`` gives the log-posterior of points (k, p) at once, shape (k,), where that
    is cheaper. An evaluation that raises TimeUsedUpError ends the run as a used-up budget does; it
    is raised on where nothing can be judged yet.

    Raises NotFiniteError where too few finite starts are found, CheckpointError where the
    checkpoint belongs to another posterior or cannot be read, and ValueError where the budget is
    less than one block.
    """
    tell = options.progress or (lambda done, sentence: None)
    budget, checkpoint = options.budget or 0, options.checkpoint
    walks = [_begin(log_posterior, proposal, rng) for _ in range(ENSEMBLES)]
    if checkpoint is not None and checkpoint.exists():
        walks = load_walks(checkpoint, log_posterior, walks[0].coords.shape)
    per_step = sum(len(walk.coords) for walk in walks)
    if walks[0].steps == 0 and budget < BLOCK * per_step:
        raise ValueError(
            f"A budget of {budget} evaluations is less than the first {BLOCK} steps take, which "
            f"is {BLOCK * per_step}: give more, or use standard effort."
        )
    chains = _look(walks) if walks[0].steps else None
    while chains is None or chains.status is SamplingStatus.BUDGET_USED_UP:
        if (walks[0].steps + BLOCK) * per_step > budget:
            return chains or _judged(walks)
        try:
            walks = [_advance(walk, log_posterior, many) for walk in walks]
        except TimeUsedUpError:
            if walks[0].steps == 0:
                raise
            return replace(_judged(walks), status=SamplingStatus.BUDGET_USED_UP)
        if checkpoint is not None:
            save_walks(checkpoint, walks)
        chains = _look(walks)
        if chains is not None:
            tell(*_words(chains))
    return chains


def _look(walks: list[Walk]) -> Chains | None:
    """Judge walks at steps that depend on nothing but their number; None at others."""
    blocks, due = walks[0].steps // BLOCK, LEAST_BLOCKS
    while due < blocks:
        due = max(due + 1, int(GROWTH * due))
    return _judged(walks) if due == blocks else None


def _judged(walks: list[Walk]) -> Chains:
    chain = np.stack([walk.chain for walk in walks])
    thin, steps = walks[0].thin, walks[0].steps
    kept = chain[:, int(np.ceil(BURN_IN * chain.shape[1])) :]
    ensembles, stored, walkers, size = kept.shape
    tau = thin * _autocorrelation_time(kept)
    before = thin * _autocorrelation_time(kept[:, : int(0.8 * stored)])
    moved = np.isfinite(tau)
    r_hat = np.full(size, np.nan)
    for index in np.flatnonzero(moved):
        r_hat[index] = rank_r_hat(kept[..., index].reshape(ensembles, -1))
    longest = float(np.max(tau)) if np.all(moved) else np.inf
    still = np.ptp(kept, axis=1).max(axis=-1) == 0
    long = thin * stored > LONG * longest and not np.any(still)
    stable = bool(np.all(np.abs(tau - before) < STABLE * tau)) if np.all(moved) else False
    if not np.all(moved):
        late = steps >= STUCK_STEPS
        status = SamplingStatus.STUCK if late else SamplingStatus.BUDGET_USED_UP
    elif not (long and stable):
        status = SamplingStatus.BUDGET_USED_UP
    elif np.all(r_hat < AGREEING):
        status = SamplingStatus.CONVERGED
    else:
        far = thin * stored > DISAGREEING_AFTER * LONG * longest
        status = SamplingStatus.DISAGREEING if far else SamplingStatus.BUDGET_USED_UP
    accepted = sum(walk.accepted for walk in walks) / (steps * walkers * ensembles)
    effective = ensembles * walkers * thin * stored / max(longest, 1.0)
    return Chains(kept, tau, r_hat, effective, float(accepted), steps, status)


def _autocorrelation_time(chain: Array) -> Array:
    """Integrated autocorrelation time of each parameter in stored steps; NaN where none moves."""
    from emcee.autocorr import integrated_time

    ensembles, stored, walkers, size = chain.shape
    every = np.moveaxis(chain, 0, 1).reshape(stored, ensembles * walkers, size)
    moves = np.ptp(every, axis=0) > 0
    tau = np.full(size, np.nan)
    for index in np.flatnonzero(moves.any(axis=0)):
        moving = every[:, moves[:, index], index]
        tau[index] = max(float(integrated_time(moving[..., None], tol=0)[0]), 1.0)
    return tau


def rank_r_hat(draws: Array) -> float:
    """Rank-normalised split R-hat of one parameter, from draws of shape (ensembles, draws).

    The larger of the value for location and for scale (doi:10.1214/20-BA1221); 1 where all
    ensembles agree. NaN where nothing tells: fewer than four draws each, or one value throughout.
    """
    half = draws.shape[1] // 2
    if half < 2 or np.all(draws == draws.flat[0]):
        return float("nan")
    split = np.concatenate([draws[:, :half], draws[:, -half:]])
    return max(_split_r_hat(split), _split_r_hat(np.abs(split - np.median(split))))


def _split_r_hat(draws: Array) -> float:
    from scipy.special import ndtri
    from scipy.stats import rankdata

    ranks = rankdata(draws, axis=None).reshape(draws.shape)
    scores = ndtri((ranks - 0.375) / (draws.size + 0.25))
    count = draws.shape[1]
    within = scores.var(axis=1, ddof=1).mean()
    between = count * scores.mean(axis=1).var(ddof=1)
    if within <= np.finfo(float).eps * between:
        return float("inf") if between > 0.0 else 1.0
    return float(np.sqrt((between / within + count - 1) / count))


def _words(chains: Chains) -> tuple[float, str]:
    if not np.all(np.isfinite(chains.tau)):
        return 0.0, f"{chains.steps} steps, and a parameter has not moved yet"
    share = (1 - BURN_IN) * chains.steps / float(chains.tau.max())
    return min(share / LONG, 1.0), (
        f"{chains.steps} steps, {share:.0f} of {LONG:.0f} autocorrelation times, "
        f"R-hat {chains.r_hat.max():.3f}"
    )


def _begin(
    log_posterior: Callable[[Array], float], proposal: Mixture, rng: np.random.Generator
) -> Walk:
    """Walkers spread as the proposal says, each where the posterior is finite."""
    wanted = _walkers_for(proposal.centres.shape[1])
    coords: list[Array] = []
    heights: list[float] = []
    for _ in range(50 * wanted):
        draw = proposal.draw(1, rng)[0]
        height = log_posterior(draw)
        if np.isfinite(height):
            coords.append(draw)
            heights.append(height)
        if len(coords) == wanted:
            break
    else:
        raise NotFiniteError(
            f"Of {50 * wanted} draws around the optimum only {len(coords)} have a finite "
            "log-posterior, too few to begin from: check the bounds, and the data for NaN."
        )
    # emcee knows only numpy's older generator; its state comes from ours.
    legacy = np.random.RandomState(rng.integers(2**32, size=8, dtype=np.uint32))
    return Walk(
        chain=np.empty((0, wanted, len(coords[0]))),
        accepted=0.0,
        steps=0,
        thin=1,
        coords=np.stack(coords),
        heights=np.array(heights),
        random_state=cast(RandomState, legacy.get_state()),
    )


def _advance(
    walk: Walk,
    log_posterior: Callable[[Array], float],
    many: Callable[[Array], Array] | None,
) -> Walk:
    """One block of steps; all that the next one depends on is in what is returned."""
    import emcee

    walkers, size = walk.coords.shape
    moves = [
        (emcee.moves.DEMove(), 1 - STRETCHES - JUMPS),
        (emcee.moves.StretchMove(), STRETCHES),
        (emcee.moves.DEMove(gamma0=1.0), JUMPS),
    ]
    sampler = emcee.EnsembleSampler(
        walkers, size, many or log_posterior, moves=moves, vectorize=many is not None
    )
    # emcee's own wrapper prints what passes through it, an interrupt with all coordinates
    sampler.log_prob_fn = many or log_posterior
    state = emcee.State(walk.coords, log_prob=walk.heights, random_state=walk.random_state)
    try:
        for last in sampler.sample(
            state,
            iterations=BLOCK // walk.thin,
            thin_by=walk.thin,
            skip_initial_state_check=True,
        ):
            state = last
    except ValueError as error:
        if np.all(np.isfinite(state.coords)) and "infinite" not in str(error):
            raise
        raise NotFiniteError(
            "The walkers ran off to infinity, because neither data nor prior hold a parameter: "
            "give it a prior, or record what excites it."
        ) from None
    chain, thin = np.concatenate([walk.chain, sampler.get_chain()]), walk.thin
    if len(chain) >= MOST_STORED and thin < BLOCK:
        chain, thin = chain[1::2], 2 * thin
    return Walk(
        chain=chain,
        accepted=walk.accepted + walk.thin * float(sampler.backend.accepted.sum()),
        steps=walk.steps + BLOCK,
        thin=thin,
        coords=np.array(state.coords),
        heights=np.array(state.log_prob),
        random_state=state.random_state,
    )
