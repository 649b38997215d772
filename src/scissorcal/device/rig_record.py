"""What a recording holds of its rig: the identity that it stated, its motor's sign, its probe."""

import re
import sys
from collections.abc import Mapping
from typing import Any, get_type_hints

from scissorcal.errors import InputError
from scissorcal.kernel.messages import Identity
from scissorcal.recording.probe import PROBE_KEY, ProbeResult


def rig_facts(identity: Identity, motor_sign: int, probe: ProbeResult | None) -> dict[str, Any]:
    """What a recording holds of its rig: the identity, a motor sign of -1, and the probe.

    Torques in the recording are of the corrected sign.
    """
    facts = identity_facts(identity)
    if motor_sign != 1:
        facts["motor_sign"] = motor_sign
    if probe is not None:
        facts[PROBE_KEY] = probe.as_dict()
    return facts


def identity_facts(identity: Identity) -> dict[str, Any]:
    """The identity as plain numbers and strings, for a recording; the hash in hexadecimal."""
    facts = identity._asdict()
    del facts["nonce_echo"]
    return {**facts, "schema_hash": f"{identity.schema_hash:016x}"}


def identity_of(facts: Mapping[str, Any], source: str) -> Identity:
    """The identity that the facts of the recording ``source`` state, as `identity_facts` wrote it.

    Raises InputError, which names ``source`` and the field, where one is missing or no number.
    """
    known = {**facts, "nonce_echo": 0, "schema_hash": _hash(facts.get("schema_hash"))}
    for name, kind in get_type_hints(Identity).items():
        if not _is(known.get(name), kind):
            raise InputError(
                f"{source or 'The recording'} is damaged: what it holds of its rig has no {name} "
                "that is a number or text as a rig states it. Capture again, or restore it from a "
                "backup."
            )
    return Identity(**{name: known[name] for name in Identity._fields})


def _is(value: Any, kind: type) -> bool:
    """Whether a value is one that the wire bears; JSON's integers may be of any length."""
    if kind is float:
        return type(value) in (int, float) and abs(value) <= sys.float_info.max
    if kind is int:
        return type(value) is int and 0 <= value < 1 << 64
    return type(value) is kind


def _hash(value: Any) -> int | None:
    """A hash of 64 bits as `identity_facts` writes it; None for any other text or value."""
    written = isinstance(value, str) and re.fullmatch("[0-9a-f]{16}", value)
    return int(value, 16) if written else None
