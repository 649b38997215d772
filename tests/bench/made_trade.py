"""A knob that costs nothing to measure, and a case for it."""

import time
from collections.abc import Mapping
from dataclasses import replace

from scissorcal.bench.trade.case import Case
from scissorcal.bench.trade.point import Error, Quantity, Sample, Setting
from scissorcal.errors import InputError
from scissorcal.recipe import builtin_recipe
from tests.guard import GUARD_S

FAILING = "impossible"
ERRORS = {"coarse": 0.5, "middle": 0.01, "fine": 0.0001}


def made_case(tolerance_percent: float = 7.0) -> Case:
    """A scene without recordings or fits."""
    recipe = builtin_recipe("paper-80gsm")
    scene = recipe.scene.model_copy(update={"tolerance_percent": tolerance_percent})
    recipe = recipe.model_copy(update={"scene": scene})
    return Case(recipe, (), (), None, (), None, None, "standard")


class Steps:
    """Finer steps cost more and leave less error; one setting is refused."""

    name = "steps"
    title = "Steps"
    cost = "processor time"
    error = "worst torque error"
    against = "the exact steps"
    of_torque, stand_in, combined = True, True, True

    def missing(self, case: Case) -> str:
        """Every case has it."""
        return ""

    def settings(self, case: Case) -> tuple[Setting, ...]:
        """Three that work and one that does not."""
        labels = (*ERRORS, FAILING)
        return tuple(Setting(n, i, present=n == "fine") for i, n in enumerate(labels, start=1))

    def applied(self, case: Case, setting: Setting) -> Case:
        """Seeds are as good as settings."""
        return replace(case, seed=int(setting.size))

    def expected_s(self, case: Case, setting: Setting) -> float:
        """As much as it says it costs."""
        return setting.size

    def repeats(self, case: Case, setting: Setting) -> int:
        """Twice."""
        return 2

    def measure(self, case: Case, setting: Setting, repeat: int) -> Sample:
        """State what is known beforehand; one setting raises."""
        if setting.label == FAILING:
            raise InputError("No step is that fine.")
        cost = Quantity(setting.size + 0.1 * repeat, "s")
        return Sample({self.cost: cost}, {"error": ERRORS[setting.label]})

    def errors(self, case: Case, sample: Sample, reference: Sample | None) -> Mapping[str, Error]:
        """The error itself, as a share of 1 N m."""
        value = sample.outcome["error"]
        return {self.error: Error(value, "N m", value)}


class Slow(Steps):
    """A knob whose measurements take far longer than is allowed."""

    name = "slow"

    def measure(self, case: Case, setting: Setting, repeat: int) -> Sample:
        """Sleep for longer than anything is waited for."""
        time.sleep(GUARD_S)
        return super().measure(case, setting, repeat)


class Broken(Steps):
    """A knob that gives no numbers."""

    name = "broken"

    def measure(self, case: Case, setting: Setting, repeat: int) -> Sample:
        """Give a number that does not exist."""
        return Sample({self.cost: Quantity(1.0, "s")}, {"error": float("nan")})


class Other(Steps):
    """Another knob of the same kind."""

    name = "other"


class Plate(Steps):
    """A knob that is named like the one of photographs of the plate."""

    name = "plate"


MADE = {
    name: f"tests.bench.made_trade:{name.title()}"
    for name in ("steps", "slow", "broken", "other", "plate")
}
