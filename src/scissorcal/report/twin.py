"""The report's JSON twin, and the JSON Schema that it keeps."""

import json
from typing import Any

from scissorcal.report.document import ReportDocument


def twin_text(document: ReportDocument) -> str:
    """The document as JSON: what is not finite is null, never NaN."""
    from pydantic import TypeAdapter

    plain = TypeAdapter(ReportDocument).dump_python(document, mode="json")
    return json.dumps(plain, ensure_ascii=False, allow_nan=False, separators=(",", ":")) + "\n"


def report_schema() -> dict[str, Any]:
    """JSON Schema (draft 2020-12) of the twin, generated from its dataclasses."""
    from pydantic import TypeAdapter

    schema = TypeAdapter(ReportDocument).json_schema(mode="serialization")
    for definition in (schema, *schema.get("$defs", {}).values()):
        if definition.get("type") == "object":
            definition["additionalProperties"] = False
            definition["required"] = sorted(definition.get("properties", {}))
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "scissorcal report",
        **{name: value for name, value in schema.items() if name != "title"},
    }


def schema_text() -> str:
    """The schema as it stands in ``data_schemas/report.schema.json``."""
    return json.dumps(report_schema(), indent=2, sort_keys=True, ensure_ascii=False) + "\n"
