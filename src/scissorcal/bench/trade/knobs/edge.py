"""Candidate edges: a photographed edge projected onto simpler families."""

import time
from collections.abc import Sequence

from scissorcal.bench.trade.case import Case
from scissorcal.bench.trade.knobs.candidates import CandidateKnob, candidate_sample
from scissorcal.bench.trade.models import central_law
from scissorcal.bench.trade.package_cost import BYTES
from scissorcal.bench.trade.point import Sample, Setting
from scissorcal.errors import ScissorcalError
from scissorcal.package.simplest.law import Candidate, Law, fitted_candidate, simpler_candidates
from scissorcal.package.simplest.project import Reference, project
from scissorcal.recipe.schema import Recipe


class Edge(CandidateKnob):
    """The blade's edge: a line, an arc or a cubic in the place of what photographs gave.

    Simpler edges are not fitted to the photographs again but to what the present law predicts
    (`package.simplest.project`); the time counted is that of the projection.
    """

    name, title = "edge", "Candidate: edge"
    cost = BYTES
    against = "the edge of the present fit"
    combined = False  # a fit has the edge that photographs gave it

    def candidates(self, case: Case) -> Sequence[str]:
        """Those below the fitted edge, and that one itself."""
        law = _law(case)
        simpler = [one.name for one in simpler_candidates(law, "edge")]
        return (*simpler, self.fitted(case))

    def fitted(self, case: Case) -> str:
        """The family of the fit's edge."""
        return fitted_candidate(_law(case), "edge").name

    def recipe(self, recipe: Recipe, candidate: str) -> Recipe:
        """Unchanged: photographs decide which edge a fit has."""
        return recipe

    def single(self, case: Case) -> str:
        """A line has nothing simpler below it."""
        if self.fitted(case) != "line":
            return ""
        return "The edge is a line, the simplest candidate."

    def expected_s(self, case: Case, setting: Setting) -> float:
        """A projection at the MAP point."""
        return 2.0

    def measure(self, case: Case, setting: Setting, repeat: int) -> Sample:
        """Project the law at the MAP point onto the candidate, and compile it."""
        began = time.process_time()
        law = projected(case, setting.value)
        return candidate_sample(case, law, time.process_time() - began)


def projected(case: Case, family: str) -> Law:
    """The fitted law with the nearest edge of another family, at the MAP point.

    The law itself for its own family. Raises ScissorcalError where no such edge exists.
    """
    law, candidate = _law(case), Candidate("edge", family)
    if candidate == fitted_candidate(law, "edge"):
        return law
    try:
        return project(Reference.of(law, case.recipe), candidate).law
    except ValueError as error:
        raise ScissorcalError(f"The edge cannot be a {family}: {error}.") from error


def _law(case: Case) -> Law:
    assert case.cut_fit is not None
    return central_law(case, case.cut_fit, case.friction_fit)
