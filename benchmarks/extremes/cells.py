"""A cell: one region of the extremes, its stated behaviour, and whether a run keeps it."""

import math
import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from types import TracebackType
from typing import Literal

import numpy as np

import scissorcal
from scissorcal.bench.extremes.compare import Outcome
from scissorcal.errors import ScissorcalError

Part = Literal["kernel", "model", "inference", "signals", "vision"]

CELLS = (
    "benchmarks.extremes.physics_cells:cells",
    "benchmarks.extremes.inference_cells:cells",
    "benchmarks.extremes.statistics_cells:cells",
    "benchmarks.extremes.friction_cells:cells",
    "benchmarks.extremes.cut_cells:cells",
    "benchmarks.extremes.import_cells:cells",
    "benchmarks.extremes.vision_cells:cells",
)
"""Where cells come from: functions without arguments that give a sequence of them."""

_PACKAGE = Path(scissorcal.__file__).parent


@dataclass(frozen=True)
class Found:
    """What one run of a cell gave.

    ``error`` and ``allowed`` are relative errors against the truth, found and stated, NaN where the
    answer was no number. ``sentence`` says what was answered: the refusal, the flag, or what is
    wrong. ``states`` is how many states were tried.
    """

    outcome: Outcome
    sentence: str
    error: float = math.nan
    allowed: float = math.nan
    states: int = 1


@dataclass(frozen=True)
class Cell:
    """One region of the extremes.

    ``name`` is unique, ``extreme`` says what is extreme, ``stated`` what is promised there, and
    ``truth`` how the right answer is known. ``run`` gets a random generator that depends on the
    seed and the name alone, and returns what it found; an error with a sentence that this program
    raised is a refusal (:func:`try_cell`), so ``run`` need not catch one. ``slow`` cells are left
    out of a reduced run.
    """

    name: str
    part: Part
    extreme: str
    stated: str
    truth: str
    run: Callable[[np.random.Generator], Found]
    slow: bool = False


def all_cells() -> tuple[Cell, ...]:
    """The cells of all parts, in the order of :data:`CELLS`. ValueError for a name used twice."""
    found: list[Cell] = []
    for source in CELLS:
        module, _, function = source.partition(":")
        found += getattr(import_module(module), function)()
    names = [cell.name for cell in found]
    if len(set(names)) != len(names):
        twice = next(name for name in names if names.count(name) > 1)
        raise ValueError(f'two cells are named "{twice}"')
    return tuple(found)


def try_cell(cell: Cell, seed: int) -> Found:
    """Run a cell and judge what it did; never raises.

    A warning is not a refusal: numbers that come with one are judged like others. An error is a
    refusal if this program raised it with a sentence, and wrong otherwise.
    """
    rng = np.random.default_rng([seed, *cell.name.encode()])
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            return cell.run(rng)
    except Exception as error:  # noqa: BLE001 - whatever it raises is what the cell reports
        return refusal(error)


def refusal(error: Exception) -> Found:
    """A raised error as a refusal, or as wrong where it is none of this program's sentences."""
    sentence = " ".join(str(error).split())
    own = isinstance(error, ScissorcalError) or (
        isinstance(error, ValueError) and _raised_here(error.__traceback__)
    )
    if own and len(sentence.split()) >= 3:
        return Found("refused", f"{type(error).__name__}: {sentence}")
    return Found("wrong", f"{type(error).__name__} without a sentence: {sentence or 'no words'}")


def judged(error: float, allowed: float, what: str, states: int = 1) -> Found:
    """Right where ``error`` (relative, against the truth) is at most ``allowed``, else wrong."""
    right = error <= allowed
    sentence = f"{what}: error {error:.2g}, stated {allowed:.2g}"
    return Found("right" if right else "wrong", sentence, error, allowed, states)


def worst_of(found: Sequence[Found]) -> Found:
    """One outcome for many: the worst, with the largest error; ``states`` add up."""
    order = ("right", "flagged", "refused", "not compared", "wrong")
    worst = max(found, key=lambda one: (order.index(one.outcome), _known(one.error)))
    states = sum(one.states for one in found)
    return Found(worst.outcome, worst.sentence, worst.error, worst.allowed, states)


def _known(error: float) -> float:
    return -1.0 if math.isnan(error) else error


def _raised_here(trace: TracebackType | None) -> bool:
    """Whether the last frame of an error, where it was raised, is this program's own code."""
    while trace is not None and trace.tb_next is not None:
        trace = trace.tb_next
    return trace is not None and Path(trace.tb_frame.f_code.co_filename).is_relative_to(_PACKAGE)
