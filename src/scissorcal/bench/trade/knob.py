"""What a knob is, and the table of all knobs."""

from collections.abc import Mapping
from importlib import import_module
from typing import Protocol

from scissorcal.bench.trade.case import Case
from scissorcal.bench.trade.point import Error, Sample, Setting

KNOBS: Mapping[str, str] = {
    "effort": "scissorcal.bench.trade.knobs.effort:Effort",
    "window": "scissorcal.bench.trade.knobs.effort:Window",
    "capture": "scissorcal.bench.trade.knobs.capture:Capture",
    "tables": "scissorcal.bench.trade.knobs.tables:Tables",
    "rate": "scissorcal.bench.trade.knobs.rate:Rate",
    "friction": "scissorcal.bench.trade.knobs.candidates:Friction",
    "fracture": "scissorcal.bench.trade.knobs.candidates:Fracture",
    "response": "scissorcal.bench.trade.knobs.candidates:Response",
    "damping": "scissorcal.bench.trade.knobs.candidates:Damping",
    "closure": "scissorcal.bench.trade.knobs.candidates:Closure",
    "edge": "scissorcal.bench.trade.knobs.candidates:Edge",
    "photographs": "scissorcal.bench.trade.knobs.photographs:Photographs",
    "plate": "scissorcal.bench.trade.knobs.photographs:Plate",
}
"""Name of each knob, as ``--knob`` takes it, and its class; in the order of the page."""

PRESENT_ALIKE = ("effort", "window", "capture")
"""Knobs whose present settings are one and the same measurement, both fits as they are now: that
of the present settings in `Together`, which is made once."""

SAME_FITS = ("tables",)
"""Knobs whose settings change no fit: what they cost in error is alike on every capture."""


class Knob(Protocol):
    """One thing that a user may set, with what it costs and what error it leaves.

    ``title`` is its heading; ``cost`` and ``error`` name the main cost and main error, keys of
    what `measure` and `errors` give; ``against`` says in words what errors are counted against.
    ``of_torque`` says that the main error is one of torque, which the scene's tolerance limits;
    ``stand_in`` that the next accurate setting may be the reference where the most accurate one
    gave none; ``combined`` that a setting changes what `Together` measures.
    Instances hold nothing that changes: they are made anew in every process.
    """

    name: str
    title: str
    cost: str
    error: str
    against: str
    of_torque: bool
    stand_in: bool
    combined: bool

    def missing(self, case: Case) -> str:
        """Say in a sentence why this scene does not have the knob; empty where it does."""
        ...

    def settings(self, case: Case) -> tuple[Setting, ...]:
        """The settings, cheapest first; one of them is the present one."""
        ...

    def applied(self, case: Case, setting: Setting) -> Case:
        """The case with this setting: what `together` combines."""
        ...

    def expected_s(self, case: Case, setting: Setting) -> float:
        """Seconds that one repeat is expected to take, before anything was measured."""
        ...

    def repeats(self, case: Case, setting: Setting) -> int:
        """How often the setting is measured: three times, or once where one repeat takes long."""
        ...

    def measure(self, case: Case, setting: Setting, repeat: int) -> Sample:
        """Measure one repeat. A ScissorcalError that it raises makes the setting a named failure.

        ``repeat`` counts from 0; random numbers follow from it and the case's seed alone.
        """
        ...

    def errors(self, case: Case, sample: Sample, reference: Sample | None) -> Mapping[str, Error]:
        """The errors of a sample against the reference's: a sample of the same knob.

        ``reference`` is None where no setting has an accuracy above 0: the knob then counts
        against what it measured itself, such as the exact model.
        """
        ...


def make_knob(name: str) -> Knob:
    """Make the knob of a name that `KNOBS` has."""
    module, _, attribute = KNOBS[name].partition(":")
    knob: Knob = getattr(import_module(module), attribute)()
    return knob


def scene_knobs(case: Case) -> tuple[str, ...]:
    """The names of the knobs that a case's scene has."""
    return tuple(name for name in KNOBS if not make_knob(name).missing(case))
