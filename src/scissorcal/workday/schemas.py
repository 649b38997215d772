"""The JSON schemas in data_schemas/, generated from the code they describe.

python -m scissorcal.workday.schemas --check    # exit code 1 where a file has fallen behind
python -m scissorcal.workday.schemas --write    # write them anew
"""

import json
import sys
from collections.abc import Mapping
from importlib import import_module
from pathlib import Path
from typing import Any

from scissorcal.recipe.load import schemas_dir

DIALECT = "https://json-schema.org/draft/2020-12/schema"

SOURCES: Mapping[str, str] = {
    "command.schema.json": "scissorcal.workday.envelope:Envelope",
    "capture-design.schema.json": "scissorcal.workday.runs.design:CaptureDesign",
    "comparison.schema.json": "scissorcal.report.build:comparison_schema_text",
    "manifest.schema.json": "scissorcal.package:manifest_schema_text",
    "photographs.schema.json": "scissorcal.workday.photographs:PhotoIndex",
    "probe.schema.json": "scissorcal.recording.probe:ProbeResult",
    "recipe.schema.json": "scissorcal.recipe.schema:Recipe",
    "recording.schema.json": "scissorcal.recording:recording_schema",
    "report.schema.json": "scissorcal.report.build:schema_text",
    "scene-choice.schema.json": "scissorcal.package.simplest.choice:SceneChoice",
    "signature.schema.json": "scissorcal.package:Review",
    "specimen.schema.json": "scissorcal.device.sim.specimen:Specimen",
    "track.schema.json": "scissorcal.calibration.plate.track_lines:track_schema",
    "trade.schema.json": "scissorcal.bench.trade.result:Trade",
    "verify.schema.json": "scissorcal.calibration.verify.result:VerifyResult",
}
"""File name, and where its schema comes from: a pydantic model or dataclass that is described, or
a function that gives the schema itself, as an object or as text."""


def generate(name: str) -> str:
    """Return the text of one schema file, generated from the code."""
    module, _, attribute = SOURCES[name].partition(":")
    source: Any = getattr(import_module(module), attribute)
    schema: Any = _described(name, source) if isinstance(source, type) else source()
    if isinstance(schema, str):
        return schema
    return json.dumps(schema, indent=2, ensure_ascii=False) + "\n"


def _described(name: str, kind: type) -> dict[str, Any]:
    from pydantic import TypeAdapter

    adapter: TypeAdapter[Any] = TypeAdapter(kind)
    return {"$schema": DIALECT, "$id": name, **adapter.json_schema()}


def fallen_behind(folder: Path | None = None) -> list[Path]:
    """Return the schema files that are missing or differ from what the code says."""
    folder = folder or schemas_dir()
    paths = {name: folder / name for name in SOURCES}
    return [
        path
        for name, path in paths.items()
        if not path.is_file() or path.read_text(encoding="utf-8") != generate(name)
    ]


def write(folder: Path | None = None) -> list[Path]:
    """Write every schema file that has fallen behind; return those."""
    behind = fallen_behind(folder)
    for path in behind:
        path.write_text(generate(path.name), encoding="utf-8")
    return behind


def main(arguments: list[str]) -> int:
    """Run as a program: ``--check`` or ``--write``."""
    if arguments == ["--write"]:
        for path in write():
            print(f"wrote {path}")
        return 0
    if arguments == ["--check"]:
        behind = fallen_behind()
        for path in behind:
            print(f"{path} has fallen behind the code: run 'make schemas'.", file=sys.stderr)
        return 1 if behind else 0
    print("Usage: python -m scissorcal.workday.schemas --check|--write", file=sys.stderr)
    return 2


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
