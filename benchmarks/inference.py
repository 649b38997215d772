"""Cost of each effort: effective samples per second, optimum and Hessian included.

    python benchmarks/inference.py [--case stribeck|sblri|nist] [--data ../shared/data] [--seed 0]

Each log-posterior is sampled with every effort, with emcee's default (32 walkers, stretch moves)
and, if the extra `reference` is installed, with NumPyro's NUTS (4 chains, 500 steps of warm-up and
1000 kept, double precision).
Effective samples are those of the worst parameter: 1 / sum of squared weights for importance
sampling, bulk ESS (Vehtari et al. 2021) for chains. They are per second of processor time of
this process and its threads, which depends less on other load than wall time; imports are not
included. Errors are the largest over parameters against a long run of ensembles: of the mean in
standard deviations, of the standard deviation, and of any correlation. NUTS counts gradients, the
others log-posteriors; its compilation is listed separately.

The case `nist` searches every regression of NIST StRD that lies in the folder, from both of its
starts: matching digits of the polished optimum, evaluations and status of the search. Of 52
searches (26 sets, all but Nelson), 52 reach four digits, in 55 to 6,514 evaluations (median 150);
BOBYQA alone reached them in 39, in 97 to 2,675, and reported two plateaus as optima.
"""

import argparse
import json
import sys
import time
import warnings
import zipfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from scissorcal.aliases import Array
from scissorcal.inference import Posterior, Problem, infer

WALKERS = 32
STEPS = 3000
REFERENCE_WALKERS = 64
REFERENCE_STEPS = 8_000


@dataclass(frozen=True)
class Case:
    """One posterior, as numpy and as a function for JAX."""

    name: str
    problem: Problem
    in_jax: Callable[[Any, Any], Any]


@dataclass(frozen=True)
class Row:
    """One line of the table."""

    name: str
    wall_s: float
    cpu_s: float
    evaluations: int
    effective: float
    draws: Array
    remark: str


class Clock:
    """Wall and processor time since it was made."""

    def __init__(self) -> None:
        self.begin = time.perf_counter(), time.process_time()

    def read(self) -> tuple[float, float]:
        """Seconds of wall and of processor time."""
        return time.perf_counter() - self.begin[0], time.process_time() - self.begin[1]


def main() -> None:
    """Run one case or both and print a table each."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else "")
    parser.add_argument("--case", choices=("stribeck", "sblri", "nist", "both"), default="both")
    parser.add_argument("--data", type=Path, default=Path("../shared/data"))
    parser.add_argument("--seed", type=int, default=0)
    arguments = parser.parse_args()
    bulk_ess(np.random.default_rng(0).standard_normal((4, 100, 1)))
    if arguments.case in ("stribeck", "both"):
        run(stribeck(np.random.default_rng(arguments.seed)), arguments.seed)
    if arguments.case == "nist":
        nist_table(arguments.data / "nist_strd")
    archive = arguments.data / "posteriordb" / "sblri.json.zip"
    if arguments.case in ("sblri", "both"):
        if archive.is_file():
            run(sblri(archive), arguments.seed)
        else:
            print(f"sblri left out: {archive} is not there.")


def run(case: Case, seed: int) -> None:
    """Measure every method on one case and print the table."""
    reference = long_reference(case.problem, seed)
    rows = [
        one_effort(case.problem, "draft", seed),
        one_effort(case.problem, "standard", seed),
        one_effort(case.problem, "thorough", seed),
        emcee_default(case.problem, seed),
        *nuts(case, seed),
    ]
    mean, sd = reference.mean(axis=0), reference.std(axis=0)
    correlation = np.corrcoef(reference, rowvar=False)
    size, observations = len(mean), len(case.problem.series)
    print(f"\n{case.name}: {size} parameters, {observations} observations")
    print("| method | wall s | CPU s | evaluations | ESS | ESS/CPU s | mean | sd | correlation | |")
    print("|---|---|---|---|---|---|---|---|---|---|")
    for row in rows:
        away = np.abs((row.draws.mean(axis=0) - mean) / sd).max()
        ratio = np.abs(row.draws.std(axis=0) / sd - 1).max()
        apart = np.abs(np.corrcoef(row.draws, rowvar=False) - correlation).max()
        known = np.isfinite(row.effective)
        ess = f"{row.effective:.0f}" if known else "-"
        rate = f"{row.effective / row.cpu_s:.0f}" if known else "-"
        print(
            f"| {row.name} | {row.wall_s:.2f} | {row.cpu_s:.2f} | {row.evaluations} | {ess} | "
            f"{rate} | "
            f"{away:.3f} sd | {ratio:.1%} | {apart:.3f} | {row.remark} |"
        )


def nist_table(folder: Path) -> None:
    """Search every set of NIST StRD in a folder from both starts, and print the result of each."""
    sys.path.insert(0, str(Path(__file__).parents[1]))
    from tests.inference import reference

    reference.NIST = folder
    print("| set | start | digits | evaluations | in all | status | sampling |")
    print("|---|---|---|---|---|---|---|")
    searched = []
    for name in (name for name in reference.NIST_LAWS if (folder / f"{name}.dat").is_file()):
        data = reference.nist(name)
        for index, start in enumerate(data.starts):
            problem = reference.nist_problem(name, data, start)
            found = infer(problem, "draft", np.random.default_rng(0))
            values = found.optimum.point[:-1]
            digits = -np.log10(np.maximum(np.abs(values / data.values - 1), 1e-11)).min()
            searched.append((digits > 4.0, found.optimum.evaluations))
            print(
                f"| {name} | {index + 1} | {digits:.1f} | {found.optimum.evaluations} | "
                f"{found.evaluations} | {found.optimum.status.name} | {found.status.name} |"
            )
    counts = [evaluations for solved, evaluations in searched if solved]
    print(
        f"{len(counts)} of {len(searched)} solved in {min(counts)} to {max(counts)} evaluations, "
        f"half of them in {np.median(counts):.0f} at most"
    )


def one_effort(problem: Problem, effort: Any, seed: int) -> Row:
    """One effort, search included."""
    clock = Clock()
    found = infer(problem, effort, np.random.default_rng(seed), count=4000)
    wall, cpu = clock.read()
    effective = np.nan if effort == "draft" else found.effective
    return Row(effort, wall, cpu, found.evaluations, effective, found.draws, remark_of(found))


def remark_of(found: Posterior) -> str:
    """k-hat or R-hat, and whether it is within its limit."""
    if found.effort_reached == "thorough":
        said = f"tau {found.tau.max():.0f}, R-hat {found.r_hat.max():.3f}"
    else:
        said = "" if np.isnan(found.k_hat) else f"k-hat {found.k_hat:.2f}"
    return said if found.status.trusted or not said else f"{said}, {found.status.name}"


def emcee_default(problem: Problem, seed: int) -> Row:
    """One ensemble with emcee's default move, begun around the optimum that draft effort finds."""
    import emcee

    clock = Clock()
    found = infer(problem, "draft", np.random.default_rng(seed), count=WALKERS)
    sampler = emcee.EnsembleSampler(WALKERS, len(problem.names), problem.log_posterior)
    random_state = np.random.RandomState(seed).get_state()
    sampler.run_mcmc(emcee.State(found.draws, random_state=random_state), STEPS)
    chain = sampler.get_chain()[STEPS // 10 :]
    wall, cpu = clock.read()
    evaluations = found.evaluations + WALKERS * (STEPS + 1)
    tau = sampler.get_autocorr_time(tol=0, discard=STEPS // 10).max()
    every = chain.reshape(-1, chain.shape[-1])
    effective = bulk_ess(np.moveaxis(chain, 1, 0))
    return Row("emcee's default", wall, cpu, evaluations, effective, every, f"tau {tau:.0f}")


def nuts(case: Case, seed: int) -> list[Row]:
    """NumPyro's NUTS on the same log-posterior, chain by chain; nothing if not installed."""
    try:
        import jax  # type: ignore[import-not-found, unused-ignore]
        import numpyro  # type: ignore[import-not-found, unused-ignore]
        from numpyro.infer import (  # type: ignore[import-not-found, unused-ignore]
            MCMC,
            NUTS,
        )
    except ImportError:
        print("NUTS left out: install the extra 'reference' to measure it.")
        return []
    jax.config.update("jax_enable_x64", True)
    size = len(case.problem.names)
    begin_at = infer(case.problem, "draft", np.random.default_rng(seed), count=4).draws

    def model() -> None:
        u = numpyro.sample("u", numpyro.distributions.ImproperUniform(
            numpyro.distributions.constraints.real_vector, (), (size,)))  # fmt: skip
        numpyro.factor("posterior", case.in_jax(jax.numpy, u))

    def sampler(warmup: int, kept: int, chains: int) -> Any:
        return MCMC(
            NUTS(model),
            num_warmup=warmup,
            num_samples=kept,
            num_chains=chains,
            chain_method="sequential",
            progress_bar=False,
        )

    clock = Clock()
    sampler(1, 1, 1).run(jax.random.PRNGKey(0), init_params={"u": jax.numpy.asarray(begin_at[0])})
    _, compiling = clock.read()
    clock = Clock()
    walls = sampler(500, 1000, 4)
    walls.run(
        jax.random.PRNGKey(seed),
        init_params={"u": jax.numpy.asarray(begin_at)},
        extra_fields=("num_steps",),
    )
    draws = np.asarray(walls.get_samples(group_by_chain=True)["u"])
    wall, cpu = clock.read()
    steps = int(np.asarray(walls.get_extra_fields()["num_steps"]).sum())
    remark = f"compiling alone takes {compiling:.1f} CPU s; gradients without warm-up"
    every = draws.reshape(-1, size)
    return [Row("NumPyro NUTS", wall, cpu, steps, bulk_ess(draws), every, remark)]


def bulk_ess(chains: Array) -> float:
    """Bulk effective sample size of the worst parameter of chains (chains, draws, p)."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", FutureWarning)
        import arviz

    ess: Any = arviz.ess
    return min(float(ess(chains[..., i], method="bulk")) for i in range(chains.shape[-1]))


def long_reference(problem: Problem, seed: int) -> Array:
    """Draws of one long ensemble of difference moves, independent of the methods compared."""
    import emcee

    found = infer(problem, "draft", np.random.default_rng(seed + 1000), count=REFERENCE_WALKERS)
    moves = [(emcee.moves.DEMove(), 0.9), (emcee.moves.DEMove(gamma0=1.0), 0.1)]
    sampler = emcee.EnsembleSampler(
        REFERENCE_WALKERS, len(problem.names), problem.log_posterior, moves=moves
    )
    random_state = np.random.RandomState(seed + 1000).get_state()
    sampler.run_mcmc(emcee.State(found.draws, random_state=random_state), REFERENCE_STEPS)
    chain = sampler.get_chain()[REFERENCE_STEPS // 10 :]
    tau = sampler.get_autocorr_time(tol=0, discard=REFERENCE_STEPS // 10).max()
    print(f"reference: {chain.shape[0] * chain.shape[1] / tau:.0f} effective samples")
    return np.asarray(chain.reshape(-1, chain.shape[-1]))


def stribeck(rng: np.random.Generator) -> Case:
    """Six parameters: offset, Coulomb, Stribeck, viscous, log Stribeck rate, log noise.

    effort = offset + sign(v) (coulomb + stribeck exp(-(v / rate)^2)) + viscous v + white noise,
    over 3000 samples of slow and fast sweeps, simulated here with known values.
    """
    t = np.arange(3000) / 200.0
    v = (0.05 + 0.6 * (np.floor(t / 2.5) % 4) / 3) * np.sin(2 * np.pi * 0.4 * t)
    effort = 0.004 + np.sign(v) * (0.05 + 0.02 * np.exp(-((v / 0.04) ** 2))) + 0.03 * v
    effort = effort + 0.01 * rng.standard_normal(len(v))
    mean = np.array([0.0, 0.05, 0.02, 0.05])
    sd = np.array([0.05, 0.05, 0.02, 0.05])
    centre, spread = np.array([np.log(0.1), np.log(0.02)]), np.array([1.0, 1.0])
    fixed = np.column_stack([np.ones_like(v), np.sign(v), v])

    def design(theta: Array) -> tuple[Array, Array]:
        slow = fixed[:, 1] * np.exp(-((v * np.exp(-theta[0])) ** 2))
        return np.zeros(len(v)), np.column_stack([fixed[:, :2], slow, fixed[:, 2]])

    def in_jax(xp: Any, u: Any) -> Any:
        slow = xp.exp(-((v * xp.exp(-u[4])) ** 2))
        predicted = u[0] + np.sign(v) * (u[1] + u[2] * slow) + u[3] * v
        z = (effort - predicted) * xp.exp(-u[5])
        away = xp.concatenate([(u[:4] - mean) / sd, (u[4:] - centre) / spread])
        return -0.5 * xp.sum(z**2) - len(v) * u[5] - 0.5 * xp.sum(away**2)

    return Case(
        "stribeck",
        linear_posterior(
            effort,
            design,
            ("offset", "coulomb", "stribeck", "viscous"),
            ("log_rate", "log_noise"),
            (mean, sd),
            lambda theta: -0.5 * float(np.sum(((theta - centre) / spread) ** 2)),
            spread,
            np.array([centre, [np.log(0.03), np.log(0.01)]]),
        ),
        in_jax,
    )


def sblri(archive: Path) -> Case:
    """Linear regression of posteriordb: five slopes with priors of sd 10, sigma half normal."""
    with zipfile.ZipFile(archive) as opened:
        data = json.loads(opened.read(opened.namelist()[0]))
    X, y = np.array(data["X"]), np.array(data["y"])

    def log_prior(theta: Array) -> float:
        return float(-0.5 * np.exp(2 * theta[0]) / 100 + theta[0])

    def in_jax(xp: Any, u: Any) -> Any:
        z = (y - X @ u[:5]) * xp.exp(-u[5])
        prior = -0.5 * (xp.sum(u[:5] ** 2) + xp.exp(2 * u[5])) / 100 + u[5]
        return -0.5 * xp.sum(z**2) - len(y) * u[5] + prior

    return Case(
        "sblri",
        linear_posterior(
            y,
            lambda theta: (np.zeros(len(y)), X),
            tuple(f"beta{i}" for i in range(1, 6)),
            ("log_sigma",),
            (np.zeros(5), np.full(5, 10.0)),
            log_prior,
            np.array([2.0]),
            np.array([[np.log(np.std(y))]]),
        ),
        in_jax,
    )


def linear_posterior(
    measured: Array,
    design: Callable[[Array], tuple[Array, Array]],
    linear_names: tuple[str, ...],
    names: tuple[str, ...],
    linear_prior: tuple[Array, Array],
    log_prior: Callable[[Array], float],
    spread: Array,
    starts: Array,
) -> Problem:
    """The posterior of a model that is linear in its first parameters.

    The last of ``names`` is the logarithm of the noise's standard deviation.
    """
    mean, sd = linear_prior
    q = len(mean)

    def standardised(u: Array) -> tuple[Array, Array]:
        _, columns = design(u[q:])
        return (measured - columns @ u[:q]) * np.exp(-u[-1]), np.full(len(measured), u[-1])

    def terms(u: Array) -> Array:
        z, log_sd = standardised(u)
        return np.asarray(-0.5 * z**2 - log_sd)

    def prior_of_all(u: Array) -> float:
        return log_prior(u[q:]) - 0.5 * float(np.sum(((u[:q] - mean) / sd) ** 2))

    scale = np.concatenate([sd, spread])
    at = np.column_stack([np.tile(mean, (len(starts), 1)), starts])
    return Problem(
        names=(*linear_names, *names),
        log_prior=prior_of_all,
        log_likelihood_terms=terms,
        series=np.zeros(len(measured), dtype=np.int64),
        prior_sd=scale,
        starts=at,
        lower=at[0] - 8 * scale,
        upper=at[0] + 8 * scale,
        standardised=standardised,
        independent=True,
    )


if __name__ == "__main__":
    main()
