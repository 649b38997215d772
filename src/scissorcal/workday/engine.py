"""What state each step of the day is in, and the identity of what it is made from.

The identity of a step is a digest over its settings, its version and the content of its inputs,
recursively. A result carries the identity it was made from: where that differs from the one its
inputs have now, it is stale.
"""

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

from scissorcal.errors import InputError, OtherKindError
from scissorcal.foreign.kinds import fit_name
from scissorcal.identity import digest
from scissorcal.recipe.friction import as_first_named
from scissorcal.recipe.requirements import CaptureKind, Requirements, requirements
from scissorcal.recipe.schema import Recipe
from scissorcal.workday.facts import UNFINISHED, rendering
from scissorcal.workday.index import FileIndex
from scissorcal.workday.recordings import (
    RecordingRow,
    counts_of,
    counts_used,
    list_recordings,
    notes_of,
    refuse_mixed_joints,
    why_unused,
)
from scissorcal.workday.states import (
    CHANGED,
    WAITING,
    State,
    StepState,
    counted,
    photograph_indexes,
    photographs_state,
    remedy,
)
from scissorcal.workday.steps import BY_NAME, EFFORTS, STEPS, Step
from scissorcal.workday.workspace import Workspace

if TYPE_CHECKING:
    from scissorcal.device.completeness import Completeness


@dataclass
class Engine:
    """The states of a workspace's steps; each is worked out once for the life of the object."""

    workspace: Workspace
    recipe: Recipe
    index: FileIndex
    _states: dict[str, StepState] = field(default_factory=dict)

    @cached_property
    def _needs(self) -> Requirements:
        return requirements(self.recipe)

    @classmethod
    def of(cls, workspace: Workspace) -> "Engine":
        """The engine of a workspace as its files are now. InputError where its recipe is wrong."""
        return cls(workspace, workspace.recipe(), FileIndex(workspace.root))

    def state(self, name: str) -> StepState:
        """The state of the step of this name."""
        if name not in self._states:
            self._states[name] = self._find(BY_NAME[name])
        return self._states[name]

    def states(self) -> tuple[StepState, ...]:
        """The states of all steps that are shown, in the order of the day."""
        found = tuple(self.state(step.name) for step in STEPS if self.shown(step.name))
        self.index.save()
        return found

    def needed(self, name: str) -> bool:
        """Whether the scene needs the step. Photographs may be fitted where it does not."""
        return bool(BY_NAME[name].why(self._needs))

    def shown(self, name: str) -> bool:
        """Whether the scene needs the step, or it was done on request."""
        step = BY_NAME[name]
        return self.needed(name) or (step.on_request and self._is_there(step))

    def leads_to(self, name: str) -> str:
        """The command with which to begin, so that the step of this name becomes current."""
        step = BY_NAME[name]
        for item in step.inputs:
            state = self.state(_plain(item))
            waits = state.state in WAITING or (state.state == "failed" and not state.content)
            if waits and not item.endswith("?") and self._counts(step, item):
                return self.leads_to(_plain(item))
        return self.state(name).command or step.command  # a step that no scene requires

    def refresh(self) -> None:
        """Forget what was worked out, after a result was written."""
        self._states.clear()
        self.index.save()

    def file(self, name: str) -> Path:
        """Where the result of a step lies."""
        step = BY_NAME[name]
        assert step.file is not None, name
        return step.file(self.workspace, self.recipe)

    def facts(self, name: str) -> dict[str, Any]:
        """What the result of a step says of itself. InputError where it cannot be read."""
        step = BY_NAME[name]
        assert step.read is not None, name
        return self.index.facts(self.file(name), f"{name} {step.version}", step.read)

    def identity(self, name: str, effort: str = "") -> str:
        """Identity of what a result of this step would be made from now.

        ``effort`` counts where the step depends on it.
        """
        step = BY_NAME[name]
        if step.kind == "verify":
            return self.index.digest(self.file(step.inputs[0]))
        if step.kind == "sign":
            from scissorcal.workday.reviewed import reviewed_content

            return digest(reviewed_content(self))
        made_from = {
            "step": name,
            "version": step.version,
            "settings": as_first_named(step.settings(self.recipe)),
            "effort": effort if step.by_effort else "",
            "inputs": {_plain(item): self._content(step, item) for item in step.inputs},
        }
        if step.kind == "package":  # it says which checks its fits failed
            made_from["failed"] = {item: self.state(item).failed for item in step.inputs}
        if step.kind in ("package", "report") and (drawn := self._drawings()):
            made_from["drawings"] = drawn
        return digest(made_from)

    def _drawings(self) -> dict[str, str]:
        """Digests of the files in which the recipe's plate is drawn; "" of one that is missing."""
        paths = {name: self.workspace.root / name for name in self.recipe.plate.drawings}
        return {
            name: self.index.digest(path) if path.is_file() else "" for name, path in paths.items()
        }

    def review(self) -> dict[str, Any] | None:
        """The signature that stands under the report, as stored; None where there is none."""
        if self.state("report sign").state not in ("done", "failed"):
            return None
        found: dict[str, Any] = self.facts("report sign")["review"]
        return found

    def recordings(self, kind: CaptureKind) -> tuple[RecordingRow, ...]:
        """The recordings of one kind, with the use that fits make of them."""
        return list_recordings(self.workspace, self.recipe, kind, self.index)

    def _counts(self, step: Step, item: str) -> bool:
        """Whether an input counts: it is shown, or the scene does not need the step either."""
        return self.shown(_plain(item)) or not self.needed(step.name)

    def _content(self, step: Step, item: str) -> str:
        """Content of an input; nothing where it does not count, or is optional and missing."""
        state = self.state(_plain(item))
        if not self._counts(step, item) or (item.endswith("?") and state.state in WAITING):
            return ""
        return state.content

    def _find(self, step: Step) -> StepState:
        why = step.why(self._needs)
        if not why and not self._is_there(step):
            return StepState(step.name, "excluded", "the scene does not need it")
        find: Callable[[Step, str], StepState] = {
            "recordings": self._of_recordings,
            "photographs": lambda step, why: photographs_state(self, step, why),
            "render": self._of_render,
        }.get(step.kind, self._of_result)
        unasked = (
            "on request: the scene does not need it"
            if step.on_request
            else "not needed by this scene"
        )
        return find(step, why or unasked)

    def _is_there(self, step: Step) -> bool:
        """Whether there are captures for a step that the scene may not need, or a fit to them."""
        if step.kind == "recordings":
            return step.on_request and bool(self.workspace.recordings(_captured(step)))
        if step.on_request:
            return self.file(step.name).is_file() or self._is_there(BY_NAME[step.inputs[0]])
        if step.kind == "photographs":
            return bool(photograph_indexes(self.workspace, step))
        if step.kind != "fit" or BY_NAME[step.inputs[0]].kind != "photographs":
            return False
        return self.file(step.name).is_file() or bool(
            photograph_indexes(self.workspace, BY_NAME[step.inputs[0]])
        )

    def _of_recordings(self, step: Step, why: str) -> StepState:
        kind = _captured(step)
        rows = self.recordings(kind)
        notes = tuple(why_unused(self.workspace, row) for row in rows if row.use != "used")
        broken = [row for row in rows if row.use == "unreadable"]
        used = [row for row in rows if row.use == "used"]

        def made(state: State, found: str, command: str = step.command, **more: Any) -> StepState:
            return StepState(step.name, state, found, why, command, **{"notes": notes, **more})

        if broken:
            name = broken[0].path.name
            command = f"scissorcal recording exclude {name} --why 'cannot be read'"
            return made("failed", f"{name} cannot be read", command)
        if not used:
            if not rows:
                return made("missing", "nothing recorded yet")
            if all(row.use == "excluded" for row in rows):
                return made("missing", "every recording is excluded")
            return made("stale", "recorded with another rig, material or scene")
        try:
            refuse_mixed_joints(rows)
        except InputError as error:
            mixed = (*notes, str(error))
            return made("failed", "rotary and linear joints are mixed", notes=mixed)
        notes = (*notes, *notes_of(self.workspace, self.recipe, used))
        content = digest(sorted(str(row.facts["content"]) for row in used))
        files = tuple(self.workspace.relative(row.path) for row in used)
        found = f"{counted(len(used), 'recording')}, {sum(row.seconds for row in used):.0f} s"
        missing = self._completeness(kind, None).missing
        if missing:
            sentence = "; ".join(missing)
            notes = (*notes, f"{step.name} lacks: {sentence}.")
            found = f"{found}; lacks {missing[0]}" + (" ..." if len(missing) > 1 else "")
            return made("incomplete", found, content=content, files=files, notes=notes)
        return made("done", found, "", content=content, files=files, notes=notes)

    def completeness(self, kind: CaptureKind) -> "Completeness":
        """Planned, recorded, and used by the fit where there is a current one."""
        fit = f"fit {kind}"
        current = self.state(fit).state in ("done", "unverified", "failed", "incomplete")
        there = current and bool(self.state(fit).content)
        return self._completeness(kind, self.file(fit) if there else None)

    def _completeness(self, kind: CaptureKind, fit: Path | None) -> "Completeness":
        from scissorcal.device.completeness import Completeness, completeness

        used = None
        rows = [row for row in self.recordings(kind) if row.use == "used"]
        counts = [counts_of(row, self.recipe, kind, self.index) for row in rows]
        unplanned = next((str(count["unplanned"]) for count in counts if "unplanned" in count), "")
        if unplanned:
            return Completeness(missing=(f"a plan that this rig can follow: {unplanned}",))
        if fit is not None:
            used = [
                counts_used(row, self.recipe, kind, fit, self.index) if count else {}
                for row, count in zip(rows, counts, strict=True)
            ]
        return completeness(counts, self.recipe, kind, used)

    def _of_result(self, step: Step, why: str) -> StepState:
        """The state of a step that has one file as its result."""
        path = self.file(step.name)
        name = self.workspace.relative(path)

        def made(state: State, found: str, command: str = step.command, **more: Any) -> StepState:
            return StepState(step.name, state, found, why, command, optional=step.optional, **more)

        if not path.is_file():
            return made("missing", "not there yet")
        if step.kind == "report" and not self.workspace.report_html.is_file():
            return made("missing", "its page is not there")
        content = self.index.digest(path)
        try:
            facts = self.facts(step.name)
            refuse_other_fit(step, path, facts.get("what", step.what))
        except OtherKindError as error:  # what is there is nobody's damage: the result is missing
            found = f"{name} is {error.found}: move it away before '{step.command}'"
            return made("missing", found, notes=(str(error),))
        except InputError as error:
            why_not, again = (str(error),), step.command
            found = f"damaged: {_AGAIN.get(step.kind, 'make it again')} with '{again}'"
            return made("damaged", f"{name} is {found}", again, notes=why_not)
        failed = tuple(facts["failed"])
        kept: dict[str, Any] = {"content": content, "files": (name,), "failed": failed}
        imported = facts.get("imported") and not self.state(step.inputs[0]).content
        behind = "" if imported else self._behind(step, facts)
        if behind:
            return made("stale", behind, **kept)
        if str(facts["inputs"]).startswith(UNFINISHED):
            longer = f"{step.command} --max-minutes 60"
            return made("incomplete", f"{facts['label']}; ran out of time", longer, **kept)
        notes = self._little_used(step)
        if failed:
            command = remedy(step, failed, facts.get("effort", ""), self.state)
            found = f"{facts['label']}; failed: {', '.join(failed)}"
            return made("failed", found, command, notes=notes, **kept)
        if facts.get("lacks"):
            return made("incomplete", f"{facts['label']}; {facts['lacks']}", **kept)
        below = self._failed_below(step)
        if below:
            found = f"{facts['label']}; {below.name} failed: {', '.join(below.failed)}"
            kept["failed"] = (f"{below.name} failed",)
            return made("failed", found, below.command, notes=notes, **kept)
        check = self.state(step.verified_by) if step.verified_by else None
        if check and check.state == "failed":
            found = f"{facts['label']}; its verification failed: {', '.join(check.failed)}"
            kept["failed"] = tuple(f"{check.name} {one}" for one in check.failed)
            return made("failed", found, remedy(step, kept["failed"], "", self.state), **kept)
        if check and check.state != "done":
            return made("unverified", facts["label"], check.command, notes=notes, **kept)
        return made("done", facts["label"], "", notes=notes, **kept)

    def _failed_below(self, step: Step) -> StepState | None:
        """A fit that this fit builds on and that failed, if only by its verification."""
        if step.kind != "fit":
            return None
        fits = (self.state(_plain(item)) for item in step.inputs if self._counts(step, item))
        return next((state for state in fits if state.state == "failed" and state.failed), None)

    def _little_used(self, step: Step) -> tuple[str, ...]:
        """Which planned motion a fit hardly uses, as sentences."""
        if step.kind != "fit" or BY_NAME[step.inputs[0]].kind != "recordings":
            return ()
        found = self._completeness(_captured(step), self.file(step.name))
        keys = f"capture.{step.what}.speeds_rad_per_s"
        if step.what == "friction-advance":
            keys = "capture.friction_advance.speeds_mm_per_s"
        return tuple(
            f"{step.name}, {sentence}. The fit's notes say why; leave speeds that it cannot use "
            f"out of {keys}."
            for sentence in found.little_used
        )

    def _behind(self, step: Step, facts: dict[str, Any]) -> str:
        """Say why a result is stale; empty where it is current."""
        waiting = [item for item in step.inputs if not item.endswith("?") and step.kind != "verify"]
        for item in waiting:
            state = self.state(item)
            if state.state in WAITING and self._counts(step, item):
                return f"{item} is {state.state}"
        if step.kind == "sign":
            from scissorcal.workday.reviewed import unlike_signed

            return unlike_signed(self, facts["review"])
        if step.kind == "verify" and not self.file(step.inputs[0]).is_file():
            return f"{step.inputs[0]} is missing"
        efforts = EFFORTS if step.by_effort else ("",)
        inputs = str(facts["inputs"]).removeprefix(UNFINISHED)
        if inputs not in {self.identity(step.name, effort) for effort in efforts}:
            return CHANGED.get(step.kind, "its inputs or settings changed since")
        if step.kind == "package" and facts["review"] != self.review():
            return "it carries another review than there is now"
        return ""

    def _of_render(self, step: Step, why: str) -> StepState:
        """A rendering is done where the newest one is of the package that is there."""
        recordings = self.workspace.recordings("render")

        def made(state: State, found: str, command: str = step.command) -> StepState:
            files = tuple(self.workspace.relative(path) for path in recordings)
            return StepState(step.name, state, found, why, command, files, optional=True)

        if not recordings:
            return made("missing", "not rendered yet")
        path = self.file("package build")
        try:
            facts = self.index.facts(recordings[-1], "rendering", rendering)
            package = self.facts("package build")["content"] if path.is_file() else ""
        except InputError as error:
            return made("failed", str(error))
        if facts["package"] != package:
            return made("stale", "of another package")
        if self.state("package build").state in WAITING:
            return made("stale", f"package build is {self.state('package build').state}")
        return made("done", counted(len(recordings), "recording"), "")


def refuse_other_fit(step: Step, path: Path, what: str) -> None:
    """Raise OtherKindError where a step's file holds a fit of another quantity."""
    if step.kind == "fit" and what != step.what:
        raise OtherKindError(path, fit_name(what), fit_name(step.what))


_AGAIN = {"fit": "fit again", "verify": "check again", "package": "build again"}
"""How a damaged result of a kind comes back, in two words."""


def _captured(step: Step) -> CaptureKind:
    kinds: tuple[CaptureKind, ...] = ("friction", "friction-advance", "cut")
    return next(kind for kind in kinds if kind == step.what)


def _plain(item: str) -> str:
    return item.rstrip("?")
