"""What the benchmarks that spread jobs over processes share: facts of a run, page and twin."""

import platform
import time
from datetime import UTC, datetime
from pathlib import Path

from scissorcal.bench.run import Run
from scissorcal.files import replacing
from scissorcal.identity import VERSION


def run_facts(
    began: float, *, workers: int, seed: int, planned: int, budget_s: float | None = None
) -> Run:
    """Facts of a run that began at ``began`` (s, of the monotonic clock) and ends now."""
    return Run(
        created=datetime.now(UTC),
        version=VERSION,
        machine=f"{platform.machine()}, {platform.system()}, Python {platform.python_version()}",
        workers=workers,
        seed=seed,
        seconds=time.monotonic() - began,
        planned=planned,
        budget_s=budget_s,
    )


def write_page_and_twin(folder: Path, name: str, page: str, twin: str) -> tuple[Path, Path]:
    """Write ``name``.html and its JSON twin into a folder; returns both paths."""
    folder.mkdir(parents=True, exist_ok=True)
    html, json = folder / f"{name}.html", folder / f"{name}.json"
    for path, text in ((json, twin), (html, page)):
        with replacing(path) as part:
            part.write_text(text, encoding="utf-8")
    return html, json
