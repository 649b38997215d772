"""The part of `tests.explore` inside pytest: a share of the time for each test, seed after seed.

Each test that hypothesis drives runs again and again, with a new seed each time, until its share of
what is left of the round is used up; its module's and session's fixtures stay. A slow test does not
take more: the rest of its seed's examples is left out. What a test did and the first failure of
each are written to a file of JSON lines at once, so that they survive a crash.
"""

import functools
import json
import math
import random
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest
from _pytest.runner import runtestprotocol
from hypothesis import core
from hypothesis.errors import HypothesisException, StopTest


def pytest_addoption(parser: pytest.Parser) -> None:
    group = parser.getgroup("explore")
    group.addoption("--explore-until", type=float, required=True, help="seconds since the epoch")
    group.addoption("--explore-seed", type=int, required=True, help="what all seeds come from")
    group.addoption("--explore-part", required=True, help="which files: 0/2 is every other one")
    group.addoption("--explore-to", type=Path, required=True, help="the file of JSON lines")


def pytest_configure(config: pytest.Config) -> None:
    config.pluginmanager.register(Exploration(config), "exploration")


class Exploration:
    """One process's part of a round."""

    def __init__(self, config: pytest.Config) -> None:
        part, parts = config.getoption("--explore-part").split("/")
        self.part, self.parts = int(part), int(parts)
        self.until: float = config.getoption("--explore-until")
        self.to: Path = config.getoption("--explore-to")
        self.order = random.Random(config.getoption("--explore-seed"))
        self.seeds = random.Random(f"{config.getoption('--explore-seed')} {part}")
        self.left = 0
        self.any_tried = False

    @pytest.hookimpl(trylast=True)
    def pytest_collection_modifyitems(self, items: list[pytest.Item]) -> None:
        """Keep this part's files, in an order of chance: the last ones may get no time."""
        files = sorted({item.path for item in items})
        self.order.shuffle(files)
        place = {path: n for n, path in enumerate(files)}
        items[:] = [
            item
            for item in sorted(items, key=lambda item: place[item.path])
            if place[item.path] % self.parts == self.part and item.get_closest_marker("hypothesis")
        ]
        self.left = len(items)

    def pytest_runtest_protocol(self, item: pytest.Item, nextitem: pytest.Item | None) -> bool:
        began = time.time()
        share = (self.until - began) / self.left
        self.left -= 1
        if share <= 0.0 and self.any_tried:
            return True
        self.any_tried = True
        runs, failed = 0, False
        # Where no time was given, the first test tries one seed.
        with until(item.obj, began + share if share > 0.0 else math.inf) as tried:
            while not failed and (runs == 0 or time.time() < began + share):
                seed = self.seeds.getrandbits(32)
                self._write(test=item.nodeid, seed=seed)
                reports = _run(item, seed)
                runs += 1
                if tried.cut_short or any(report.skipped for report in reports):
                    break
                failed = any(report.failed for report in reports)
                if failed:
                    self._write(test=item.nodeid, seed=seed, failure=_said(item, reports))
        item.session._setupstate.teardown_exact(nextitem)
        seconds = time.time() - began
        self._write(test=item.nodeid, runs=runs, examples=tried.examples, seconds=seconds)
        return True

    def _write(self, **what: Any) -> None:
        with self.to.open("a") as to:
            to.write(json.dumps(what) + "\n")


@dataclass
class Tried:
    """How many examples a test tried, whether it failed, and whether its time was up before."""

    examples: int = 0
    failed: bool = False
    cut_short: bool = False


@contextmanager
def until(test: Any, end: float) -> Iterator[Tried]:
    """Let a test try examples until its time is up, but one at least, and all after a failure.

    Where it ends it skips the test. Of one that draws as it goes, hypothesis then says that it does
    not always draw the same, which is no failure: ``cut_short`` says so.
    What hypothesis draws until then is the same as without this, so that the seed alone shows a
    failure again. Tests of a state machine have no inner function: they are not cut short.
    """
    tried = Tried()
    handle = getattr(test, "hypothesis", None)
    if handle is None:
        yield tried
        return
    inner = handle.inner_test

    @functools.wraps(inner)
    def timed(*args: Any, **kwargs: Any) -> Any:
        if time.time() >= end and tried.examples > 0 and not tried.failed:
            tried.cut_short = True
            pytest.skip("the test's share of the time is up")
        tried.examples += 1
        try:
            return inner(*args, **kwargs)
        except BaseException as why:
            tried.failed |= not isinstance(why, HypothesisException | StopTest)
            raise

    handle.inner_test = timed
    try:
        yield tried
    finally:
        handle.inner_test = inner


def _run(item: pytest.Item, seed: int) -> Sequence[pytest.TestReport]:
    core.global_force_seed = seed
    item.hypothesis_report_information = ""
    # What comes next is the item's parent: the item is torn down, and its module is not.
    return runtestprotocol(item, log=False, nextitem=item.parent)


def _said(item: pytest.Item, reports: Sequence[pytest.TestReport]) -> str:
    said = "\n".join(report.longreprtext for report in reports if report.failed)
    return f"{said}\n{item.hypothesis_report_information}"
