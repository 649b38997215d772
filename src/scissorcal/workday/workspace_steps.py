"""The steps of a workspace as functions: what the commands do, by the same code."""

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, cast

from scissorcal.errors import check_known

if TYPE_CHECKING:
    from scissorcal.aliases import Progress
    from scissorcal.device.session import Operator
    from scissorcal.package import ModelPackage
    from scissorcal.workday import (
        Built,
        Captured,
        FitOutcome,
        Reported,
        VerifyOutcome,
        Workspace,
    )

FITS = ("camera", "blade", "plate", "friction", "friction-advance", "cut")
LAWS = ("friction", "friction-advance", "cut")


class WorkspaceSteps:
    """What is done in a workspace; results lie in its files, as those of the commands do.

    One writer at a time: InputError where another process is at work in the workspace. Interrupted
    captures are recovered by the commands alone.
    """

    root: Path

    @property
    def _workspace(self) -> "Workspace":
        """This object, as the type that it is part of."""
        return cast("Workspace", self)

    @property
    def fits(self) -> "FitsOfWorkspace":
        """The fits that are there and current, by name: ``workspace.fits["friction"]``."""
        return FitsOfWorkspace(self._workspace)

    def package(self) -> "ModelPackage":
        """Open the workspace's package; MissingError, with what to do first, without one."""
        from scissorcal.package import open_package
        from scissorcal.workday import built_package

        return open_package(built_package(self._workspace, "open"))

    def capture(
        self,
        kind: Literal["friction", "friction-advance", "cut"],
        *,
        device: str = "sim",
        seed: int = 0,
        baud: int | None = None,
        operator: "Operator | None" = None,
        **options: Any,
    ) -> "Captured":
        """Record from a rig, as 'scissorcal capture' does; gives its ``path`` and ``report``.

        ``device`` is a port, or "sim" for the virtual rig, whose noise has the ``seed``.
        ``options`` are those of `CaptureOptions`: ``hand``, ``designed``, ``until_tolerance``, ...
        A real rig needs an ``operator`` who confirms that the blades are clear: without one
        InputError is raised before anything moves. Raises UnknownNameError for another kind or
        option, DeviceError where the rig fails.
        """
        from scissorcal.workday import CaptureOptions, RigOptions, capture_into

        check_known("kind of capture", kind, LAWS)
        for name in options:
            check_known("option of a capture", name, CaptureOptions.__dataclass_fields__)
        rig, chosen = RigOptions(device, seed, baud), CaptureOptions(**options)
        return capture_into(self._workspace, kind, rig, chosen, operator)

    def fit(
        self,
        *what: str,
        effort: Literal["draft", "standard", "thorough"] | None = None,
        seed: int = 0,
        force: bool = False,
        progress: "Progress | None" = None,
    ) -> "tuple[FitOutcome, ...]":
        """Run the fits named ``what``, or all that the scene requires, as 'scissorcal fit' does.

        A fit of which nothing changed is read back unless ``force``; each outcome has ``result``,
        ``verdicts`` and ``cached``. ``effort`` is the recipe's where not given. There is no
        limit of time. Raises UnknownNameError for names, MissingError where nothing was captured.

        >>> from pathlib import Path
        >>> from scissorcal.workday import create_workspace
        >>> create_workspace(Path("day"), "paper-80gsm").fit("fricton")
        Traceback (most recent call last):
        scissorcal.errors.UnknownNameError: "fricton" is no fit. Did you mean "friction"? There \
are: camera, blade, plate, friction, friction-advance, cut.
        """
        from scissorcal.calibration import check_effort
        from scissorcal.workday import FitOptions, fit_workspace, writing

        for name in what:
            check_known("fit", name, FITS)
        if effort is not None:
            check_effort(effort)
        options = FitOptions(effort=effort, force=force, seed=seed)
        with writing(self._workspace, "Workspace.fit"):
            return fit_workspace(self._workspace, what, options, progress=progress)

    def verify(
        self,
        *what: Literal["friction", "friction-advance", "cut"],
        fits: int = 100,
        seed: int = 0,
        workers: int | None = None,
        progress: "Progress | None" = None,
    ) -> "tuple[VerifyOutcome, ...]":
        """Check whether the fits' intervals hold, as 'scissorcal verify' does.

        ``fits`` to simulated data are made for each of ``what`` (all that are current where none is
        named), in ``workers`` processes, so that a script needs the usual guard on ``__main__``.
        Raises UnknownNameError for a name, MissingError where there is no current fit.
        """
        from scissorcal.workday import Processes, VerifySettings, verify_workspace, writing

        for name in what:
            check_known("fit that is verified", name, LAWS)
        settings, processes = VerifySettings(fits=fits, seed=seed), Processes(workers)
        with writing(self._workspace, "Workspace.verify"):
            return verify_workspace(self._workspace, what, settings, processes, progress)

    def report(self, *, anew: bool = False) -> "Reported":
        """Write report/report.html and its JSON twin, as 'scissorcal report' does.

        A signed report that is current is left as it is, unless ``anew``. Raises MissingError where
        there is no fit, or one is stale.
        """
        from scissorcal.workday import Engine, write_workspace_report, writing

        with writing(self._workspace, "Workspace.report"):
            return write_workspace_report(Engine.of(self._workspace), anew=anew)

    def build_package(
        self, *, seed: int = 0, force: bool = False, allow_failed: bool = False
    ) -> "Built":
        """Compile the fits into package/<recipe>.zip, as 'scissorcal package build' does.

        Raises VerdictError where a fit failed, unless ``allow_failed``, MissingError where one is
        missing or stale.
        """
        from scissorcal.workday import Engine, build_workspace_package, writing

        with writing(self._workspace, "Workspace.build_package"):
            return build_workspace_package(
                Engine.of(self._workspace), seed=seed, force=force, allow_failed=allow_failed
            )


class FitsOfWorkspace(Mapping[str, Any]):
    """The current fits of a workspace by name; each is read when it is asked for.

    A name that no fit has is an UnknownNameError (a KeyError); a fit that is missing or stale is
    not among them, and asking for it is a MissingError with the command that makes it.
    """

    def __init__(self, workspace: "Workspace") -> None:
        self._workspace = workspace

    def __getitem__(self, name: str) -> Any:
        from scissorcal.workday import Engine, load_result

        check_known("fit", name, FITS)
        return load_result(Engine.of(self._workspace), name)

    def __contains__(self, name: object) -> bool:
        return any(name == present for present in self)

    def __iter__(self) -> Iterator[str]:
        from scissorcal.workday import Engine, available

        return iter(available(Engine.of(self._workspace)))

    def __len__(self) -> int:
        return sum(1 for _ in self)

    def __repr__(self) -> str:
        return f"<fits of {self._workspace.root}: {', '.join(self) or 'none'}>"
