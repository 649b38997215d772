"""The JSON twins of reports and comparisons, and the JSON Schemas that they keep."""

import json
from typing import Any

from scissorcal.report.comparison import Comparison
from scissorcal.report.document import ReportDocument


def twin_text(document: ReportDocument | Comparison) -> str:
    """The document as JSON: what is not finite is null, never NaN."""
    from pydantic import TypeAdapter

    plain = TypeAdapter(type(document)).dump_python(document, mode="json")
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
    return _schema_text(Comparison, "scissorcal comparison of two reports")


def _schema_text(kind: type, title: str) -> str:
    """JSON Schema (draft 2020-12) of a twin, generated from its dataclasses."""
    from pydantic import TypeAdapter

    schema: dict[str, Any] = TypeAdapter(kind).json_schema(mode="serialization")
    for definition in (schema, *schema.get("$defs", {}).values()):
        if definition.get("type") == "object":
            definition["additionalProperties"] = False
            definition["required"] = sorted(definition.get("properties", {}))
    whole = {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": title,
        **{name: value for name, value in schema.items() if name != "title"},
    }
    return json.dumps(whole, indent=2, sort_keys=True, ensure_ascii=False) + "\n"
