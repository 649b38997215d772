"""`bench control`: its jobs spread over processes, its page and JSON twin."""

import time
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from scissorcal.aliases import Progress
from scissorcal.workday.pool import open_pool

if TYPE_CHECKING:
    from scissorcal.bench.control.result import ControlBench
    from scissorcal.bench.control.study import Extent


@dataclass(frozen=True)
class ControlOutcome:
    """The result and its files."""

    result: "ControlBench"
    html: Path
    json: Path


def run_bench_control(
    extent: "Extent",
    folder: Path,
    *,
    seed: int = 0,
    workers: int | None = None,
    cluster: str | None = None,
    progress: Progress | None = None,
) -> ControlOutcome:
    """Measure pose and control by vision and contact; write control.html and control.json.

    The same extent and seed draw the same worlds. Needs no workspace.
    """
    from scissorcal.bench.control.result import control_text, summarise
    from scissorcal.bench.control.study import Done, do, jobs
    from scissorcal.report.bench_control import control_page
    from scissorcal.workday.runs.bench_files import run_facts, write_page_and_twin

    began = time.monotonic()
    tell = progress or (lambda done, sentence: None)
    every = list(jobs(extent, seed))
    done: list[Done] = []

    def keep(one: Done) -> None:
        done.append(one)
        tell(len(done) / len(every), f"{len(done)} of {len(every)} jobs")

    with open_pool(workers, cluster) as pool:
        pool.work(do, every, keep, Done)
        count = pool.workers
    result = summarise(run_facts(began, workers=count, seed=seed, planned=len(every)), done)
    twin = control_text(result)
    html, json = write_page_and_twin(folder, "control", control_page(result), twin)
    return ControlOutcome(result, html, json)
