"""`bench trade` on a day of the virtual rig, with its real knobs."""

from contextlib import suppress

import pytest

from scissorcal.bench.trade.knob import make_knob, scene_knobs
from scissorcal.bench.trade.result import Trade
from scissorcal.bench.trade.study import tasks_of
from scissorcal.errors import InputError
from scissorcal.workday import (
    Engine,
    Processes,
    TradeOptions,
    Workspace,
    create_workspace,
    load_case,
    make_day,
    trade_workspace,
)


@pytest.fixture(scope="module")
def day(tmp_path_factory: pytest.TempPathFactory) -> Workspace:
    workspace = create_workspace(tmp_path_factory.mktemp("trade") / "day", "press-only")
    make_day(workspace, seed=9320, effort="draft")
    return workspace


@pytest.mark.slow
def test_every_knob_of_a_scene_has_one_present_setting(day: Workspace) -> None:
    case = load_case(Engine.of(day))
    names = scene_knobs(case)
    assert {"effort", "window", "capture", "tables", "rate"} <= set(names)
    for name in names:
        settings = make_knob(name).settings(case)
        assert sum(one.present for one in settings) == 1, name
        assert len({one.label for one in settings}) == len(settings), name
    assert len(tasks_of(case, names)) > 50


@pytest.mark.slow
def test_a_day_is_measured_within_a_budget_and_goes_on(day: Workspace) -> None:
    knobs = ("effort", "tables")
    first, budget_s = measured_in_part(day, knobs)
    case = load_case(Engine.of(day))
    planned = tasks_of(case, knobs)
    assert 0 < first.measured == first.measured_now < len(planned)
    for curve in first.curves:
        named = [*(point.setting.label for point in curve.points), *curve.unmeasured]
        assert sorted(named) == sorted(s.label for s in make_knob(curve.knob).settings(case))
    assert any(curve.unmeasured for curve in first.curves)
    tables = next(curve for curve in first.curves if curve.knob == "tables")
    assert tables.points
    for point in tables.points:
        assert point.errors[tables.error].value > 0.0
        assert point.costs[tables.cost].median > 0.0
    second = trade_workspace(day, TradeOptions(knobs, budget_s=budget_s), Processes(2))[0]
    assert second.measured == first.measured + second.measured_now


def measured_in_part(day: Workspace, knobs: tuple[str, ...]) -> tuple[Trade, float]:
    """A run whose budget is enough for some of the measurements, on a computer of any speed.

    The budget is doubled until it is no longer refused as too small for any measurement, so that
    it is at most about twice what the first few measurements take.
    """
    for doubling in range(8):
        chosen = TradeOptions(knobs=knobs, budget_s=3.0 * 2.0**doubling)
        with suppress(InputError):  # the budget is too small for any measurement
            return trade_workspace(day, chosen, Processes(2))[0], 3.0 * 2.0**doubling
    raise AssertionError("no budget up to 384 s was enough for one measurement")
