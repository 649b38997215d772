"""Experiment design: which strokes narrow the band of a scene's torque the most per minute."""

from scissorcal.calibration.design.band import (
    Band,
    SceneSlopes,
    Sharing,
    TorqueKnowledge,
    expected_band,
)
from scissorcal.calibration.design.choice import (
    CaptureList,
    Design,
    Offer,
    Step,
    Stock,
    choose_captures,
    knowledge_after,
)
from scissorcal.calibration.design.information import (
    Information,
    Knowledge,
    cut_information,
    friction_information,
    line_information,
)
from scissorcal.calibration.design.state import PlannedMotion, planned_cut, planned_friction

__all__ = [
    "Band",
    "CaptureList",
    "Design",
    "Information",
    "Knowledge",
    "Offer",
    "PlannedMotion",
    "SceneSlopes",
    "Sharing",
    "Step",
    "Stock",
    "TorqueKnowledge",
    "choose_captures",
    "cut_information",
    "expected_band",
    "friction_information",
    "knowledge_after",
    "line_information",
    "planned_cut",
    "planned_friction",
]
