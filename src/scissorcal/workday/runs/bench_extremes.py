"""`bench extremes`: its jobs spread over processes, its page and JSON twin."""

import time
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from scissorcal.aliases import Progress
from scissorcal.workday.pool import open_pool

if TYPE_CHECKING:
    from scissorcal.bench.extremes.result import Extremes
    from scissorcal.bench.extremes.study import Done, Extent, Job


FINISH_S = 2.0
"""Time within a budget for writing the results."""


@dataclass(frozen=True)
class ExtremesOutcome:
    """The result and its files."""

    result: "Extremes"
    html: Path
    json: Path


def run_extremes(
    extent: "Extent",
    folder: Path,
    *,
    seed: int = 0,
    budget_s: float | None = None,
    workers: int | None = None,
    cluster: str | None = None,
    progress: Progress | None = None,
) -> ExtremesOutcome:
    """Try the extremes and write extremes.html and extremes.json into ``folder``.

    The same extent and seed try the same states; with ``budget_s`` no job begins that would end
    later, and what was tried is some of everything. Needs no workspace.
    """
    from scissorcal.bench.extremes.cells import all_cells
    from scissorcal.bench.extremes.result import extremes_text, summarise
    from scissorcal.bench.extremes.study import Done, do, jobs
    from scissorcal.report.extremes import extremes_page
    from scissorcal.workday.runs.bench_files import run_facts, write_page_and_twin

    began = time.monotonic()
    tell = progress or (lambda done, sentence: None)
    deadline = None if budget_s is None else began + budget_s - FINISH_S
    every = list(jobs(extent, seed))
    planned = sum(len(job.states) for job in every)
    done: list[Done] = []

    def keep(one: Done) -> None:
        done.append(one)
        tell(len(done) / len(every), f"{len(done)} of {len(every)} jobs")

    with open_pool(workers, cluster) as pool:
        # within a budget no worker is handed a second job: each begins when it is handed out
        handed = pool if deadline is None else replace(pool, ahead=1)
        handed.work(do, _in_time(every, done, deadline), keep, Done)
        count = pool.workers
    run = run_facts(began, workers=count, seed=seed, planned=planned, budget_s=budget_s)
    result = summarise(run, done, all_cells())
    twin = extremes_text(result)
    html, json = write_page_and_twin(folder, "extremes", extremes_page(result), twin)
    return ExtremesOutcome(result, html, json)


def _in_time(every: "list[Job]", done: "list[Done]", deadline: float | None) -> "Iterator[Job]":
    """The jobs that may begin: none that would, at the longest done, end after the deadline."""
    for job in every:
        longest = max((one.seconds for one in done), default=0.0)
        if deadline is not None and time.monotonic() + longest > deadline:
            return
        yield job
