"""Examples of property tests: the same in every run of the suite, fresh ones in an exploration.

A test draws its examples from a seed that is a digest of its own source, and nothing is kept
between runs: two runs of one commit try the same examples. Two things of hypothesis would still
make them differ, and are switched off here:

- it mixes constants of the modules that happen to be loaded into what it draws, and under
  pytest-xdist that depends on which files a worker was handed before;
- it fails a test whose examples took long to draw, and the machine is shared.

`explore` is the profile of `python -m tests.explore` and of the commands that it prints: the seed
comes from `--hypothesis-seed`, the explicit examples are left to the suite, and constants are drawn
from the whole source, whatever is loaded, because a program's faults lie near its constants.
Decision 174.
"""

from functools import cache
from pathlib import Path

from hypothesis import HealthCheck, Phase, settings
from hypothesis.internal.conjecture import providers
from hypothesis.internal.constants_ast import Constants, _constants_from_source

import scissorcal

SUITE = "suite"
EXPLORE = "explore"


def use_profiles() -> None:
    """Register both profiles and load the suite's; pytest's --hypothesis-profile loads the other.

    hypothesis has no setting for the constants that it draws: its function is replaced. It is a
    private one; `tests/test_explore.py` fails if a later hypothesis no longer asks it.
    """
    always = {"deadline": None, "database": None, "suppress_health_check": [HealthCheck.too_slow]}
    settings.register_profile(SUITE, derandomize=True, **always)
    settings.register_profile(
        EXPLORE,
        derandomize=False,
        print_blob=True,
        phases=[Phase.generate, Phase.target, Phase.shrink],
        **always,
    )
    settings.load_profile(SUITE)
    providers._get_local_constants = _constants_to_draw


def _constants_to_draw() -> Constants:
    if settings.get_current_profile_name() == EXPLORE:
        return _constants_of_the_source()
    return _no_constants()


@cache
def _no_constants() -> Constants:
    return Constants()


@cache
def _constants_of_the_source() -> Constants:
    found = Constants()
    for path in Path(scissorcal.__file__).parent.rglob("*.py"):
        found |= _constants_from_source(path.read_bytes(), limit=True)
    # In order: which of a set's strings comes first is another one in each process.
    return Constants(
        integers=sorted(found.integers),
        floats=sorted(found.floats),
        bytes=sorted(found.bytes),
        strings=sorted(found.strings),
    )
