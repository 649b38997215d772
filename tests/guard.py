"""The one guard against hanging, for tests that wait for an event."""

GUARD_S = 300.0
"""What a test waits for comes whatever the load: this only ends one that would never come, so that
a run fails instead of hanging. Far beyond any wait that was seen (0.5 s beside four busy processes
on two cores), and shorter than the limit of a CI job. No outcome may depend on its value."""
GUARD_ms = 1e3 * GUARD_S
