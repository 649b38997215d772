"""Every channel that a recording may have beside its samples."""

from scissorcal.recording.plate_channels import FRAME, PICTURE, POSE
from scissorcal.recording.telemetry import CONTROL

CHANNELS = {channel.topic: channel for channel in (CONTROL, POSE, PICTURE, FRAME)}
"""Known channels by topic; a reader leaves others out."""
