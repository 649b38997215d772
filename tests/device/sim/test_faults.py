"""Fault words: read exactly, and refused with a sentence that says what would be right."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from scissorcal.device.sim.sensors import Faults, parse_faults
from scissorcal.errors import InputError


def test_all_faults_are_read() -> None:
    words = ["drop=0.01", "garble=0.002", "delay=16", "unplug=2.5", "stuck-encoder=1"]
    assert parse_faults(words) == Faults(0.01, 0.002, 16.0, 2.5, 1.0)
    assert parse_faults([]) == Faults()


@pytest.mark.parametrize(
    "word", ["drop", "dorp=0.1", "drop=", "drop=two", "drop=1.5", "drop=nan", "delay=-1", "=1", ""]
)
def test_invalid_options_are_refused(word: str) -> None:
    with pytest.raises(InputError, match="drop=P"):
        parse_faults([word])


def test_a_fault_given_twice_is_refused() -> None:
    with pytest.raises(InputError, match="twice"):
        parse_faults(["drop=0.1", "drop=0.2"])


@given(
    drop=st.floats(0, 1),
    delay=st.floats(0, 1e6),
    unplug=st.none() | st.floats(0, 1e6),
)
def test_numbers_are_read_exactly(drop: float, delay: float, unplug: float | None) -> None:
    words = [f"drop={drop!r}", f"delay={delay!r}"]
    words += [] if unplug is None else [f"unplug={unplug!r}"]
    assert parse_faults(words) == Faults(drop_share=drop, delay_ms=delay, unplug_s=unplug)
