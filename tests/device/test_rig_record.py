"""What a recording holds of its rig: it comes back, and whatever else stands there is refused."""

import json
import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from scissorcal.device.session import identity_facts, identity_of
from scissorcal.errors import InputError
from scissorcal.kernel import Identity
from tests.bench.trade.cases import IDENTITY

FACTS = identity_facts(IDENTITY)
PLAIN = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=5),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=3), inner),
    max_leaves=5,
)


def test_an_identity_comes_back_from_json() -> None:
    facts = json.loads(json.dumps(FACTS))
    assert identity_of(facts, "a.mcap") == IDENTITY._replace(nonce_echo=0)


@given(st.sampled_from(sorted(FACTS)), PLAIN)
def test_a_field_of_another_kind_is_refused_by_name(name: str, value: object) -> None:
    found = outcome({**FACTS, name: value})
    if isinstance(found, str):
        assert found.startswith("a.mcap is damaged")
        assert f" no {name} " in found
        return
    stated, kind = getattr(found, name), Identity.__annotations__[name]
    assert type(stated) is kind or (kind is float and math.isfinite(stated))
    assert kind is not int or stated >= 0


HUGE = 10**400
HASHES = ("", "0", "B09FB42A7F073F64", "0x9fb42a7f073f64", "b09f_b42a_7f073f", " 9fb42a7f073f64 ",
          "-b09fb42a7f073f6", "b09fb42a7f073f6", "b09fb42a7f073f640", "b09fb42a7f073f64\n",
          "\u0661" * 16, 0, 12724852165138669412)  # fmt: skip


@pytest.mark.parametrize(
    ("name", "value"),
    [(name, sign * HUGE) for name in sorted(FACTS) for sign in (1, -1)]
    + [(name, -1) for name in sorted(FACTS) if Identity.__annotations__[name] is int]
    + [("schema_hash", value) for value in HASHES]
    + [("torque_limit", math.nan), ("torque_limit", -math.inf), ("torque_limit", True)],
    ids=lambda one: repr(one)[:24],
)
def test_what_no_rig_states_is_refused(name: str, value: object) -> None:
    """JSON's integers may be of any length, and its hash any text that Python takes as a number."""
    read = json.loads(json.dumps({**FACTS, name: value}))
    with pytest.raises(InputError, match=f"^a.mcap is damaged.* no {name} "):
        identity_of(read, "a.mcap")


def outcome(facts: dict[str, object]) -> Identity | str:
    """The identity of some facts, or the sentence that refuses them."""
    try:
        return identity_of(facts, "a.mcap")
    except InputError as refusal:
        return str(refusal)


@pytest.mark.parametrize("name", sorted(FACTS))
def test_a_field_that_is_missing_is_named(name: str) -> None:
    facts = {key: value for key, value in FACTS.items() if key != name}
    with pytest.raises(InputError, match=f"no {name} "):
        identity_of(facts, "a.mcap")
