"""What a pass by hand says of an encoder, and of a person who does not follow."""

import pytest

from scissorcal.device.probe.hand_pass import HandPass, judge_hand_pass
from tests.strange_device import StrangeDevice, VirtualPort

IDENTITY = VirtualPort(StrangeDevice()).identity
LOW, HIGH = IDENTITY.opening_min, IDENTITY.opening_max
STEP = IDENTITY.opening_resolution


def said(*passes: tuple[float, float]) -> dict[str, tuple[str, str]]:
    closed, opened = zip(*passes, strict=True)
    verdicts = judge_hand_pass(HandPass(closed, opened, STEP), IDENTITY)
    return {verdict.check: (verdict.status, verdict.why) for verdict in verdicts}


def test_both_stops_where_they_are_stated_pass() -> None:
    assert {status for status, _ in said((LOW + 0.01, HIGH - 0.01)).values()} == {"pass"}


@pytest.mark.parametrize(
    ("scale", "words"), [(-1.0, "is reversed"), (2.0, "a factor 2"), (0.5, "a factor 0.5")]
)
def test_two_passes_that_agree_accuse_the_encoder(scale: float, words: str) -> None:
    way = scale * (HIGH - LOW)
    status, why = said((LOW, LOW + way), (LOW, LOW + 1.01 * way))["count scale"]
    assert status == "fail"
    assert words in why


def test_two_passes_that_differ_accuse_nobody() -> None:
    status, why = said((HIGH, LOW), (LOW, 0.5 * HIGH))["count scale"]
    assert status == "not_evaluated"
    assert "press on both stops" in why


def test_blades_that_nobody_moved_accuse_nobody() -> None:
    status, why = said((0.5, 0.5), (0.5, 0.5 + 2.0 * STEP))["count scale"]
    assert status == "not_evaluated"
    assert "nobody moved them or the encoder is stuck" in why


def test_a_zero_that_is_off_at_both_stops_is_named() -> None:
    found = said((LOW + 0.1, HIGH + 0.1), (LOW + 0.1, HIGH + 0.1))
    assert found["count scale"][0] == "pass"
    assert found["opening zero"][0] == "fail"
