"""What a package states about the error of its tables: measured, and proved where it can be."""

from collections.abc import Mapping

from scissorcal.package.average import AverageTorque
from scissorcal.package.bound import SHARE_OF_TOLERANCE, STATED_OVER_SEEN, SearchGrid, deviation
from scissorcal.package.compile import Compiled, scene_ranges, table_file, table_laws
from scissorcal.package.exact import ExactModel
from scissorcal.package.proved_tables import ProvedTable, proved_table, seen_deviation
from scissorcal.package.proved_torque import proved_torque
from scissorcal.package.records import Bound, TableBound
from scissorcal.package.tables import TableLaw
from scissorcal.recipe.schema import Recipe

GRID_POINTS = 40_000
"""Places at which the deviation is measured; the search for the smallest tables uses as many."""

_UNITS = {"edge": "m", "response": "N", "mean_energy": "J/m", "friction_angle": "1"}


def stated_bound(model: ExactModel, compiled: Compiled, recipe: Recipe) -> Bound:
    """Measure the torque of tables against their model's, and prove what can be proved.

    ``compiled`` are float32 or int16 tables of ``model``, with the choice of each.
    """
    scene, limit = scene_ranges(recipe), recipe.limits.torque_Nm
    friction = compiled.mechanics.friction
    slowest = friction.rate_eps_rad_per_s if friction else 0.0
    average = AverageTorque(compiled.mechanics, scene, compiled.arrays)
    found = deviation(model, average, SearchGrid(scene, GRID_POINTS, slowest), limit)
    stated = STATED_OVER_SEEN * found.largest
    laws = table_laws(model, recipe)
    proofs = {
        name: proved_table(law, compiled.arrays[table_file(name)]) for name, law in laws.items()
    }
    proved_Nm, not_proved = proved_torque(model, laws, proofs, compiled, scene, limit)
    return Bound(
        largest_seen_Nm=found.largest,
        stated_Nm=stated,
        scene_torque_Nm=found.scene_torque,
        share=stated / found.scene_torque if found.scene_torque > 0 else 0.0,
        allowed_share=SHARE_OF_TOLERANCE * recipe.scene.tolerance_percent / 100.0,
        points=found.points,
        table_tolerance=max(choice.tolerance for choice in compiled.choices.values()),
        from_rate_rad_per_s=slowest,
        proved_Nm=proved_Nm,
        not_proved=(not_proved, *_unproved(proofs)),
        tables=tuple(_table_bound(name, law, compiled, proofs[name]) for name, law in laws.items()),
    )


def _table_bound(
    name: str, law: TableLaw, compiled: Compiled, proof: ProvedTable | None
) -> TableBound:
    array, choice = compiled.arrays[table_file(name)], compiled.choices[name]
    return TableBound(
        table=name,
        unit=_UNITS.get(name, "N m"),
        knots=array.shape[1],
        number_format="int16" if table_file(name) in compiled.rows else "float32",
        tolerance=choice.tolerance,
        largest_seen=seen_deviation(law, array),
        proved=None if proof is None else proof.proved,
    )


def _unproved(proofs: Mapping[str, ProvedTable | None]) -> tuple[str, ...]:
    return tuple(
        f"{name}: no bound is proved, as its law is the result of a search, whose second "
        "derivative nothing bounds; what was seen is measured."
        for name, proof in proofs.items()
        if proof is None
    )
