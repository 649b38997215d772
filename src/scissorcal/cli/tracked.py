"""The part of an answer that tells of the camera that followed the plate."""

from dataclasses import asdict
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from scissorcal.workday.tracking.tracking_camera import TrackedRun


def tracked_facts(tracked: "TrackedRun | None") -> dict[str, Any] | None:
    """Its figures for --json; None without a camera."""
    if tracked is None:
        return None
    facts = asdict(tracked)
    del facts["verdicts"]
    return facts
