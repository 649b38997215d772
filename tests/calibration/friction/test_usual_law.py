"""The law that draft effort fits to sweeps where nothing was chosen before."""

from dataclasses import dataclass
from typing import Any

import pytest

from scissorcal.calibration.friction.choice import usual_law
from scissorcal.model import CANDIDATES
from scissorcal.recording import Joint


@dataclass(frozen=True)
class Law:
    """A candidate by its name, symmetry and joint alone."""

    key: dict[str, Any]
    joint: Joint


def laws(kind: Any, *names: str) -> list[Any]:
    either = (True, False) if kind == "linear" else (False, True)
    return [Law({"law": n, "symmetric": s}, Joint(kind)) for n in names for s in either]


@pytest.mark.parametrize(
    ("kind", "names", "wanted"),
    [
        ("rotary", CANDIDATES, {"law": "stribeck+angle", "symmetric": False}),
        ("linear", CANDIDATES, {"law": "coulomb+viscous", "symmetric": True}),
        ("rotary", CANDIDATES[:2], {"law": "coulomb+viscous", "symmetric": False}),
        ("linear", CANDIDATES[3:], {"law": "stribeck+angle", "symmetric": True}),
    ],
)
def test_the_usual_law_is_the_richest_without_an_unusual_term(
    kind: str, names: tuple[str, ...], wanted: dict[str, Any]
) -> None:
    assert usual_law(laws(kind, *names)).key == wanted
