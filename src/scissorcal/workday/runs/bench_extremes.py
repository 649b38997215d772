"""`bench extremes`: a package and the model under it against 50 digits, as panels."""

import json
from datetime import UTC, datetime
from pathlib import Path

from pydantic import TypeAdapter

from scissorcal.aliases import Progress
from scissorcal.bench.extremes.compare import (
    compare_kernel,
    compare_model,
    compare_package,
    strokes,
)
from scissorcal.bench.extremes.states import package_states
from scissorcal.files import replacing
from scissorcal.identity import VERSION
from scissorcal.package import ModelPackage
from scissorcal.report.extremes import extremes_panels
from scissorcal.report.html import panels_page
from scissorcal.report.panel import Panel

FORMAT = "scissorcal-extremes/2"


def run_extremes(
    package: ModelPackage, folder: Path, *, size: float, seed: int, progress: Progress
) -> tuple[list[Panel], tuple[Path, Path]]:
    """Try a package and write extremes.html and extremes.json into ``folder``: panels, and paths.

    The same package, size and seed try the same states.
    """
    manifest, tables = package.manifest, package.tables
    scene = manifest.ranges.opening_rad, manifest.ranges.contact_m[0]
    states, tried = package_states(package, size, seed), []
    for state in states:
        kernel, rendered = compare_kernel(state, tables), compare_package(state, package)
        tried.append((state, (compare_model(state), kernel, rendered)))
        progress(len(tried) / len(states), f"{len(tried)} of {len(states)} states")
    panels, now = extremes_panels(tried, strokes(tables, *scene)), datetime.now(UTC)
    facts = {
        "format": FORMAT,
        "created": now.isoformat(),
        "scissorcal_version": VERSION,
        "package": manifest.name,
        "content_hash": manifest.content_hash,
        "seed": seed,
        "states": len(states),
    }
    package_words = f"the package {manifest.name} ({manifest.content_hash[:12]})"
    shown = {"tried": f"{len(states)} states of {package_words}, seed {seed}"}
    page = panels_page(
        "Numerical stability",
        "The extremes",
        panels,
        made=(now, VERSION),
        facts=shown,
        findings=[panels[0].sentence],
    )
    plain = TypeAdapter(list[Panel]).dump_python(panels, mode="json", exclude_defaults=True)
    twin = json.dumps(facts | {"panels": plain}, ensure_ascii=False, allow_nan=False) + "\n"
    folder.mkdir(parents=True, exist_ok=True)
    html, twin_path = folder / "extremes.html", folder / "extremes.json"
    for path, text in ((twin_path, twin), (html, page)):
        with replacing(path) as part:
            part.write_text(text, encoding="utf-8")
    return panels, (html, twin_path)
