"""What the checks of a probe guard, and in which time it ran."""

LINE = "the line, before a motor runs"
SENSORS = "the sensors, before a motor runs"
MOTORS = "the motors, before they run in earnest"
"""What checks of a probe guard begins so."""
REAL_TIME = "real_time"
"""Fact: 1 where the probe ran on a port, 0 in virtual time."""
