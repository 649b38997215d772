"""`bench control`: its jobs spread over processes, its page and JSON twin."""

import platform
import time
from collections.abc import Callable
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING

import scissorcal
from scissorcal.files import replacing
from scissorcal.workday.pool import open_pool

if TYPE_CHECKING:
    from scissorcal.bench.control.result import ControlBench
    from scissorcal.bench.control.study import Done, Extent

Progress = Callable[[float, str], None]


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
    from scissorcal.bench.control.result import Run, control_text, summarise
    from scissorcal.bench.control.study import do, jobs
    from scissorcal.report.bench_control import control_page

    began = time.monotonic()
    tell = progress or (lambda done, sentence: None)
    every = list(jobs(extent, seed))
    done: list[Done] = []

    def keep(one: "Done") -> None:
        done.append(one)
        tell(len(done) / len(every), f"{len(done)} of {len(every)} jobs")

    with open_pool(workers, cluster) as pool:
        pool.work(do, every, keep)
        count = pool.workers
    run = Run(
        created=datetime.now(UTC),
        version=scissorcal.__version__,
        machine=f"{platform.machine()}, {platform.system()}, Python {platform.python_version()}",
        workers=count,
        seed=seed,
        seconds=time.monotonic() - began,
        planned=len(every),
    )
    result = summarise(run, done)
    folder.mkdir(parents=True, exist_ok=True)
    outcome = ControlOutcome(result, folder / "control.html", folder / "control.json")
    texts = ((outcome.json, control_text(result)), (outcome.html, control_page(result)))
    for path, text in texts:
        with replacing(path) as part:
            part.write_text(text, encoding="utf-8")
    return outcome
