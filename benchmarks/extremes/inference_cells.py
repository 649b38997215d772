"""Cells of inference: posteriors known in closed form, at the extremes of scale and of data."""

import time
from collections.abc import Callable
from dataclasses import replace

import numpy as np
from benchmarks.extremes.cells import Cell, Found, judged, refusal, worst_of
from benchmarks.extremes.conjugate import Linear, line
from benchmarks.extremes.shapes import shape_cells

from scissorcal.aliases import Array
from scissorcal.inference import NotFiniteError, Posterior, infer

Made = Callable[[np.random.Generator], Linear]

DRAWN = 0.15
"""Stated error of means, in sds, and of sds, relative: 2,000 draws of weights that are nearly even
have a mean to 0.022 sd and an sd to 1.6 %; importance weights may cost half of the draws, and
0.15 is then beyond four standard errors."""

EXACT = "normal linear model, in exact fractions"
RIGHT = (
    "means and sds to 0.15 sd (where autocorrelation is looked for: sds to 0.15 below and twice "
    "above); what the data leave to the prior is named"
)
WIDER = 2.0
"""How much wider intervals may come out where the noise's memory is estimated: of 60 residuals,
chance alone shows some, and it only widens."""


def cells() -> tuple[Cell, ...]:
    """The cells of inference."""
    linear = (
        _cell("everyday line", "nothing", line),
        *(
            _cell(f"data times {scale:g}", f"data, noise and priors in units of {scale:g}",
                  lambda rng, s=scale: _scaled(line(rng), s))  # type: ignore[misc]
            for scale in (1e-12, 1e-6, 1e6, 1e12)
        ),
        *(
            _cell(f"parameter times {scale:g}", f"one parameter in units of {scale:g}",
                  lambda rng, s=scale: _stretched(line(rng), np.array([1.0, s])))  # type: ignore[misc]
            for scale in (1e-12, 1e12)
        ),
        _cell("parameters 1e24 apart", "one parameter of 1e12, one of 1e-12",
              lambda rng: _stretched(line(rng), np.array([1e12, 1e-12]))),
        _cell("prior 1e12 wide", "prior sds of 1e12",
              lambda rng: replace(line(rng), width=np.full(2, 1e12))),
        _cell("prior 1e-12 narrow", "prior sds of 1e-12: the data say nothing beside them",
              lambda rng: replace(line(rng), width=np.full(2, 1e-12)), silent=("b0", "b1")),
        _cell("singular information", "two columns are equal",
              lambda rng: _with(line(rng), lambda x: x), silent=("b1", "b2")),
        _cell("near-singular information", "two columns differ by 1e-6",
              lambda rng: _with(line(rng), lambda x: x * (1.0 + 1e-6 * np.sin(9.0 * x))),
              silent=("b1", "b2")),
        _cell("a parameter without data", "a column of zeros",
              lambda rng: _with(line(rng), lambda x: 0.0 * x), silent=("b2",)),
        _cell("eight parameters without data", "eight columns of zeros",
              lambda rng: _with(line(rng), lambda x: 0.0 * x, 8), silent=("b2", "b9")),
        _cell("no data", "0 samples", lambda rng: _some(line(rng), []), silent=("b0", "b1")),
        _cell("1 sample", "1 sample", lambda rng: _some(line(rng), [0]), silent=("b0", "b1")),
        _cell("2 samples", "2 samples", lambda rng: _some(line(rng), [0, -1])),
        _cell("10 samples", "10 samples", lambda rng: line(rng, 10)),
        _cell("constant data", "all data equal",
              lambda rng: replace(line(rng), data=np.full(60, 3.0))),
        _cell("data all zero", "all data zero", lambda rng: replace(line(rng), data=np.zeros(60))),
        _cell("search from 1e6 prior sds away", "start at 1e7",
              lambda rng: replace(line(rng), starts=np.array([[1e7, -1e7]]))),
        _cell("outlier of 1e6 sd, noise taken as known", "one datum 1e6 sd off",
              lambda rng: _off(line(rng), 1e6), stretched=False),
        _cell("outlier of 1e9 sd, noise taken as known", "one datum 1e9 sd off",
              lambda rng: _off(line(rng), 1e9), stretched=False),
        _cell("noise 1e-12", "data without noise, sd stated as 1e-12",
              lambda rng: replace(line(rng), data=line(rng, 60).columns @ [1.0, 2.0], noise=1e-12)),
        _cell("prior 1e4 sds from the data", "prior mean 1e5, sd 10, data at 1 and 2",
              lambda rng: replace(line(rng), centre=np.full(2, 1e5)), stretched=False),
    )  # fmt: skip
    return (
        *linear,
        Cell("outlier of 1e6 sd, noise as the data show it", "inference", "one datum 1e6 sd off",
             "intervals hold the truth, or the fit is flagged", "1 and 2 by construction", _wide),
        *(
            Cell(f"a datum that is {word}", "inference", f"one datum is {word}",
                 "refused in a sentence", "there is no answer",
                 lambda rng, v=value: _damaged(rng, v))  # type: ignore[misc]
            for word, value in (("NaN", np.nan), ("infinite", np.inf))
        ),
        *shape_cells(),
        Cell("1e7 samples", "inference", "10,000,000 samples",
             "means and sds to 0.15 sd; time and memory are stated", EXACT, _many, slow=True),
    )  # fmt: skip


def _cell(
    name: str,
    extreme: str,
    made: Made,
    *,
    silent: tuple[str, ...] = (),
    stretched: bool = True,
) -> Cell:
    """A cell over all ways in which inference takes a model: by squares or not, stretched or not.

    ``silent`` are parameters that have to be named as left to the prior.
    """

    def run(rng: np.random.Generator) -> Found:
        model = made(rng)
        mean, sd = model.posterior()
        found = []
        for squares in (True, False):
            for independent in (True, False) if stretched else (True,):
                problem = model.problem(squares=squares, independent=independent)
                try:
                    posterior = infer(problem, "standard", rng)
                except NotFiniteError as error:
                    found.append(refusal(error))
                    continue
                found.append(judge_posterior(posterior, mean, sd, silent, exact=independent))
        return worst_of(found)

    return Cell(name, "inference", extreme, RIGHT, EXACT, run)


def judge_posterior(
    posterior: Posterior,
    mean: Array,
    sd: Array,
    silent: tuple[str, ...] = (),
    *,
    exact: bool = True,
) -> Found:
    """Judge draws by exact means and sds (p,), and what the posterior says of itself.

    Without ``exact``, sds may be up to ``WIDER`` times as large as they are for white noise.
    """
    own = posterior.draws.std(axis=0, ddof=1)
    away = np.abs(posterior.draws.mean(axis=0) - mean) / own
    width = 1.0 - own / sd if not exact and np.all(own < WIDER * sd) else np.abs(own / sd - 1.0)
    error = float(max(away.max(), width.max()))
    if not error <= DRAWN:
        if not posterior.optimum.success:
            return Found("flagged", posterior.optimum.sentence, error, DRAWN)
        if not posterior.status.trusted:
            return Found("flagged", posterior.sentence, error, DRAWN)
    said = " ".join(posterior.null)
    if any(name not in said for name in silent):
        return Found("wrong", f"{', '.join(silent)} is not named as left to the prior")
    return judged(error, DRAWN, "means and sds")


def _wide(rng: np.random.Generator) -> Found:
    """With noise as large as the residuals show it, the interval has to hold the truth."""
    model = _off(line(rng), 1e6)
    found = []
    for squares in (True, False):
        posterior = infer(model.problem(squares=squares, independent=False), "standard", rng)
        low, high = np.quantile(posterior.draws, [0.005, 0.995], axis=0)
        true = np.array([1.0, 2.0])
        held = bool(np.all((low < true) & (high > true)))
        if held or (posterior.optimum.success and posterior.status.trusted):
            found.append(judged(0.0 if held else 1.0, 0.0, "share of 99 % intervals that miss"))
        else:
            found.append(Found("flagged", posterior.sentence))
    return worst_of(found)


def _damaged(rng: np.random.Generator, value: float) -> Found:
    model = line(rng)
    data = model.data.copy()
    data[7] = value
    infer(replace(model, data=data).problem(squares=True, independent=False), "standard", rng)
    return Found("wrong", "a posterior although a datum is no number")


def _many(rng: np.random.Generator) -> Found:
    """Ten million samples; the exact posterior from sums, which fractions would take hours for."""
    import resource

    model = line(rng, 10_000_000)
    begun = time.process_time()
    posterior = infer(model.problem(squares=True, independent=False), "draft", rng)
    seconds = time.process_time() - begun
    gigabytes = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e6
    precision = model.columns.T @ model.columns / model.noise**2 + np.diag(model.width**-2.0)
    covariance = np.linalg.inv(precision)
    mean = covariance @ (model.columns.T @ model.data) / model.noise**2
    found = judge_posterior(posterior, mean, np.sqrt(np.diag(covariance)))
    said = f"{found.sentence}; {seconds:.0f} s of processor time, {gigabytes:.1f} GB at most"
    return replace(found, sentence=said, states=10_000_000)


def _scaled(model: Linear, scale: float) -> Linear:
    return replace(
        model,
        data=scale * model.data,
        noise=scale * model.noise,
        width=scale * model.width,
    )


def _stretched(model: Linear, scale: Array) -> Linear:
    return replace(model, columns=model.columns / scale, width=model.width * scale)


def _with(model: Linear, column: Callable[[Array], Array], count: int = 1) -> Linear:
    added = np.repeat(column(model.columns[:, 1])[:, None], count, axis=1)
    size = model.columns.shape[1] + count
    return replace(
        model,
        columns=np.hstack([model.columns, added]),
        centre=np.zeros(size),
        width=np.full(size, 10.0),
    )


def _some(model: Linear, rows: list[int]) -> Linear:
    return replace(model, columns=model.columns[rows], data=model.data[rows])


def _off(model: Linear, sds: float) -> Linear:
    data = model.data.copy()
    data[30] += sds * model.noise
    return replace(model, data=data)
