"""One hash for all that a fit depends on, so that equal inputs are fitted once."""

import hashlib
import json

from scissorcal.model import EdgeBelief
from scissorcal.recording.recording import Recording

ALGORITHM = 8
"""Raised whenever a fit of the same inputs would give other numbers."""


def fit_inputs_hash(
    what: str,
    recordings: tuple[Recording, ...],
    settings_json: str,
    effort: str,
    upstream: str = "",
) -> str:
    """SHA-256 over the recordings' content, the settings, the effort and the fits used.

    ``settings_json`` is the canonical text of the recipe's parts that matter, ``upstream`` the
    inputs hash of a fit that this one builds on.
    """
    facts = {
        "algorithm": ALGORITHM,
        "what": what,
        "recordings": sorted(recording.content_hash for recording in recordings),
        "settings": json.loads(settings_json),
        "effort": effort,
        "upstream": upstream,
    }
    text = json.dumps(facts, sort_keys=True, separators=(",", ":"))
    return hashlib.sha256(text.encode()).hexdigest()


def cut_upstream(friction_hash: str, edge: EdgeBelief | None) -> str:
    """What a cut's fit builds on: friction's fit, and the edge where photographs gave it."""
    if edge is None:
        return friction_hash
    facts = [str(edge.edge), list(edge.names), edge.covariance.tolist()]
    return friction_hash + hashlib.sha256(json.dumps(facts).encode()).hexdigest()
