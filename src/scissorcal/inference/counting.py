"""Evaluations of a likelihood: counted, and ended where a time limit asks for it."""

from collections.abc import Callable
from dataclasses import replace

from scissorcal.aliases import Array
from scissorcal.inference.problem import Problem

Stop = Callable[[], bool]
"""Says whether the time allowed is used up; the clock is the caller's."""


class TimeUsedUpError(Exception):
    """An evaluation was asked for after the time allowed; the caller keeps what it has."""


class Counter:
    """Counts evaluations of a problem's likelihood, point by point."""

    def __init__(self) -> None:
        self.calls = 0

    def over(self, problem: Problem, stop: Stop | None = None) -> Problem:
        """The same problem, counted.

        Where ``stop`` is given, an evaluation raises TimeUsedUpError once it returns true.
        """

        def one_more(count: int = 1) -> None:
            if stop is not None and stop():
                raise TimeUsedUpError
            self.calls += count

        def terms(u: Array) -> Array:
            one_more()
            return problem.log_likelihood_terms(u)

        normal, many = problem.standardised, problem.log_posterior_many

        def standardised(u: Array) -> tuple[Array, Array]:
            one_more()
            assert normal is not None
            return normal(u)

        def log_posterior_many(points: Array) -> Array:
            one_more(len(points))
            assert many is not None
            return many(points)

        return replace(
            problem,
            log_likelihood_terms=terms,
            standardised=None if normal is None else standardised,
            log_posterior_many=None if many is None else log_posterior_many,
            tally=one_more,
        )
