"""Problems with published answers, read from the files of those who published them."""

import json
import re
import zipfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from scissorcal.aliases import Array
from scissorcal.inference import Problem

DATA = Path(__file__).parents[2].parent / "shared" / "data"
NIST = DATA / "nist_strd"
POSTERIORDB = DATA / "posteriordb"


def _peaks(b: Array, x: Array) -> Array:
    """An exponential and two bells, the law of Gauss1 to Gauss3."""
    decay = b[0] * np.exp(-b[1] * x)
    first = b[2] * np.exp(-((x - b[3]) ** 2) / b[4] ** 2)
    return decay + first + b[5] * np.exp(-((x - b[6]) ** 2) / b[7] ** 2)


def _waves(b: Array, x: Array) -> Array:
    """A year's wave and two of unknown period, the law of ENSO."""
    year, first, second = (2 * np.pi * x / period for period in (12.0, b[3], b[6]))
    known = b[0] + b[1] * np.cos(year) + b[2] * np.sin(year)
    known = known + b[4] * np.cos(first) + b[5] * np.sin(first)
    return known + b[7] * np.cos(second) + b[8] * np.sin(second)


def _cubic_ratio(b: Array, x: Array) -> Array:
    """Cubic over cubic, the law of Hahn1 and Thurber."""
    above = b[0] + x * (b[1] + x * (b[2] + x * b[3]))
    return above / (1 + x * (b[4] + x * (b[5] + x * b[6])))


def _three_decays(b: Array, x: Array) -> Array:
    """The law of Lanczos1 to Lanczos3."""
    first, second = b[0] * np.exp(-b[1] * x), b[2] * np.exp(-b[3] * x)
    return first + second + b[4] * np.exp(-b[5] * x)


NIST_LAWS: dict[str, Callable[[Array, Array], Array]] = {
    "Bennett5": lambda b, x: b[0] * (b[1] + x) ** (-1 / b[2]),
    "BoxBOD": lambda b, x: b[0] * (1 - np.exp(-b[1] * x)),
    "Chwirut1": lambda b, x: np.exp(-b[0] * x) / (b[1] + b[2] * x),
    "Chwirut2": lambda b, x: np.exp(-b[0] * x) / (b[1] + b[2] * x),
    "DanWood": lambda b, x: b[0] * x ** b[1],
    "ENSO": _waves,
    "Eckerle4": lambda b, x: (b[0] / b[1]) * np.exp(-0.5 * ((x - b[2]) / b[1]) ** 2),
    "Gauss1": _peaks,
    "Gauss2": _peaks,
    "Gauss3": _peaks,
    "Hahn1": _cubic_ratio,
    "Kirby2": lambda b, x: (b[0] + x * (b[1] + x * b[2])) / (1 + x * (b[3] + x * b[4])),
    "Lanczos1": _three_decays,
    "Lanczos2": _three_decays,
    "Lanczos3": _three_decays,
    "MGH09": lambda b, x: b[0] * (x**2 + x * b[1]) / (x**2 + x * b[2] + b[3]),
    "MGH10": lambda b, x: b[0] * np.exp(b[1] / (x + b[2])),
    "MGH17": lambda b, x: b[0] + b[1] * np.exp(-x * b[3]) + b[2] * np.exp(-x * b[4]),
    "Misra1a": lambda b, x: b[0] * (1 - np.exp(-b[1] * x)),
    "Misra1b": lambda b, x: b[0] * (1 - (1 + b[1] * x / 2) ** -2),
    "Misra1c": lambda b, x: b[0] * (1 - (1 + 2 * b[1] * x) ** -0.5),
    "Misra1d": lambda b, x: b[0] * b[1] * x / (1 + b[1] * x),
    "Rat42": lambda b, x: b[0] / (1 + np.exp(b[1] - b[2] * x)),
    "Rat43": lambda b, x: b[0] / (1 + np.exp(b[1] - b[2] * x)) ** (1 / b[3]),
    "Roszman1": lambda b, x: b[0] - b[1] * x - np.arctan(b[2] / (x - b[3])) / np.pi,
    "Thurber": _cubic_ratio,
}


@dataclass(frozen=True)
class Certified:
    """A regression of NIST StRD: data (n,), two starts (2, p), certified values and sds (p,)."""

    y: Array
    x: Array
    starts: Array
    values: Array
    sds: Array


def nist(name: str) -> Certified:
    """Read one of the files."""
    lines = (NIST / f"{name}.dat").read_text(encoding="ascii").splitlines()
    rows = [
        [float(number) for number in line.split("=")[1].split()]
        for line in lines
        if re.match(r"\s*b\d+ *=", line)
    ]
    table = np.array(rows)
    begin = max(i for i, line in enumerate(lines) if line.startswith("Data:")) + 1
    data = np.array([[float(n) for n in line.split()] for line in lines[begin:] if line.split()])
    return Certified(data[:, 0], data[:, 1], table[:, :2].T, table[:, 2], table[:, 3])


def nist_problem(name: str, data: Certified, start: Array) -> Problem:
    """Least squares as a posterior: flat priors, normal noise whose log sd is one more parameter.

    ``prior_sd`` is only a scale here, the size of the start; bounds leave 10^4 times that.
    """
    law = NIST_LAWS[name]

    def standardised(u: Array) -> tuple[Array, Array]:
        with np.errstate(all="ignore"):
            residuals = data.y - law(u[:-1], data.x)
        return residuals / np.exp(u[-1]), np.full(len(residuals), u[-1])

    def terms(u: Array) -> Array:
        z, log_sd = standardised(u)
        with np.errstate(all="ignore"):
            return -0.5 * z**2 - log_sd

    with np.errstate(all="ignore"):
        spread = np.std(data.y - law(start, data.x))
    begin = np.append(start, np.log(spread))
    scale = np.append(np.abs(start), 1.0)
    return Problem(
        names=(*(f"b{i + 1}" for i in range(len(start))), "log_sd"),
        log_prior=lambda u: 0.0,
        log_likelihood_terms=terms,
        series=np.zeros(len(data.y), dtype=np.int64),
        prior_sd=scale,
        starts=begin[None],
        lower=begin - 1e4 * scale,
        upper=begin + 1e4 * scale,
        standardised=standardised,
        independent=True,
    )


def posteriordb(name: str, posterior: str) -> tuple[dict[str, list[float]], dict[str, Array]]:
    """Data of a model and its reference draws by parameter, all chains in a row."""
    with zipfile.ZipFile(POSTERIORDB / f"{name}.json.zip") as archive:
        data = json.loads(archive.read(archive.namelist()[0]))
    with zipfile.ZipFile(POSTERIORDB / f"{name}-{posterior}.json.zip") as archive:
        chains = json.loads(archive.read(archive.namelist()[0]))
    return data, {key: np.concatenate([chain[key] for chain in chains]) for key in chains[0]}


def regression_problem(
    columns: Array, y: Array, log_prior: Callable[[Array, float], float], scale: Array
) -> Problem:
    """y normal about columns @ beta; the last parameter is the logarithm of sigma.

    ``log_prior`` takes beta and sigma; the logarithm's Jacobian is added here.
    """

    def standardised(u: Array) -> tuple[Array, Array]:
        return (y - columns @ u[:-1]) / np.exp(u[-1]), np.full(len(y), u[-1])

    def terms(u: Array) -> Array:
        z, log_sd = standardised(u)
        return -0.5 * z**2 - log_sd

    names = (*(f"beta{i + 1}" for i in range(columns.shape[1])), "log_sigma")
    start = np.append(np.zeros(columns.shape[1]), np.log(np.std(y)))
    return Problem(
        names=names,
        log_prior=lambda u: log_prior(u[:-1], float(np.exp(u[-1]))) + float(u[-1]),
        log_likelihood_terms=terms,
        series=np.zeros(len(y), dtype=np.int64),
        prior_sd=scale,
        starts=start[None],
        lower=start - 20 * scale,
        upper=start + 20 * scale,
        standardised=standardised,
        independent=True,
    )


def sblri() -> tuple[Problem, Array]:
    """beta and sigma (half) normal with sd 10; reference draws (k, 6) of beta and sigma."""
    data, draws = posteriordb("sblri", "blr")
    problem = regression_problem(
        np.array(data["X"]),
        np.array(data["y"]),
        lambda beta, sigma: -0.5 * float(beta @ beta + sigma**2) / 100.0,
        np.append(np.full(5, 10.0), 2.0),
    )
    return problem, np.column_stack([*(draws[f"beta[{i}]"] for i in range(1, 6)), draws["sigma"]])


def kidiq() -> tuple[Problem, Array]:
    """Flat on beta, half Cauchy of scale 2.5 on sigma; reference draws (k, 3)."""
    data, draws = posteriordb("kidiq", "kidscore_momiq")
    problem = regression_problem(
        np.column_stack([np.ones(int(data["N"])), data["mom_iq"]]),
        np.array(data["kid_score"], dtype=float),
        lambda beta, sigma: -float(np.log1p((sigma / 2.5) ** 2)),
        np.array([50.0, 2.0, 2.0]),
    )
    return problem, np.column_stack([draws["beta[1]"], draws["beta[2]"], draws["sigma"]])
