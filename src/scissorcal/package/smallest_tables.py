"""The smallest tables whose error bound fits the share of the tolerance that tables may use."""

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import product

import numpy as np
from numpy.typing import NDArray

from scissorcal.package.average import AverageTorque
from scissorcal.package.bound import (
    SHARE_OF_TOLERANCE,
    STATED_OVER_SEEN,
    ExactTorque,
    SearchGrid,
    deviation,
    telling_points,
)
from scissorcal.package.compile import (
    TOLERANCE,
    Compiled,
    TableChoice,
    compile_model,
    kernel_tables,
    scene_mechanics,
    scene_ranges,
    table_file,
    table_laws,
    table_of_law,
)
from scissorcal.package.exact import ExactModel
from scissorcal.package.stated_bound import GRID_POINTS
from scissorcal.package.table_cost import bytes_of
from scissorcal.package.tables import NumberFormat, Rows
from scissorcal.recipe.schema import Recipe

TOLERANCES = tuple(0.2 * 0.5**step for step in range(18))
"""Of a table, as a share of its value: from 20 % down to 1.5e-6."""

SEARCH_POINTS = 5_000
BUDGETS = tuple(0.85**step for step in range(24))
"""Shares of what is allowed that the tables' single deviations may add up to: from all to 2 %."""


@dataclass(frozen=True)
class _Option:
    """One way to make one table, and the deviation (N m) with all others at their finest."""

    choice: TableChoice
    array: NDArray[np.float32]
    rows: Rows | None
    bytes: int
    away: float = 0.0


Options = Mapping[str, list[_Option]]
Picked = dict[str, int]
"""The index of the option that is taken, by table."""


def package_tables(model: ExactModel, recipe: Recipe, tolerance: float | None = None) -> Compiled:
    """The tables that a package of this recipe gets.

    They are the smallest ones, or with ``scene.simplify = false`` those of a fixed fine tolerance.
    ``tolerance``, each table's as a share of its value, overrides both. Raises InputError as
    `compile_model` does.
    """
    if tolerance is None and recipe.scene.simplify:
        return smallest_tables(model, recipe)
    return compile_model(model, recipe, tolerance=TOLERANCE if tolerance is None else tolerance)


def smallest_tables(
    model: ExactModel, recipe: Recipe, *, number_format: NumberFormat | None = None
) -> Compiled:
    """Search tolerance and number format of each table for the fewest bytes that are fine enough.

    Fine enough: twice the largest deviation found between kernel and exact model is at most a tenth
    of the scene's tolerance, as a share of the torque at its place (of ``FELT_SHARE`` of the
    largest where it is weaker). Each table alone is made at falling tolerances, the
    others at their finest; the cheapest set whose deviations add up to what is allowed is measured
    as a whole. Where it does not fit, they may add up to less; then tables are made coarser one by
    one as long as the bound fits. So in the result no table can be one of the sizes tried smaller;
    other sets of sizes were not tried. 16-bit numbers are tried where ``number_format`` (by default
    ``scene.number_format``) asks for them, and taken where they save bytes. Where not even the
    finest tables fit, those are returned: the caller's bound says by how much.

    Raises InputError as `compile_model` does.
    """
    search = _Search(model, recipe, number_format or recipe.scene.number_format)
    options = {name: search.options(name) for name in search.laws}
    allowed = SHARE_OF_TOLERANCE * recipe.scene.tolerance_percent / 100.0
    budget = allowed * search.scene_torque / STATED_OVER_SEEN
    finest = {name: len(several) - 1 for name, several in options.items()}
    for share in BUDGETS:
        picked = _cheapest(options, share * budget) or finest
        if search.fits(options, picked, budget):
            return search.compiled(options, _coarser(search, options, picked, budget))
    return search.compiled(options, finest)


class _Search:
    """Makes tables of a model and measures them."""

    def __init__(self, model: ExactModel, recipe: Recipe, number_format: NumberFormat) -> None:
        self.laws = table_laws(model, recipe)
        self._formats: tuple[NumberFormat, ...] = ("float32",)
        if number_format == "int16":
            self._formats = ("float32", "int16")
        self._model, self._mechanics = model, scene_mechanics(model, recipe)
        self._scene, self._limit = scene_ranges(recipe), recipe.limits.torque_Nm
        friction = self._mechanics.friction
        self._slowest = friction.rate_eps_rad_per_s if friction else 0.0
        points = telling_points(model, SearchGrid(self._scene, SEARCH_POINTS, self._slowest))
        exact = ExactTorque.at(model, points, self._limit)
        self.scene_torque = float(np.max(np.abs(exact.torque)))
        self._exact = ExactTorque.at(model, points, self._limit, self.scene_torque)
        self._finest = {name: self._option(name, TableChoice(TOLERANCES[-1])) for name in self.laws}
        whole = kernel_tables(self._mechanics, self._scene, self._arrays(self._finest))
        self._falls = whole.release_falls

    def options(self, name: str) -> list[_Option]:
        """Ways to make one table, fewest bytes first, each closer to the model than the last."""
        by_size: dict[int, _Option] = {}
        for tolerance, number_format in product(TOLERANCES, self._formats):
            option = self._option(name, TableChoice(tolerance, number_format))
            by_size.setdefault(option.bytes, option)
        by_size.setdefault(self._finest[name].bytes, self._finest[name])
        found: list[_Option] = []
        for size in sorted(by_size):
            one = by_size[size]
            away = self._away(self._arrays({**self._finest, name: one}))
            if away < (found[-1].away if found else np.inf):
                found.append(_Option(one.choice, one.array, one.rows, one.bytes, away))
        return found or [self._finest[name]]

    def fits(self, options: Options, picked: Picked, budget: float) -> bool:
        """Whether the largest deviation of a set is at most the budget (N m)."""
        arrays = self._arrays({name: options[name][index] for name, index in picked.items()})
        if self._away(arrays) > budget:
            return False
        average = AverageTorque(self._mechanics, self._scene, arrays)
        found = deviation(
            self._model,
            average,
            SearchGrid(self._scene, GRID_POINTS, self._slowest),
            self._limit,
            largest=self.scene_torque,
        )
        return found.largest <= budget

    def compiled(self, options: Options, picked: Picked) -> Compiled:
        """The tables that were picked, as a package takes them."""
        chosen = {name: options[name][index] for name, index in picked.items()}
        rows = {table_file(name): one.rows for name, one in chosen.items() if one.rows}
        choices = {name: one.choice for name, one in chosen.items()}
        return Compiled(self._arrays(chosen), self._mechanics, rows, choices)

    def _option(self, name: str, choice: TableChoice) -> _Option:
        fitted = table_of_law(name, self.laws[name], choice)
        array = fitted.array.astype(np.float32)
        size = bytes_of(array.shape[1], choice.number_format)
        return _Option(choice, array, fitted.rows, size)

    def _arrays(self, chosen: Mapping[str, _Option]) -> dict[str, NDArray[np.float32]]:
        return {table_file(name): one.array for name, one in chosen.items()}

    def _away(self, arrays: Mapping[str, NDArray[np.float32]]) -> float:
        """Largest deviation on the search's places, infinite where the kernel refuses the tables.

        And where they lose that the release of the crack falls along the blade: a step would be
        slower then.
        """
        try:
            average = AverageTorque(self._mechanics, self._scene, arrays)
            tables = kernel_tables(self._mechanics, self._scene, arrays)
        except ValueError:
            return np.inf
        if self._falls and not tables.release_falls:
            return np.inf
        return float(np.max(self._exact.deviation(average)))


def _cheapest(options: Options, budget: float) -> Picked | None:
    """The fewest bytes whose deviations add up to at most ``budget``; None where none do.

    Tables are added one by one to the front of sums that no other beats in bytes and deviation.
    """
    front: list[tuple[int, float, Picked]] = [(0, 0.0, {})]
    for name, several in options.items():
        sums = [
            (bytes_ + one.bytes, away + one.away, {**picked, name: index})
            for bytes_, away, picked in front
            for index, one in enumerate(several)
            if away + one.away <= budget
        ]
        sums.sort(key=lambda entry: entry[:2])
        front = []
        for entry in sums:
            if not front or entry[1] < front[-1][1]:
                front.append(entry)
    return front[0][2] if front else None


def _coarser(search: _Search, options: Options, picked: Picked, budget: float) -> Picked:
    """Make tables one size smaller, what saves most first, as long as the bound fits."""
    while True:
        saved = {
            name: options[name][index].bytes - options[name][index - 1].bytes
            for name, index in picked.items()
            if index > 0
        }
        for name in sorted(saved, key=lambda name: -saved[name]):
            tried = {**picked, name: picked[name] - 1}
            if search.fits(options, tried, budget):
                picked = tried
                break
        else:
            return picked
