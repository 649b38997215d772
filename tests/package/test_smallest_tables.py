"""The smallest tables that fit, what they cost, and packages that store them in 16-bit numbers."""

import json
from pathlib import Path

import numpy as np
import pytest

from scissorcal.errors import InputError
from scissorcal.kernel import missing_tools
from scissorcal.package import PackageSummary, build_package, open_package, put_review
from scissorcal.package.average import AverageTorque
from scissorcal.package.bound import ExactTorque
from scissorcal.package.compile import TOLERANCE, compile_model, scene_ranges
from scissorcal.package.exact import FitDraws, central_model
from scissorcal.package.grid import spread_points
from scissorcal.package.manifest import content_hash
from scissorcal.package.smallest_tables import smallest_tables
from scissorcal.package.stated_bound import stated_bound
from scissorcal.package.table_cost import bytes_of, cost_and_error, table_bytes
from tests.package.fits import cut_fit, friction_fit, recipe
from tests.package.test_archive import forge, members


@pytest.fixture(scope="module")
def stored16(tmp_path_factory: pytest.TempPathFactory) -> PackageSummary:
    """Paper whose tables are in 16-bit numbers where that saves bytes."""
    chosen = recipe(number_format="int16", simplify=True)
    path = tmp_path_factory.mktemp("package") / "paper16.zip"
    return build_package(
        chosen, friction_fit(), cut_fit(chosen, kappa=0.75), path, np.random.default_rng(3)
    )


@pytest.mark.parametrize("title", ["paper-80gsm", "press-only"])
def test_they_fit_their_share_of_the_tolerance(title: str) -> None:
    chosen = recipe(title)
    cut = cut_fit(chosen, **({} if chosen.scene.cut else {"energy": None, "force": 5.0}))
    model = central_model(FitDraws.centre(cut), FitDraws.centre(friction_fit()))
    fine, small = compile_model(model, chosen), smallest_tables(model, chosen)
    bound = stated_bound(model, small, chosen)
    assert bound.share <= bound.allowed_share
    assert table_bytes(small) < 0.6 * table_bytes(fine)
    tight = chosen.model_copy(
        update={"scene": chosen.scene.model_copy(update={"tolerance_percent": 0.07})}
    )
    finer = smallest_tables(model, tight)
    assert stated_bound(model, finer, tight).share <= 7e-5
    assert table_bytes(small) < table_bytes(finer)


@pytest.mark.parametrize("title", ["paper-80gsm", "press-only"])
def test_they_fit_it_of_the_torque_at_each_place(title: str) -> None:
    """At places of which none was looked at; the largest error alone allows 20 times as much."""
    chosen = recipe(title)
    cut = cut_fit(chosen, **({} if chosen.scene.cut else {"energy": None, "force": 5.0}))
    model = central_model(FitDraws.centre(cut), FitDraws.centre(friction_fit()))
    small, scene = smallest_tables(model, chosen), scene_ranges(chosen)
    limit = chosen.limits.torque_Nm
    friction = small.mechanics.friction
    points = spread_points(scene, 3_001, friction.rate_eps_rad_per_s if friction else 0.0)
    largest = float(np.max(np.abs(ExactTorque.at(model, points, limit).torque)))
    exact = ExactTorque.at(model, points, limit, largest)
    away = exact.deviation(AverageTorque(small.mechanics, scene, small.arrays))
    assert np.max(away) / largest <= 0.1 * chosen.scene.tolerance_percent / 100.0


def test_a_scene_that_is_not_simplified_keeps_the_finest(tmp_path: Path) -> None:
    chosen = recipe(simplify=False)
    fits = friction_fit(), cut_fit(chosen)
    bound = build_package(
        chosen, *fits, tmp_path / "p.zip", np.random.default_rng(1)
    ).manifest.bound
    assert {one.tolerance for one in bound.tables} == {TOLERANCE} == {bound.table_tolerance}
    assert {one.number_format for one in bound.tables} == {"float32"}


def test_sixteen_bits_are_taken_where_they_save_bytes(
    stored16: PackageSummary,
) -> None:
    """The same law has the smallest tables of either format."""
    tables = {one.table: one for one in stored16.manifest.bound.tables}
    assert tables["response"].number_format == "int16"
    assert tables["edge"].number_format == "float32"  # two knots: offsets and scales cost more
    size = sum(bytes_of(one.knots, one.number_format) for one in tables.values())
    model, chosen = stored16.simplified.central, recipe()
    assert size < table_bytes(smallest_tables(model, chosen, number_format="float32"))
    assert stored16.manifest.bound.share <= stored16.manifest.bound.allowed_share


def test_a_package_of_sixteen_bits_renders_what_it_states(
    stored16: PackageSummary, tmp_path: Path
) -> None:
    package = open_package(stored16.path)
    member = next(m for m in package.manifest.members if m.file == "tables/response.npy")
    assert (member.dtype, member.rows is not None) == ("<i2", True)
    assert package.arrays[member.file].dtype == np.float32
    opening = np.linspace(*package.manifest.ranges.opening_rad, 500)
    exact = package.exact.torque(opening, -0.3, 0.03)
    assert np.max(np.abs(package.torque(opening, -0.3, 0.03) - exact)) <= (
        package.manifest.bound.stated_Nm
    )
    copy = tmp_path / "copy.zip"
    put_review(package, None, copy)
    assert open_package(copy).manifest == package.manifest
    written, again = members(stored16.path), members(copy)
    assert again["tables/response.npy"] == written["tables/response.npy"]


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"rows": None}, "rows"),
        ({"dtype": "<f4"}, "rows"),
        ({"offset": 1e30}, "not an array|form a model"),
        ({"scale": 0.3}, "significant bits"),
        ({"scale": 0.0}, "ascend"),
    ],
)
def test_forged_rows_are_refused(
    change: dict[str, object], words: str, stored16: PackageSummary, tmp_path: Path
) -> None:
    copy = tmp_path / "copy.zip"
    copy.write_bytes(stored16.path.read_bytes())

    def edit(facts: dict, _content: dict) -> None:
        entry = next(m for m in facts["members"] if m["file"] == "tables/response.npy")
        for key, value in change.items():
            (entry if key in entry else entry["rows"][0])[key] = value

    forge(copy, edit)
    with pytest.raises(InputError, match=words):
        open_package(copy)


def test_a_package_without_proofs_opens_and_is_signed(
    paper: PackageSummary, tmp_path: Path
) -> None:
    """As older versions wrote it: no proofs, no rows, and a hash without them."""
    copy = tmp_path / "old.zip"
    copy.write_bytes(paper.path.read_bytes())

    def edit(facts: dict, _content: dict) -> None:
        for key in ("proved_Nm", "not_proved", "tables"):
            del facts["bound"][key]
        for member in facts["members"]:
            del member["rows"]

    forge(copy, edit)
    package = open_package(copy)
    assert package.manifest.bound.proved_Nm is None
    signed = tmp_path / "signed.zip"
    put_review(package, None, signed)
    again = open_package(signed).manifest
    assert again.content_hash == content_hash(json.loads(again.model_dump_json()))


def test_cost_and_error_of_tables() -> None:
    chosen = recipe()
    centre = [FitDraws.centre(fit) for fit in (cut_fit(chosen, kappa=0.75), friction_fit())]
    model = central_model(*centre)
    found = {}
    for number_format in ("float32", "int16"):
        compiled = compile_model(model, chosen, tolerance=1e-2, number_format=number_format)
        found[number_format] = cost_and_error(
            model, chosen, compiled, np.random.default_rng(2), repeats=3, count_instructions=False
        )
    plain, fixed = found["float32"], found["int16"]
    assert plain.cost.bytes == 12 * sum(plain.cost.knots.values())
    assert fixed.cost.bytes < plain.cost.bytes
    assert (plain.cost.ram_bytes, fixed.cost.ram_bytes) == (0, 12 * sum(fixed.cost.knots.values()))
    for one in found.values():
        assert one.grid.average_Nm < one.grid.worst_Nm < 5e-3 * one.scene_torque_Nm
        assert one.random.worst_Nm < 5e-3 * one.scene_torque_Nm
        assert one.cost.stroke_ns.low <= one.cost.stroke_ns.median <= one.cost.stroke_ns.high
        assert (one.cost.instructions, one.cost.not_counted) == (None, "not asked for")


@pytest.mark.slow
@pytest.mark.skipif(
    bool(missing_tools("host") or missing_tools("cortex-m4f")), reason="no compilers or qemu here"
)
def test_double_costs_more_and_is_no_closer_than_its_tables() -> None:
    chosen = recipe()
    centre = [FitDraws.centre(fit) for fit in (cut_fit(chosen), friction_fit())]
    model = central_model(*centre)
    found = {
        one: cost_and_error(
            model,
            chosen,
            compile_model(model, chosen, tolerance=1e-2, number_format=one),
            np.random.default_rng(2),
            repeats=2,
        )
        for one in ("float32", "float64")
    }
    single, double = found["float32"], found["float64"]
    assert double.cost.bytes == 2 * single.cost.bytes
    assert double.cost.instructions.stroke > 5 * single.cost.instructions.stroke
    assert double.grid.worst_Nm == pytest.approx(single.grid.worst_Nm, rel=0.05)
