"""Write a workspace's report, and tell which fits a report shows."""

import json
from typing import Any

from scissorcal.workday.workspace import Workspace


def reported_fits(workspace: Workspace) -> set[str]:
    """Return the inputs hashes of the fits that the report there shows; none if it is damaged."""
    try:
        facts = json.loads(workspace.report_json.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return set()
    return set(_values(facts, "inputs_hash"))


def _values(facts: Any, key: str) -> list[str]:
    if isinstance(facts, dict):
        here = [facts[key]] if isinstance(facts.get(key), str) else []
        return here + [found for inner in facts.values() for found in _values(inner, key)]
    if isinstance(facts, list):
        return [found for inner in facts for found in _values(inner, key)]
    return []
