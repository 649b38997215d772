"""The JSON twins of reports and comparisons, and the JSON Schemas that they keep."""

from __future__ import annotations

import json
import re
from typing import TYPE_CHECKING, Any

from scissorcal.report.document import ReportDocument

if TYPE_CHECKING:
    from scissorcal.bench.trade.result import Trade
    from scissorcal.report.comparison import Comparison


def twin_text(document: ReportDocument | Comparison | Trade) -> str:
    """The document as JSON: what has its default is left out, what is not finite is null."""
    from pydantic import TypeAdapter

    adapter: TypeAdapter[Any] = TypeAdapter(type(document))
    plain = adapter.dump_python(document, mode="json", exclude_defaults=True)
    return json.dumps(plain, ensure_ascii=False, allow_nan=False, separators=(",", ":")) + "\n"


def read_twin(text: str | bytes) -> ReportDocument:
    """Read a report's twin back. Raises ValueError where it is none of this version."""
    from pydantic import TypeAdapter

    return TypeAdapter(ReportDocument).validate_json(text)


def schema_text() -> str:
    """The schema as it stands in ``data_schemas/report.schema.json``."""
    return _schema_text(ReportDocument, "scissorcal report")


def comparison_schema_text() -> str:
    """The schema as it stands in ``data_schemas/comparison.schema.json``."""
    from scissorcal.report.comparison import Comparison

    return _schema_text(Comparison, "scissorcal comparison of two reports")


def _schema_text(kind: type, title: str) -> str:
    """JSON Schema (draft 2020-12) of a twin, generated from its dataclasses."""
    from pydantic import TypeAdapter

    schema: dict[str, Any] = TypeAdapter(kind).json_schema(mode="serialization")
    for definition in (schema, *schema.get("$defs", {}).values()):
        if definition.get("type") == "object":
            definition["additionalProperties"] = False
            definition["required"] = sorted(
                name for name, entry in definition["properties"].items() if "default" not in entry
            )
        for entry in definition.get("properties", {}).values():
            entry.pop("title", None)
    whole = {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": title,
        **{name: value for name, value in schema.items() if name != "title"},
    }
    text = json.dumps(_short(whole), indent=2, sort_keys=True, ensure_ascii=False) + "\n"
    return re.sub(r"\[\s+([^\[\]{}]*?)\s+\]", lambda m: f"[{' '.join(m[1].split())}]", text)


def _short(schema: Any) -> Any:
    """The schema with "a number or null" as one type."""
    if isinstance(schema, list):
        return [_short(entry) for entry in schema]
    if not isinstance(schema, dict):
        return schema
    plain = {name: _short(entry) for name, entry in schema.items()}
    kinds = plain.get("anyOf", [])
    if kinds and all(set(kind) == {"type"} for kind in kinds):
        del plain["anyOf"]
        plain["type"] = [kind["type"] for kind in kinds]
    return plain
