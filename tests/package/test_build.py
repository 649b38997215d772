"""What is built from which fits, and what is refused."""

import json
import zipfile
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from scissorcal.calibration import FitResult
from scissorcal.errors import InputError, MissingError, VerdictError
from scissorcal.package import (
    FailedFitsWarning,
    PackageOptions,
    PackageSummary,
    Review,
    build_package,
    check_package,
    open_package,
    put_review,
    read_manifest,
)
from scissorcal.package.manifest import PoseRecord
from scissorcal.recipe import Recipe
from scissorcal.verdicts import Verdict
from tests.package.fits import cut_fit, friction_fit, recipe
from tests.report.geometry_fits import plate_fit


def rng() -> np.random.Generator:
    return np.random.default_rng(1)


def manifest_text(path: Path) -> str:
    with zipfile.ZipFile(path) as archive:
        return archive.read("manifest.json").decode()


def test_a_press_only_package_has_neither_toughness_nor_fracture(pad: PackageSummary) -> None:
    package = open_package(pad.path)
    assert package.manifest.mechanics.fracture is None
    assert set(package.arrays) == {"tables/edge.npy", "tables/response.npy", "draws/cut.npy"}
    facts = json.loads(manifest_text(pad.path))
    facts["provenance"].pop("recipe")
    for word in ("toughness", "energy", "kappa"):
        assert word not in json.dumps(facts)
    assert package.tables.fracture_energy == 0.0
    kernel = package.kernel()
    kernel.reset(0.0)
    for opening in np.radians(np.linspace(50, 12, 50)):
        kernel.step(opening, -0.1, -0.03)
    assert kernel.crack == 0.0


def test_a_package_without_friction_has_none(pad: PackageSummary, tmp_path: Path) -> None:
    assert "friction" not in json.dumps(
        {k: v for k, v in json.loads(manifest_text(pad.path)).items() if k == "units"}
    )
    chosen = recipe(render_friction=False)
    summary = build_package(chosen, friction_fit(), cut_fit(chosen), tmp_path / "p.zip", rng())
    assert summary.manifest.provenance.friction is None
    assert not any("friction" in file for file in open_package(summary.path).arrays)
    package = open_package(summary.path)
    opening = np.radians(49.0)
    assert package.torque(opening, 1.0, 0.06) == 0.0


def test_friction_is_rendered_against_the_motion(paper: PackageSummary) -> None:
    package = open_package(paper.path)
    opening, contact = np.radians(49.0), 0.06
    assert package.torque(opening, 0.5, contact) < 0 < package.torque(opening, -0.5, contact)


def test_provenance_names_recordings_fits_and_recipe(paper: PackageSummary) -> None:
    record = open_package(paper.path).manifest.provenance
    assert record.cut.sources == (f"cut.mcap sha256:{1:064x}",)
    assert record.friction is not None
    assert record.friction.inputs_hash == "friction-2"
    assert json.loads(record.recipe)["name"] == "paper-80gsm"
    values = {parameter.name: parameter.value for parameter in record.cut.parameters}
    assert values == {
        "response_force": 2.0,
        "response_exponent": 1.5,
        "fracture_energy": 0.5,
        "kappa": 0.75,
    }


def test_a_package_carries_the_identity_that_the_workspace_gives_it(tmp_path: Path) -> None:
    chosen, identity = recipe(), "5f" * 32
    fits = friction_fit(), cut_fit(chosen)
    given = build_package(
        chosen, *fits, tmp_path / "a.zip", rng(), options=PackageOptions(inputs_hash=identity)
    )
    assert given.manifest.provenance.inputs_hash == identity
    outside = build_package(chosen, *fits, tmp_path / "b.zip", rng())
    assert outside.manifest.provenance.inputs_hash == "0" * 64


def test_fits_that_are_missing_are_named(tmp_path: Path) -> None:
    chosen = recipe()
    with pytest.raises(MissingError, match="scissorcal fit cut"):
        build_package(chosen, friction_fit(), None, tmp_path / "p.zip", rng())
    with pytest.raises(MissingError, match="scissorcal fit friction"):
        build_package(chosen, None, cut_fit(chosen), tmp_path / "p.zip", rng())
    assert not list(tmp_path.iterdir())


def test_a_package_keeps_the_plates_covariance_and_failed_checks(tmp_path: Path) -> None:
    chosen = recipe()
    wrong = Verdict("fit.plate", "ambiguity", "fail", 3.0, 20.0, "Two poses.")
    plate = replace(plate_fit(), verdicts=(wrong,))
    path = tmp_path / "p.zip"
    fits = (chosen, friction_fit(), cut_fit(chosen))
    with pytest.raises(VerdictError, match="'scissorcal fit plate' again"):
        build_package(*fits, path, rng(), options=PackageOptions(plate=plate))
    build_package(*fits, path, rng(), options=PackageOptions(plate=plate, allow_failed=True))
    package = open_package(path, warn=False)
    record = package.manifest.plate
    assert record is not None
    assert plate.rig_plate is not None
    assert (record.frame, record.quaternion) == ("rig", plate.rig_plate.quaternion)
    assert record.euler_angles == plate.rig_plate.euler_angles
    assert "fit.plate, ambiguity: Two poses." in " ".join(package.warnings)
    for broken in ({"quaternion": (2.0, 0.0, 0.0, 0.0)}, {"covariance": ((0.0,),)}):
        with pytest.raises(ValueError, match="a plate's"):
            PoseRecord(**{**dict(record), **broken})
    unsure = replace(plate, rig_plate=replace(plate.rig_plate, covariance=None))
    with pytest.raises(InputError, match="no covariance of its pose"):
        build_package(
            chosen,
            friction_fit(),
            cut_fit(chosen),
            path,
            rng(),
            options=PackageOptions(plate=unsure, allow_failed=True),
        )


def test_a_manifests_pose_is_read_in_either_notation() -> None:
    written = {
        "frame": "rig", "translation_m": [0.0, 0.0, 0.1], "covariance": [[0.0] * 6] * 6,
        "target": "plate board", "inputs_hash": "",
    }  # fmt: skip
    turn = {"quaternion": [0.5**0.5, -(0.5**0.5), 0.0, 0.0]}
    angles = {"euler_angles": {"yaw_deg": 0.0, "pitch_deg": 0.0, "roll_deg": -90.0}}

    def read(*parts: dict[str, Any]) -> PoseRecord:
        facts = {name: value for part in (written, *parts) for name, value in part.items()}
        return PoseRecord.model_validate_json(json.dumps(facts))

    for given in ((turn,), (angles,), (turn, angles)):
        assert read(*given).quaternion == pytest.approx(turn["quaternion"])
    assert read(turn).euler_angles is None, "as in older packages"
    angles["euler_angles"]["yaw_deg"] = 2.5
    with pytest.raises(ValueError, match=r"a plate's pose differ by 2\.50 deg"):
        read(turn, angles)
    with pytest.raises(ValueError, match="A plate's pose has no rotation"):
        read()


def test_a_linear_joint_has_no_package(tmp_path: Path) -> None:
    chosen = recipe()
    linear = chosen.model_copy(update={"rig": chosen.rig.model_copy(update={"joint": "linear"})})
    with pytest.raises(InputError, match="linear joint carries no blades"):
        build_package(linear, friction_fit(), cut_fit(chosen), tmp_path / "p.zip", rng())


@pytest.mark.parametrize(
    ("part", "change", "key"),
    [
        ("scene", {"closure": "eq4"}, "scene.closure"),
        ("scene", {"cut": False}, "scene.cut"),
        ("rig", {"moving": "upper"}, "rig.moving"),
        ("material", {"thickness_mm": 0.2}, "material.thickness_mm"),
    ],
)
def test_a_fit_of_another_recipe_is_refused(
    part: str, change: dict[str, Any], key: str, tmp_path: Path
) -> None:
    chosen = recipe()
    other = chosen.model_copy(update={part: getattr(chosen, part).model_copy(update=change)})
    with pytest.raises(InputError, match=rf"another {key}.*scissorcal fit"):
        build_package(other, friction_fit(), cut_fit(chosen), tmp_path / "p.zip", rng())


def test_a_fit_of_another_edge_is_refused(tmp_path: Path) -> None:
    chosen = recipe()
    edge = chosen.rig.edge.model_copy(update={"offset_mm": -9.0})
    other = chosen.model_copy(update={"rig": chosen.rig.model_copy(update={"edge": edge})})
    with pytest.raises(InputError, match=r"rig\.edge\.offset_mm"):
        build_package(other, friction_fit(), cut_fit(chosen), tmp_path / "p.zip", rng())


def test_a_scene_that_never_touches_is_refused(tmp_path: Path) -> None:
    chosen = recipe("press-only", contact_mm=(55.0, 70.0), opening_deg=(45.0, 50.0))
    fit = cut_fit(chosen, energy=None)
    with pytest.raises(InputError, match="Nowhere in the scene"):
        build_package(chosen, friction_fit(), fit, tmp_path / "p.zip", rng())


def test_friction_that_would_drive_the_motion_is_refused(tmp_path: Path) -> None:
    chosen = recipe()
    friction = friction_fit(angle_slope=4.0, angle_curvature=0.0)
    with pytest.raises(InputError, match="friction drives the motion at 12 degrees"):
        build_package(chosen, friction, cut_fit(chosen), tmp_path / "p.zip", rng())


def test_tables_worse_than_the_scene_allows_are_refused(tmp_path: Path) -> None:
    chosen = recipe(tolerance_percent=0.01)
    with pytest.raises(VerdictError, match=r"was not written.*raise its tolerance"):
        build_package(
            chosen,
            friction_fit(),
            cut_fit(chosen),
            tmp_path / "p.zip",
            rng(),
            options=PackageOptions(tolerance=1e-2),
        )
    assert not list(tmp_path.iterdir())


def test_a_best_point_outside_its_posterior_is_refused(tmp_path: Path) -> None:
    chosen = recipe(render_friction=False)
    fit = cut_fit(chosen)
    with pytest.raises(VerdictError, match="not typical of its posterior"):
        build_package(
            chosen, None, replace(fit, map_point=fit.map_point * 1.5), tmp_path / "p.zip", rng()
        )


def test_a_scene_that_is_mostly_beyond_the_torque_limit_is_built(tmp_path: Path) -> None:
    chosen = recipe("press-only", opening_deg=(12.0, 25.0), contact_mm=(15.0, 60.0))
    fit = cut_fit(chosen, energy=None, force=500.0)
    summary = build_package(chosen, friction_fit(), fit, tmp_path / "p.zip", rng())
    assert summary.manifest.bound.scene_torque_Nm == chosen.limits.torque_Nm
    package = open_package(summary.path)
    assert np.mean(package.torque(np.radians(13.0), -0.2, np.linspace(0.015, 0.06)) == 1.0) > 0.5


def failed_cut(chosen: Recipe) -> FitResult:
    bad = Verdict("fit.cut", "k-hat", "fail", 1.2, 0.7, "Its intervals cannot be trusted.")
    return replace(cut_fit(chosen), verdicts=(bad,))


def test_a_failed_fit_is_refused_with_its_checks_and_commands(tmp_path: Path) -> None:
    chosen = recipe()
    worse = Verdict("fit.friction", "hold-out", "fail", 0.4, 0.2, "Hold-out error 40 %.")
    friction = replace(friction_fit(), verdicts=(worse,))
    with pytest.raises(VerdictError) as refusal:
        build_package(chosen, friction, failed_cut(chosen), tmp_path / "p.zip", rng())
    assert str(refusal.value) == (
        f"{tmp_path}/p.zip was not written: its fits failed 2 checks. fit.friction, hold-out: "
        "Hold-out error 40 %. fit.cut, k-hat: Its intervals cannot be trusted. Correct that and "
        "run 'scissorcal fit friction' and 'scissorcal fit cut' again, or build it all the same "
        "with 'scissorcal package build --allow-failed': the package then warns on every use."
    )
    assert not list(tmp_path.iterdir())


def test_friction_that_is_not_rendered_may_have_failed(tmp_path: Path) -> None:
    chosen = recipe(render_friction=False)
    worse = Verdict("fit.friction", "hold-out", "fail", 0.4, 0.2, "Hold-out error 40 %.")
    friction = replace(friction_fit(), verdicts=(worse,))
    summary = build_package(chosen, friction, cut_fit(chosen), tmp_path / "p.zip", rng())
    assert summary.manifest.failed_checks == ()


def test_a_package_from_a_failed_fit_says_so_on_every_use(tmp_path: Path) -> None:
    chosen = recipe()
    summary = build_package(
        chosen,
        friction_fit(),
        failed_cut(chosen),
        tmp_path / "p.zip",
        rng(),
        options=PackageOptions(allow_failed=True),
    )
    sentence = (
        "The package paper-80gsm was built from fits that failed 1 check, so its torque and its "
        "band may be wrong. fit.cut, k-hat: Its intervals cannot be trusted."
    )
    judged = {verdict.check: verdict for verdict in summary.verdicts}
    assert (judged["failed fits"].status, judged["failed fits"].why) == ("fail", sentence)
    assert sentence in summary.warnings
    assert check_package(summary.path)[:-1] == summary.verdicts, "all but the signature"
    with pytest.warns(FailedFitsWarning, match="failed 1 check") as caught:
        package = open_package(summary.path)
    assert caught[0].filename == __file__
    assert sentence in package.warnings
    assert read_manifest(summary.path).failed_checks == (
        "fit.cut, k-hat: Its intervals cannot be trusted.",
    )


def test_the_manifest_is_read_without_the_arrays(paper: PackageSummary, tmp_path: Path) -> None:
    assert read_manifest(paper.path) == open_package(paper.path).manifest
    with pytest.raises(MissingError, match="scissorcal package build"):
        read_manifest(tmp_path / "none.zip")


def test_an_unsigned_package_says_so(paper: PackageSummary) -> None:
    assert any("not signed" in sentence for sentence in paper.warnings)
    review = next(verdict for verdict in paper.verdicts if verdict.check == "review")
    assert review.status == "not_evaluated"


def test_a_package_carries_its_review_and_nothing_else_changes(
    paper: PackageSummary, tmp_path: Path
) -> None:
    plain = open_package(paper.path)
    hashes = plain.manifest.fit_hashes
    for decision, fits, status, words in (
        ("accept", hashes, "pass", "accepted by A. Reviewer on 2025-01-31: bends"),
        ("reject", hashes, "fail", "should not be rendered: its report was rejected"),
        ("accept", {"cut": "another"}, "fail", "has a review of other fits"),
    ):
        given = Review.of(
            name="A. Reviewer",
            decision=decision,
            note="bends",
            time_utc="2025-01-31T15:02:00Z",
            content={"report/report.json": "0" * 64},
            fit_hashes=fits,
        )
        path = tmp_path / f"{decision}-{len(fits)}.zip"
        put_review(plain, given, path)
        signed = open_package(path)
        assert signed.manifest.review == given
        assert signed.manifest.content_hash == plain.manifest.content_hash
        judged = {verdict.check: verdict for verdict in check_package(path)}
        assert judged["review"].status == status
        assert words in judged["review"].why
        assert any(words in sentence for sentence in signed.warnings) == (status == "fail")


def test_draws_are_thinned_to_what_the_band_needs(paper: PackageSummary, tmp_path: Path) -> None:
    assert open_package(paper.path).draws == 200
    chosen = recipe()
    few = cut_fit(chosen, draws=60)
    summary = build_package(chosen, friction_fit(), few, tmp_path / "p.zip", rng())
    assert open_package(summary.path).draws == 60


@pytest.mark.parametrize("law", ["coulomb", "coulomb+viscous", "stribeck", "stribeck+angle"])
@pytest.mark.parametrize("symmetric", [True, False])
def test_every_law_of_friction_compiles(law: str, symmetric: bool, tmp_path: Path) -> None:
    chosen = recipe(simplify=False)
    summary = build_package(
        chosen,
        friction_fit(law=law, symmetric=symmetric),
        cut_fit(chosen),
        tmp_path / "p.zip",
        rng(),
    )
    assert summary.manifest.bound.share < 1e-3
    package = open_package(summary.path)
    opening = np.radians(49.0)
    both = package.torque(opening, [-0.4, 0.4], 0.06)
    assert (both[0] == pytest.approx(-both[1], rel=1e-5)) == symmetric


def test_friction_drawn_with_the_cut_is_kept_with_it(tmp_path: Path) -> None:
    """Row by row the friction that the cut was drawn with; the inertia is friction's own."""
    chosen = recipe()
    cut, friction = cut_fit(chosen), friction_fit()
    names = [parameter.name for parameter in friction.parameters if parameter.name != "inertia"]
    columns = [[p.name for p in friction.parameters].index(name) for name in names]
    rng = np.random.default_rng(3)
    joint = friction.draws[rng.permutation(len(cut.draws))][:, columns] * (
        cut.draws[:, :1] / cut.draws[:, :1].mean()
    )
    together = replace(
        cut,
        nuisance=tuple(p for p in friction.parameters if p.name in names),
        nuisance_draws=joint,
    )
    built = build_package(chosen, friction, together, tmp_path / "a.zip", np.random.default_rng(0))
    arrays = open_package(built.path).arrays
    rows = [
        int(np.flatnonzero(cut.draws[:, 0] == value)[0]) for value in arrays["draws/cut.npy"][:, 0]
    ]
    assert np.array_equal(arrays["draws/friction.npy"][:, columns], joint[rows])
    assert open_package(built.path).draws == 200
