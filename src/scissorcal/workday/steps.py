"""The steps of the day: one row each, in the order in which they are done.

A row says what the scene needs the step for, what it builds on, which settings of the recipe
matter, the version of its algorithm, where its result lies and how it is read and run. Everything
else - identity, state, cache, history, plan - is the engine's (`workday.engine`).
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

from scissorcal.recipe.requirements import Requirement, Requirements
from scissorcal.recipe.schema import Recipe
from scissorcal.workday import facts
from scissorcal.workday.workspace import Workspace

Kind = Literal["recordings", "photographs", "fit", "verify", "report", "sign", "package", "render"]
Read = Callable[[Path], dict[str, Any]]
Why = Callable[[Requirements], str]

EFFORTS = ("draft", "standard", "thorough")

BY_EFFORT = frozenset({"finite", "optimum", "k-hat", "start", "bounds"})
"""Failed checks that a longer search may clear; all others ask for other data."""


@dataclass(frozen=True)
class Step:
    """One step of the day.

    ``why`` gives what the scene needs the step for, empty where it needs none. ``inputs`` names
    steps: a step is stale while one of them is missing or stale; one that ends in "?" counts where
    it has a result and is not waited for. ``settings`` are the parts of the recipe that the result
    depends on; ``version`` is raised whenever the same inputs would give another result.
    ``by_effort`` says that the result depends on the effort. ``file`` is where the result lies,
    ``read`` gives its facts, ``holds`` names the type in it ("module:type"), ``run`` the function
    that fits ("module:function"). ``verified_by`` names the step that checks it. ``optional``
    steps are never what comes next.
    Steps ``on_request`` may be done where the scene does not need them, and are then shown.
    ``photographs`` are the folders that a capture of photographs fills, the first one required;
    with ``newest_only`` earlier folders do not count.
    """

    name: str
    kind: Kind
    command: str
    why: Why
    inputs: tuple[str, ...] = ()
    settings: Callable[[Recipe], object] = lambda recipe: None
    version: int = 1
    by_effort: bool = False
    file: Callable[[Workspace, Recipe], Path] | None = None
    read: Read | None = None
    holds: str = ""
    run: str = ""
    verified_by: str = ""
    optional: bool = False
    on_request: bool = False
    photographs: tuple[str, ...] = ()
    newest_only: bool = False

    @property
    def what(self) -> str:
        """The subject: "friction" of "fit friction"."""
        return self.name.split()[-1]


def steps_of(kind: Kind) -> tuple[Step, ...]:
    """The rows of one kind, in order."""
    return tuple(step for step in STEPS if step.kind == kind)


def _of(rows: Callable[[Requirements], tuple[Requirement, ...]], name: str) -> Why:
    return lambda needs: next((item.why for item in rows(needs) if item.name == name), "")


def _capture(name: str) -> Why:
    return _of(lambda needs: needs.captures, name)


def _photograph(name: str) -> Why:
    return _of(lambda needs: needs.geometry, name)


def _fit(name: str) -> Why:
    return _of(lambda needs: needs.fits, name)


def _geometry(name: str) -> Why:
    return _of(lambda needs: needs.geometry, name)


def _in_fits(name: str) -> Callable[[Workspace, Recipe], Path]:
    return lambda workspace, recipe: workspace.root / "fits" / name


def _friction_settings(recipe: Recipe) -> object:
    settings = recipe.fit.friction.model_dump(mode="json")
    return {**settings, "tolerance_percent": recipe.scene.tolerance_percent}


def _friction_advance_settings(recipe: Recipe) -> object:
    priors = recipe.fit.friction.priors.linear.model_dump(mode="json")
    settings = recipe.fit.friction_advance.model_dump(mode="json")
    return [settings, priors, recipe.scene.tolerance_percent]


def _camera_settings(recipe: Recipe) -> object:
    return recipe.fit.camera.model_dump(mode="json")


def _blade_settings(recipe: Recipe) -> object:
    scene = [recipe.scene.opening_deg, recipe.scene.contact_mm, recipe.rig.moving]
    return [*scene, recipe.fit.blade.model_dump(mode="json")]


def _plate_settings(recipe: Recipe) -> object:
    fit = recipe.fit.plate.model_dump(mode="json")
    # the target is printed flat and at rest: surface, touch and tracking do not enter its fit
    others = {"surface", "touch", "tracking", "cut_line_mm", "layers"}
    plate = recipe.plate.model_dump(mode="json", exclude=others)
    return [plate, recipe.rig.moving, fit]


def _cut_settings(recipe: Recipe) -> object:
    scene = {"cut", "closure", "opening_deg", "opening_rate_rad_per_s", "contact_mm"}
    return recipe.model_dump(
        mode="json",
        include={
            "rig": {"joint", "moving", "handle_radius_mm", "edge", "opening_zero_sd_deg"},
            "material": {"thickness_mm", "thickness_sd_mm"},
            "scene": scene | {"tolerance_percent", "render_friction"},
            "fit": {"cut", "friction"},
        },
    )


def _whole(recipe: Recipe) -> object:
    found = recipe.model_dump(mode="json")
    if not recipe.plate.layers:  # results of recipes without a drawn plate are what they were
        for key in ("cut_line_mm", "layers"):
            del found["plate"][key]
    return found


def _verification(what: str, words: str = "", *, on_request: bool = False) -> Step:
    return Step(
        f"verify {what}",
        "verify",
        f"scissorcal verify {words or what}",
        lambda needs: _fit(what)(needs) and "whether the intervals hold",
        inputs=(f"fit {what}",),
        file=_in_fits(f"{what}.verify.json"),
        read=facts.verification,
        holds="scissorcal.calibration.verify.result:VerifyResult",
        optional=True,
        on_request=on_request,
    )


STEPS: tuple[Step, ...] = (
    Step(
        "capture friction",
        "recordings",
        "scissorcal capture friction --device PORT",
        _capture("friction"),
    ),
    Step(
        "capture friction-advance",
        "recordings",
        "scissorcal capture friction --axis advance --device PORT",
        _capture("friction-advance"),
        on_request=True,
    ),
    Step("capture cut", "recordings", "scissorcal capture cut --device PORT", _capture("cut")),
    Step(
        "capture camera",
        "photographs",
        "scissorcal capture camera --image board-*.jpg",
        _photograph("camera"),
        photographs=("camera",),
    ),
    Step(
        "capture blade",
        "photographs",
        "scissorcal capture blade --image blade-*.jpg",
        _photograph("blade"),
        photographs=("blade",),
    ),
    Step(
        "capture plate",
        "photographs",
        "scissorcal capture plate --image plate-*.jpg",
        _photograph("plate"),
        photographs=("plate", "rig"),
        newest_only=True,
    ),
    Step(
        "fit camera",
        "fit",
        "scissorcal fit camera",
        _geometry("camera"),
        inputs=("capture camera",),
        settings=_camera_settings,
        version=4,
        file=_in_fits("camera.nc"),
        read=facts.fit,
        holds="scissorcal.calibration.camera.result:CameraFit",
        run="scissorcal.workday.runs.camera:fit",
    ),
    Step(
        "fit blade",
        "fit",
        "scissorcal fit blade",
        _geometry("blade"),
        inputs=("capture blade", "fit camera?"),
        settings=_blade_settings,
        version=5,
        by_effort=True,
        file=_in_fits("blade.nc"),
        read=facts.fit,
        holds="scissorcal.calibration.edge.result:BladeResult",
        run="scissorcal.workday.runs.blade:fit",
    ),
    Step(
        "fit plate",
        "fit",
        "scissorcal fit plate",
        _geometry("plate"),
        inputs=("capture plate", "fit camera"),
        settings=_plate_settings,
        version=4,
        file=_in_fits("plate.nc"),
        read=facts.fit,
        holds="scissorcal.calibration.plate.result:PlateFit",
        run="scissorcal.workday.runs.plate:fit",
    ),
    Step(
        "fit friction",
        "fit",
        "scissorcal fit friction",
        _fit("friction"),
        inputs=("capture friction",),
        settings=_friction_settings,
        version=19,
        by_effort=True,
        file=_in_fits("friction.nc"),
        read=facts.fit,
        holds="scissorcal.calibration.result:FitResult",
        run="scissorcal.workday.runs.friction:fit",
        verified_by="verify friction",
    ),
    Step(
        "fit friction-advance",
        "fit",
        "scissorcal fit friction --axis advance",
        _fit("friction-advance"),
        inputs=("capture friction-advance",),
        settings=_friction_advance_settings,
        version=6,
        by_effort=True,
        file=_in_fits("friction-advance.nc"),
        read=facts.fit,
        holds="scissorcal.calibration.result:FitResult",
        run="scissorcal.workday.runs.friction:fit_advance",
        verified_by="verify friction-advance",
        on_request=True,
    ),
    Step(
        "fit cut",
        "fit",
        "scissorcal fit cut",
        _fit("cut"),
        inputs=("capture cut", "fit friction", "fit blade"),
        settings=_cut_settings,
        version=20,
        by_effort=True,
        file=_in_fits("cut.nc"),
        read=facts.fit,
        holds="scissorcal.calibration.result:FitResult",
        run="scissorcal.workday.runs.cut:fit",
        verified_by="verify cut",
    ),
    _verification("friction"),
    _verification("friction-advance", "friction --axis advance", on_request=True),
    _verification("cut"),
    Step(
        "report",
        "report",
        "scissorcal report",
        lambda needs: "what a person reviews before use",
        inputs=(
            "fit camera?",
            "fit blade?",
            "fit plate?",
            "fit friction?",
            "fit friction-advance?",
            "fit cut?",
            "verify friction?",
            "verify friction-advance?",
            "verify cut?",
        ),
        settings=_whole,
        version=4,
        file=lambda workspace, recipe: workspace.report_json,
        read=facts.report,
    ),
    Step(
        "report sign",
        "sign",
        "scissorcal report sign --name NAME --decision accept",
        lambda needs: "who reviewed the report, and the decision",
        inputs=("report",),
        file=lambda workspace, recipe: workspace.signature_path,
        read=facts.signature,
    ),
    Step(
        "package build",
        "package",
        "scissorcal package build",
        lambda needs: "what the loop renders" if needs.tables else "",
        inputs=("fit friction", "fit cut", "fit plate"),
        settings=_whole,
        version=5,
        file=lambda workspace, recipe: workspace.package_path(recipe),
        read=facts.package,
    ),
    Step(
        "render",
        "render",
        "scissorcal render --device PORT",
        lambda needs: "a rendering on the rig" if needs.tables else "",
        inputs=("package build",),
        optional=True,
    ),
)
"""Every step of the day. A new step is one row here and, where it computes, one module in runs/."""

BY_NAME: Mapping[str, Step] = {step.name: step for step in STEPS}
